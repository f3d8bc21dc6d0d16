"""What a start of the program loads, and what it leaves out."""

import subprocess
import sys

import pytest

LATE = {
    "scipy.optimize", "scipy.special", "scipy.spatial", "matplotlib", "pyamg", "ngsolve",
    "amontons.analysis.basins", "amontons.analysis.paths",
}  # fmt: skip


def loaded(code, folder):
    """Names of the modules of a fresh process that ran `code`, and all that it printed."""
    report = "import sys; print('MODULES', *sys.modules)"
    first = f"import atexit\natexit.register(lambda: exec({report!r}))\n"
    done = subprocess.run(
        [sys.executable, "-c", first + code],
        capture_output=True, text=True, cwd=folder, check=True,
    )  # fmt: skip
    printed, _, names = done.stdout.rpartition("MODULES ")
    return set(names.split()), printed


def test_a_model_is_solved_and_written_without_what_it_does_not_ask_for(tmp_path):
    code = """
import sys
sys.argv = "amontons solve example:cube --set mesh.cells=2 --no-figures --quiet -o out".split()
from amontons.__main__ import run
run()
"""
    names, _ = loaded(code, tmp_path)
    assert "numba" in names and "h5py" in names  # it did run
    assert not names & LATE


def test_a_discrete_problem_needs_no_linear_algebra_of_scipy(tmp_path):
    code = """
import amontons as am
problem = am.FrictionProblem.from_delassus(W=[[1, 0.2], [0.2, 1]], q=[[-1, 0.5]], mu=[0.3])
print(am.solve(problem).converged)
"""
    names, printed = loaded(code, tmp_path)
    assert printed.strip() == "True"
    assert not names & (LATE | {"scipy.sparse.linalg", "h5py", "rich"})


@pytest.mark.parametrize("command", ["--version", "examples"])
def test_nothing_searches_for_cycles_when_the_program_has_ended(command, tmp_path):
    code = f"""
import atexit, gc, sys
atexit.register(lambda: print("frozen", gc.get_freeze_count() > 0))
sys.argv = ["amontons", "{command}"]
from amontons.__main__ import run
run()
"""
    _, printed = loaded(code, tmp_path)
    assert printed.splitlines()[-1] == "frozen True"
