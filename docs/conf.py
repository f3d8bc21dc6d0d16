"""The site: `python -m sphinx -W --keep-going -n docs docs/_build/html` builds all of it.

`-D plot_gallery=0` leaves the gallery's pictures out: seconds, for a check of text and links;
`-t plain` the theme, half of the rest.
"""

import os
import sys
import tomllib
from pathlib import Path

DOCS = Path(__file__).parent
sys.path.insert(0, str(DOCS / "_extensions"))
sys.path.insert(0, str(DOCS.parent / "src"))
sys.path.append(str(DOCS.parent))  # the package `reproduce`, for pages of the gallery
os.environ.setdefault("OMP_NUM_THREADS", "1")  # the same pictures and times on any machine

from gallery_settings import gallery_settings  # noqa: E402  beside this file

with open(DOCS.parent / "pyproject.toml", "rb") as file:
    release = version = tomllib.load(file)["project"]["version"]
project = "amontons"
author = copyright = "The amontons developers"

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx_gallery.gen_gallery",
    "formulas",
    "outside",
    "reference",
]
exclude_patterns = ["_build", "_extensions", "gallery/**/README.md", "gallery/**/*.py"]
default_role = "code"
nitpicky = True

myst_enable_extensions = ["dollarmath", "amsmath", "colon_fence", "deflist"]
myst_heading_anchors = 3
myst_links_external_new_tab = False

autodoc_member_order = "bysource"
autodoc_typehints = "none"  # `reference` writes them as they stand in the code
python_maximum_signature_line_length = 80
autodoc_preserve_defaults = True
autosummary_generate = False  # `reference` writes the pages

sphinx_gallery_conf = gallery_settings(DOCS)

html_theme = "pydata_sphinx_theme"
html_title = f"amontons {release}"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_show_sourcelink = False
html_copy_source = False
html_math_renderer = "mathml"
html_theme_options = {
    "logo": {"text": "amontons"},
    "navigation_with_keys": False,
    "show_nav_level": 1,
    "navigation_depth": 2,
    "collapse_navigation": True,
    "header_links_before_dropdown": 7,
    "secondary_sidebar_items": ["page-toc"],
    "footer_start": ["copyright"],
    "footer_end": [],
}
if tags.has("plain"):  # noqa: F821  Sphinx gives them
    html_theme, html_theme_options = "basic", {}
linkcheck_ignore = [r"https://doi\.org/.*"]  # publishers refuse programs
linkcheck_timeout = 20
