"""Patch tests: a uniform stress passes between meshes that do not match, to rounding."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import amontons as am
from amontons.mechanics.meshes import second_order

STEEL = am.LinearElastic(200.0, 0.3)
EXACT = 1e-9  # what every method that claims it must reach
METHODS = {
    "mortar": "mortar", "nitsche": "nitsche", "symmetric": am.Nitsche(theta=1.0),
    "skew, stiff": am.Nitsche(theta=-1.0, kappa=1e5), "one point": am.Nitsche(points=1),
}  # fmt: skip
FLAT = [  # cells of slave and master, along x and up: not nested, nested either way, one cell
    ((3, 2), (7, 2)), ((5, 1), (4, 2)), ((3, 2), (6, 1)), ((6, 2), (3, 1)), ((1, 1), (5, 1)),
]  # fmt: skip
SOLID = [((3, 3, 2), (4, 5, 1)), ((3, 7, 1), (7, 3, 2)), ((2, 2, 1), (4, 4, 1)),
         ((5, 4, 1), (4, 5, 1))]  # fmt: skip
PAIRS_2D, PAIRS_3D = ["quad quad", "tri tri", "quad tri"], ["hex hex", "tet tet", "hex tet"]


def bent(mesh, amount):
    """The same box with its points moved, those of faces and edges in themselves."""
    rng = np.random.default_rng(7)
    low, high = mesh.bounding_box()
    shift = amount * (high - low) / mesh.grid * rng.uniform(-1, 1, mesh.points.shape)
    shift[(mesh.points == low) | (mesh.points == high)] = 0
    return am.Mesh(mesh.points + shift, mesh.cells, mesh.surfaces)


def gradient(stress, law):
    """Gradient of the displacement of a uniform stress that leaves the plane z = 0 even."""
    d, lame = len(stress), law.lame_lambda(len(stress))
    share = lame / (2 * law.shear + d * lame)
    G = (stress - share * np.trace(stress) * np.eye(d)) / (2 * law.shear)
    G[:-1, -1] *= 2
    G[-1, :-1] = 0
    return G


def errors(  # noqa: PLR0913
    cells, kinds, method, *, shear=0.2, amount=0.0, seed=None, order=1, laws=None, reduced=False
):
    """Largest error of displacements, relative, and of contact tractions under a pressure 1.

    A slave block "a" on a master "b" with the same footprint; the stress is uniform, tractions
    act on all sides, only the bottom of "b" is held.  seed: of a rotation of all.
    """
    d = len(cells[0])
    R = np.eye(d) if seed is None else rotation(d, seed)
    laws = laws or (STEEL, STEEL)
    stress = np.diag([0.0] * (d - 1) + [-1.0])
    stress[0, -1] = stress[-1, 0] = shear
    bodies, slopes = [], {}
    for name, count, kind, low, law in zip("ab", cells, kinds, (0, -1), laws, strict=True):
        mesh = am.box((1.3, 0.9, 1)[:d - 1] + (1,), count, kind, origin=(0,) * (d - 1) + (low,))
        mesh = bent(mesh, amount) if amount else mesh
        mesh = am.Mesh(mesh.points @ R.T, mesh.cells, mesh.surfaces)
        if order == "serendipity":
            mesh = second_order(mesh, serendipity=True)
        if reduced:
            cells_ = tuple(replace(b, integration="reduced") for b in mesh.cells)
            mesh = replace(mesh, cells=cells_)
        bodies.append(am.Body(mesh, law, name, order=mesh.order if order != 2 else 2))
        slopes[name] = R @ gradient(stress, law) @ R.T
    stress = R @ stress @ R.T
    normals = {"left": -R[:, 0], "right": R[:, 0], "front": -R[:, 1], "back": R[:, 1]}
    sides = [(f"{b}.{side}", n) for b in "ab" for side, n in list(normals.items())[:2 * d - 2]]
    loads = [am.Traction(on, tuple(stress @ n)) for on, n in [*sides, ("a.top", R[:, -1])]]
    held = am.Fix("b.bottom", lambda x: tuple(slopes["b"] @ x))
    contact = am.Contact("a.bottom", master="b.top", mu=0.5, method=method)
    model = am.Model(bodies, [held], [contact], loads)
    solution = am.solve(model, tolerance=1e-13, check=False)
    exact = [body.mesh.points @ slopes[body.name].T for body in bodies]
    pairs = zip(solution.displacement, exact, strict=True)
    moved = max(np.abs(u - v).max() for u, v in pairs) / np.abs(exact[0]).max()
    local = np.c_[solution.pressure, solution.shear]
    acting = np.einsum("pkc,pk->pc", solution.frames, local)
    return moved, np.abs(acting + stress @ R[:, -1]).max()


def rotation(d, seed):
    if d == 2:
        c, s = np.cos(seed), np.sin(seed)
        return np.array([[c, -s], [s, c]])
    return Rotation.random(random_state=seed).as_matrix()


CASES = [(c, k) for c in FLAT for k in PAIRS_2D] + [(c, k) for c in SOLID for k in PAIRS_3D]


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(("cells", "kinds"), CASES)
def test_a_uniform_stress_passes(cells, kinds, method):
    assert max(errors(cells, kinds.split(), METHODS[method])) < EXACT


@pytest.mark.parametrize("method", ["mortar", "nitsche"])
@pytest.mark.parametrize("amount", [0.1, 0.3])
@pytest.mark.parametrize(("cells", "kinds"), [CASES[0], CASES[8], CASES[-3], CASES[-1]])
def test_it_passes_bent_meshes_in_any_direction(cells, kinds, amount, method):
    for seed in (1, 2):
        assert max(errors(cells, kinds.split(), method, amount=amount, seed=seed)) < EXACT


@pytest.mark.parametrize("method", ["mortar", "nitsche"])
def test_it_passes_a_master_of_three_nearly_folded_facets(method):
    found = errors(((6, 6, 2), (1, 3, 2)), (None, None), method, amount=0.289, seed=96)
    assert max(found) < EXACT


@pytest.mark.parametrize("method", ["mortar", "nitsche"])
@pytest.mark.parametrize("d", [2, 3])
def test_it_passes_between_materials_that_agree_along_the_surface(d, method):
    """Without poisson's effect and shear any two do."""
    soft, hard = am.LinearElastic(3.0, 0.0), am.LinearElastic(2e4, 0.0)
    cells = FLAT[0] if d == 2 else SOLID[0]
    for laws in ((soft, hard), (hard, soft)):
        found = errors(cells, (None, None), method, shear=0.0, laws=laws)
        assert max(found) < EXACT


