"""The import rule, read from the files: eight rooms, imports go down, heavy packages alone."""

import ast
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest

import amontons

PACKAGE = Path(amontons.__file__).parent
ROOMS = "core < linear < problem < solvers < mechanics < analysis < io < app".split(" < ")
ALONE = {  # package: the folders or files that import it
    "ngsolve": "",  # tests alone compare with it
    "netgen": "mechanics/meshes/cad",
    "pyamg": "linear", "matplotlib": "io/plots", "click": "app/cli", "rslab": "linear",
    "pypardiso": "linear", "mumps": "linear", "petsc4py": "linear", "mpi4py": "linear",
    "meshio": "mechanics/meshes io/vtk",  # reads meshes, writes pictures
    "jax": "analysis/gradients/with_jax", "torch": "analysis/gradients/with_torch",
    "h5py": "core/hdf5 io",  # checks; the exchange format, results, states
}  # fmt: skip
INSIDE = {  # the same inside of a room
    "analysis": ("multipliers", "solutions", "certificates", "paths", "gradients",
                 "limits", "stability"),
    "mechanics": ("meshes", "elements", "contact", "model", "steps"),
    "problem": ("law", "judge"),
}
FILES = sorted(PACKAGE.rglob("*.py"))
INNER = {
    path: path.relative_to(PACKAGE)
    for path in FILES
    if path.name not in ("__init__.py", "__main__.py") or path.parent != PACKAGE
}


@cache
def nodes(path):
    """Imports and keywords of a file: every file is parsed once for all tests."""
    kinds = ast.Import | ast.ImportFrom | ast.keyword
    return [node for node in ast.walk(ast.parse(path.read_text())) if isinstance(node, kinds)]


@cache
def imported(path):
    """(module, names) of every import, absolute ones as they stand, relative ones from us."""
    package = path.relative_to(PACKAGE).parts[:-1]
    found = []
    for node in nodes(path):
        if isinstance(node, ast.Import):
            found += [(name.name, "") for name in node.names]
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            found.append((node.module, ""))
        elif isinstance(node, ast.ImportFrom):
            assert node.level <= len(package) + 1, f"{path}: import from above the package"
            inside = package[: len(package) + 1 - node.level]
            inside += tuple(node.module.split(".")) if node.module else ()
            found += [("amontons", ".".join((*inside, name.name))) for name in node.names]
    return found


def ours(path):
    """Dotted names below the package that a file imports."""
    return [name for package, name in imported(path) if package == "amontons" and name]


def test_there_are_eight_rooms():
    folders = {path.name for path in PACKAGE.iterdir() if path.is_dir()} - {"__pycache__"}
    assert folders == {*ROOMS, "examples_data"}
    assert {path.name for path in PACKAGE.glob("*.py")} == {"__init__.py", "__main__.py"}


@pytest.mark.parametrize("path", INNER, ids=lambda p: str(p.relative_to(PACKAGE)))
def test_imports_go_downwards(path):
    room = INNER[path].parts[0]
    for name in ours(path):
        target = name.split(".")[0]
        assert target == "__version__" or ROOMS.index(target) <= ROOMS.index(room), name


@pytest.mark.parametrize("room", INSIDE)
def test_imports_go_downwards_inside_a_room(room):
    order = INSIDE[room]
    for path, inner in INNER.items():
        if inner.parts[0] == room and inner.parts[1] in order:
            for name in ours(path):
                parts = name.split(".")
                if parts[0] == room and parts[1] in order:
                    place = order.index(inner.parts[1])
                    assert order.index(parts[1]) <= place, f"{path}: {name}"


@pytest.mark.parametrize("package", ALONE)
def test_heavy_packages_are_imported_in_one_place(package):
    users = {
        str(inner.with_suffix("")) for path, inner in INNER.items()
        for name, _ in imported(path) if name.split(".")[0] == package
    }  # fmt: skip
    places = ALONE[package].split()
    assert all(any(user == p or user.startswith(f"{p}/") for p in places) for user in users)


def test_kernels_are_kept_in_our_folder():
    for path in FILES:
        if path.name != "compiled.py":
            text = path.read_text().replace("compiled import njit", "")
            assert "import njit" not in text, path


def test_no_kernel_assumes_that_numbers_are_finite():
    for path in FILES:
        for node in nodes(path):
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


def test_solving_a_model_loads_no_other_finite_elements():
    loaded = modules_after(
        "import amontons as am\n"
        "body = am.Body(am.box((1, 1), 2), am.LinearElastic(1000, 0.3), order=2)\n"
        "contact = am.Contact('bottom', am.Plane(normal=(0, 1)), mu=0.3)\n"
        "am.solve(am.Model([body], [am.Fix('top', (0, -0.01))], [contact]))"
    )
    assert not {name.split(".")[0] for name in loaded} & {"ngsolve", "netgen", "meshio"}


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


@pytest.mark.parametrize("name", ["ConjugateGradient", "AlgebraicMultigrid"])
def test_names_that_are_gone_say_what_to_use(name):
    with pytest.raises(amontons.InvalidInput, match=r"GeometricMultigrid\(levels=\(\)\)"):
        getattr(amontons, name)
