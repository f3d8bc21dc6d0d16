"""The import rule, read from the files: downwards only, and heavy packages in one place."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import amontons

PACKAGE = Path(amontons.__file__).parent
ORDER = (
    "compiled < interrupts < errors < options < clock < dense < warned < files < hdf5 < "
    "checked_arrays < cones < linear < blocks < condensation < global_matrices < judge < "
    "judge_contacts < judge_sharp < problem < indefinite < nitsche_problem < one_sided < "
    "one_contact < status < settling < solution < solvers < judging < solve < fem < "
    "contact < model < masonry < granular < hild < vee < evolution < analysis < gallery < "
    "fclib < checkpoint < expressions < case < vtk < plots < output < results < report < "
    "api < cli"
).split(" < ")
ALONE = {  # package: the file or folder that imports it, one for each kind of file
    "ngsolve": "fem", "netgen": "fem", "pyamg": "linear", "matplotlib": "plots", "click": "cli",
    "rslab": "linear", "pypardiso": "linear", "mumps": "linear",
    "petsc4py": "linear", "mpi4py": "linear", "pymetis": "fem",
    "meshio": "fem vtk",  # reads meshes, writes pictures
    "h5py": "hdf5 fclib output checkpoint",  # checks, the exchange format, results, states
}  # fmt: skip
INSIDE = {"analysis": ("multipliers", "solutions", "certificates", "paths")}  # the same, in it
FILES = sorted(PACKAGE.rglob("*.py"))


def home(path):
    """First folder or file name below the package."""
    return path.relative_to(PACKAGE).parts[0].removesuffix(".py")


def imports(path):
    """(package or None, names) of every import, with relative ones resolved to our homes."""
    depth = len(path.relative_to(PACKAGE).parts)
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            for name in node.names:
                yield name.name
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            yield node.module
        elif isinstance(node, ast.ImportFrom) and node.level == depth:
            names = [node.module] if node.module else [name.name for name in node.names]
            yield from (f"amontons.{name}" for name in names)
        elif isinstance(node, ast.ImportFrom) and node.level > depth:
            raise AssertionError(f"{path}: import from above the package")


def test_every_module_has_its_place():
    homes = {home(path) for path in FILES} - {"__init__", "__main__"}
    known = set(ORDER) | {"examples_data"}
    assert homes <= known, f"put {homes - known} into ORDER"


@pytest.mark.parametrize("path", FILES, ids=lambda p: str(p.relative_to(PACKAGE)))
def test_imports_go_downwards(path):
    if home(path) in {"__init__", "__main__"}:
        return
    place = ORDER.index(home(path)) if home(path) in ORDER else 0
    for name in imports(path):
        target = name.split(".")[1] if name.startswith("amontons.") else "__version__"
        if target not in ("__version__", home(path)):
            assert ORDER.index(target) < place, f"{home(path)} imports {target}"


@pytest.mark.parametrize("folder", INSIDE)
def test_imports_go_downwards_inside_a_folder(folder):
    order = INSIDE[folder]
    for path in (PACKAGE / folder).rglob("*/*.py"):
        place = order.index(path.parent.name)
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.ImportFrom) and node.level == 2 and node.module:
                target = node.module.split(".")[0]
                assert target not in order or order.index(target) < place, f"{path}: {target}"


@pytest.mark.parametrize("package", ALONE)
def test_heavy_packages_are_imported_in_one_place(package):
    users = {home(p) for p in FILES for name in imports(p) if name.split(".")[0] == package}
    assert users <= set(ALONE[package].split())


def test_kernels_are_kept_in_our_folder():
    for path in FILES:
        if path.name != "compiled.py":
            text = path.read_text().replace("compiled import njit", "")
            assert "import njit" not in text, path


def test_no_kernel_assumes_that_numbers_are_finite():
    for path in FILES:
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.keyword) and node.arg == "fastmath":
                allowed = ast.literal_eval(node.value)  # True would let a NaN become anything
                assert isinstance(allowed, set), path
                assert allowed <= {"contract", "reassoc", "nsz"}, path


def modules_after(code):
    """Names of all modules loaded by a fresh interpreter that runs `code`."""
    report = f"{code}\nimport sys\nprint(*sys.modules)"
    done = subprocess.run(
        [sys.executable, "-c", report], capture_output=True, text=True, check=True
    )
    return set(done.stdout.split())


def test_importing_the_package_is_light():
    loaded = modules_after("import amontons")
    assert not loaded & {
        "numpy", "scipy", "numba", "ngsolve", "matplotlib", "h5py", "pyamg", "mpi4py"
    }  # fmt: skip


def test_discrete_problems_need_no_mesh_library():
    loaded = modules_after("import amontons; amontons.FrictionProblem; amontons.GaussSeidel")
    assert not loaded & {"ngsolve", "matplotlib", "h5py", "pyamg", "meshio", "click"}


def test_public_names_exist():
    assert amontons.__all__ == sorted(set(amontons.__all__))
    for name in amontons.__all__:
        assert getattr(amontons, name) is not None
    assert set(amontons.__all__) <= set(dir(amontons))
    with pytest.raises(AttributeError, match="nothing_like_this"):
        _ = amontons.nothing_like_this
