"""Fixtures for all tests: no window opens, and the shared folder of data is optional."""

import gc
import os
from pathlib import Path

# small matrices: threads of BLAS only wait for each other; set before NumPy is loaded
os.environ.setdefault("OMP_NUM_THREADS", "1")

import hypothesis
import matplotlib as mpl
import pytest

ROOT = Path(__file__).resolve().parents[1]


def pytest_configure(config: pytest.Config) -> None:
    mpl.use("Agg")
    # the first example of a test may compile: no deadline, but the same examples every time
    hypothesis.settings.register_profile("amontons", deadline=None, derandomize=True)
    hypothesis.settings.load_profile("amontons")


def pytest_collection_finish() -> None:
    """Search seldom for cycles, and not among tests and modules, which stay to the end.

    Compiling kernels makes so many objects that searching took a tenth of the time.
    """
    gc.collect()
    gc.freeze()
    gc.set_threshold(10_000, 10, 10)


@pytest.fixture(scope="session")
def shared() -> Path:
    """The folder of FCLib files and reference numbers; tests that need it skip without it."""
    folder = Path(os.environ.get("AMONTONS_SHARED", ROOT.parent / "shared"))
    if not folder.is_dir():
        pytest.skip(f"no shared data at {folder}; set AMONTONS_SHARED")
    return folder
