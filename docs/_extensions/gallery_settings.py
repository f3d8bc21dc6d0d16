"""The gallery: which folders, in which order, and how a script is run."""

from pathlib import Path
from typing import Any

SECTIONS = ("start", "laws", "questions", "mechanics", "papers")


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
        "reset_modules": ("matplotlib",),
        "image_srcset": [],
        "default_thumb_file": None,
        "capture_repr": ("_repr_html_",),
        "matplotlib_animations": False,
        "nested_sections": True,
        "write_computation_times": False,
    }
