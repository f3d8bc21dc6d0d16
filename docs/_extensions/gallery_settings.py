"""The gallery: which folders, in which order, and how a script is run."""

from pathlib import Path
from typing import Any

from matplotlib.figure import Figure
from sphinx_gallery.scrapers import figure_rst

LAST = "___"  # sphinx-gallery's name for the value of a block's last line
SECTIONS = ("start", "laws", "questions", "mechanics", "papers")


def figures_of_results(block, block_vars, gallery_conf) -> str:
    """A scraper: the figure that the last line of a block returned, as `solution.plot()` does.

    Figures of results are none of pyplot's, which alone are found otherwise.
    """
    shown = block_vars["example_globals"].get(LAST)
    if not isinstance(shown, Figure) or getattr(shown, "number", None) is not None:
        return ""
    path = next(block_vars["image_path_iterator"])
    shown.savefig(path, dpi=100, bbox_inches="tight")
    block_vars["example_globals"][LAST] = None  # once
    return figure_rst([path], gallery_conf["src_dir"])


def gallery_settings(docs: Path) -> dict[str, Any]:
    """The configuration of sphinx-gallery; a script runs again only when it has changed."""
    return {
        "examples_dirs": [str(docs / "gallery")],
        "gallery_dirs": ["made"],
        "filename_pattern": r"\.py$",
        "subsection_order": [f"gallery/{name}" for name in SECTIONS] + ["*"],
        "within_subsection_order": "FileNameSortKey",
        "remove_config_comments": True,
        "show_memory": False,
        "show_signature": False,
        "min_reported_time": 5,
        "plot_gallery": "True",
        "abort_on_example_error": False,
        "only_warn_on_example_error": False,
        "download_all_examples": False,
        "copyfile_regex": "",
        "image_scrapers": ("matplotlib", "gallery_settings.figures_of_results"),
        "reset_modules": ("matplotlib",),
        "image_srcset": [],
        "default_thumb_file": None,
        "capture_repr": ("_repr_html_",),
        "matplotlib_animations": False,
        "nested_sections": True,
        "write_computation_times": False,
    }