@pytest.mark.parametrize("variant", [m for m in METHODS if m != "mortar"])
@pytest.mark.parametrize(("cells", "kinds"), [CASES[0], CASES[1], CASES[15], CASES[17]])
def test_nitsche_passes_it_with_second_order(cells, kinds, variant):
    assert max(errors(cells, kinds.split(), METHODS[variant], order=2)) < EXACT
    assert max(errors(cells, kinds.split(), METHODS[variant], order=2, amount=0.2)) < EXACT


SECOND = [(CASES[0], 2), (CASES[1], 2), (CASES[2], 2), (CASES[15], 2), (CASES[16], 2),
          (CASES[17], 2), (CASES[0], "serendipity"), (CASES[15], "serendipity"),
          (CASES[17], "serendipity"), (CASES[18], "serendipity")]  # fmt: skip


@pytest.mark.parametrize(("case", "order"), SECOND)
@pytest.mark.parametrize("method", ["mortar", "nitsche"])
def test_it_passes_second_order(case, order, method):
    cells, kinds = case
    for amount, seed in ((0.0, None), (0.2, 3)):
        found = errors(cells, kinds.split(), method, order=order, amount=amount, seed=seed)
        assert max(found) < EXACT


@pytest.mark.parametrize("case", [CASES[0], CASES[15]])
def test_it_passes_with_reduced_integration(case):
    cells, kinds = case
    found = errors(cells, kinds.split(), "mortar", order="serendipity", reduced=True)
    assert max(found) < EXACT


@pytest.mark.parametrize("d", [2, 3])
def test_nodes_pass_it_where_meshes_match(d):
    cells = ((3, 2, 1)[3 - d:], (3, 2, 2)[3 - d:])
    assert max(errors(cells, (None, None), "nodal")) < EXACT
    assert max(errors(FLAT[0] if d == 2 else SOLID[0], (None, None), "nodal")) > 0.05


@pytest.mark.parametrize("method", ["mortar", "nitsche"])
def test_it_passes_random_meshes(method):
    """Grids with random lines, so that facets overlap by slivers too."""
    rng = np.random.default_rng(11)
    for k in range(6):
        d = 2 + k % 2
        cells = tuple(tuple(rng.integers(1, 7, d - 1)) + (1,) for _ in range(2))
        kinds = rng.choice(["hex", "tet"] if d == 3 else ["quad", "tri"], 2)
        found = errors(cells, kinds, method, amount=0.3 * rng.random(), seed=k)
        assert max(found) < EXACT
