"""Contact between bodies: projection against brute force, patch tests, left-out nodes."""

import numpy as np
import pytest

import amontons as am
from amontons.mechanics.contact.pairs import pair_contact, project
from amontons.mechanics.elements.elasticity import cell_stress
from amontons.mechanics.meshes.facets import Cells, Facets

SOFT = am.LinearElastic(young=100, poisson=0.3)


def warped_surface(seed, kind, n=6):
    """A bumpy surface over the unit square, quadrilaterals or triangles."""
    rng = np.random.default_rng(seed)
    side = np.linspace(0, 1, n + 1)
    x, y = np.meshgrid(side, side, indexing="ij")
    points = np.stack([x, y, 0.05 * rng.normal(size=x.shape)], axis=-1).reshape(-1, 3)
    index = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    quads = np.stack([index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]], axis=-1)
    quads = quads.reshape(-1, 4)
    if kind == "quad":
        return points, (Facets("quad", quads),)
    return points, (Facets("tri", np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])),)


def shapes(kind, a, b):
    if kind == "tri":
        return np.array([1 - a - b, a, b])
    return np.array([(1 - a) * (1 - b), a * (1 - b), a * b, (1 - a) * b])


@pytest.mark.parametrize("kind", ["tri", "quad"])
def test_projection_is_closer_than_any_sampled_point(kind):
    points, surface = warped_surface(0, kind)
    x = np.random.default_rng(1).uniform([0.25, 0.25, 0.1], [0.75, 0.75, 0.25], (50, 3))
    hit = project(x, points, surface)
    assert hit.found.all()
    foot = np.einsum("ka,kac->kc", hit.shape, points[hit.nodes])
    np.testing.assert_allclose(foot, hit.closest, atol=1e-14)
    np.testing.assert_allclose(hit.shape.sum(axis=1), 1)
    grid = np.linspace(0, 1, 21)
    samples = [
        shapes(kind, a, b) @ points[facet]
        for facet in surface[0].nodes
        for a in grid
        for b in grid
        if kind == "quad" or a + b <= 1 + 1e-12
    ]
    sampled = np.linalg.norm(x[:, None] - np.array(samples), axis=2).min(axis=1)
    distance = np.linalg.norm(x - hit.closest, axis=1)
    assert (distance <= sampled + 1e-12).all()
    assert (sampled - distance).max() < 5e-3
    assert (hit.normal[:, 2] > 0.5).all()


def test_projection_on_lines():
    points = np.array([[2.0, 0], [1, 0.2], [0, 0]])
    surface = (Facets("line", np.array([[0, 1], [1, 2]])),)
    hit = project(np.array([[0.5, 1.0], [1.0, 1.0], [2.5, 0.1]]), points, surface)
    np.testing.assert_array_equal(hit.found, [True, True, False])
    np.testing.assert_allclose(hit.closest[1], [1, 0.2])
    n = np.array([-0.2, 1]) / np.hypot(0.2, 1)
    np.testing.assert_allclose(hit.normal[0], n)


def test_graded_masters_are_searched_by_size():
    """A large facet whose centre is far away wins over small ones that are nearer to it."""
    points = np.array([[0.0, 0], [10, 0], [10.5, 0.0], [10.5, 5]])
    surface = (Facets("line", np.array([[1, 0], [2, 1], [3, 2]])),)
    hit = project(np.array([[9.0, 0.5]]), points, surface)
    np.testing.assert_allclose(hit.closest, [[9, 0]])


def stack(dim, lower_cells, upper_cells, mu=0.5, kind=None, **changes):
    """Two blocks on each other, on a floor, pressed from above by a pressure of 1."""
    size, up = (1,) * dim, (0,) * (dim - 1) + (1,)
    lower = am.Body(am.box(size, lower_cells, kind), SOFT, name="lower")
    upper = am.Body(am.box(size, upper_cells, kind, origin=up), SOFT, name="upper")
    parts = {
        "bodies": [lower, upper],
        "supports": [am.Fix("upper.top", (0,) * (dim - 1) + (None,))],
        "contacts": [
            am.Contact("lower.bottom", am.Plane(up), mu=mu),
            am.Contact("upper.bottom", master="lower.top", mu=mu, method="nodal"),
        ],
        "loads": [am.Traction("upper.top", (0,) * (dim - 1) + (-1,))],
    }
    return am.Model(**(parts | changes))


@pytest.mark.parametrize(("dim", "kind"), [(2, "quad"), (2, "tri"), (3, "hex"), (3, "tet")])
def test_matching_blocks_carry_a_uniform_pressure(dim, kind):
    free = am.LinearElastic(young=100, poisson=0.0)
    model = stack(dim, 2, 2, kind=kind)
    model = am.Model(
        [am.Body(b.mesh, free, name=b.name) for b in model.bodies],
        model.supports, model.contacts, model.loads,
    )  # fmt: skip
    solution = am.drive(model.assemble(), tolerance=1e-13)
    assert solution.convergence.error < 1e-12
    fields = model.recover(solution)
    np.testing.assert_allclose(fields.pressure, 1, atol=1e-12)
    np.testing.assert_allclose(fields.shear, 0, atol=1e-12)
    for body, displacement in zip(model.bodies, fields.displacement, strict=True):
        stress = cell_stress(body.mesh, body.material, displacement)
        np.testing.assert_allclose(stress[:, dim - 1, dim - 1], -1, atol=1e-11)


@pytest.mark.parametrize("dim", [2, 3])
def test_meshes_that_differ_stay_near_a_uniform_pressure(dim):
    model = stack(dim, 3, 4)
    solution = am.drive(model.assemble(), tolerance=1e-10)
    assert solution.converged
    fields = model.recover(solution)
    between = fields.body == 1
    force = fields.force[between].sum(axis=0)
    np.testing.assert_allclose(force[-1], 1, rtol=1e-8)
    np.testing.assert_allclose(fields.resultant[-1], 2, rtol=1e-8)  # floor and joint
    assert abs(fields.pressure[between] - 1).max() < 0.7


def test_action_is_reaction():
    """Columns of H sum to zero over both bodies: no force from nowhere, no moment either."""
    model = stack(3, (3, 2, 2), (2, 4, 2))
    parts = model.discretisation
    H = parts.placed[1].H
    points = np.concatenate([b.mesh.points for b in model.bodies])
    for axis in np.eye(3):
        push = np.tile(axis, len(points))
        turn = np.cross(axis, points).ravel()
        np.testing.assert_allclose(H.T @ push, 0, atol=1e-14)
        np.testing.assert_allclose(H.T @ turn, 0, atol=1e-13)


def test_frames_gap_and_left_out_nodes():
    lower = am.box((2, 1), (4, 2))
    upper = am.box((2, 1), (4, 2), origin=(1, 1.25))
    rows, on_master, found = pair_contact(upper, "bottom", lower, "top")
    assert found.tolist() == [True] * 3 + [False] * 2
    np.testing.assert_allclose(rows.gap, 0.25)
    np.testing.assert_allclose(rows.frames, [[[0, 1], [1, 0]]] * 3)
    assert on_master.shape == (lower.points.size, 6)
    near = pair_contact(upper, "bottom", lower, "top", search=0.3)[2]
    assert near.tolist() == found.tolist()
    with pytest.raises(am.InvalidInput, match="no part of the slave has a master"):
        pair_contact(upper, "bottom", lower, "top", search=0.2)
    with pytest.raises(am.InvalidInput, match="no part of the slave"):
        pair_contact(upper, "top", lower, "top")  # they do not face each other
    with pytest.raises(am.InvalidInput, match="no part of the slave"):
        pair_contact(lower, "bottom", lower, "top")  # through the body


def test_two_pieces_of_one_mesh_touch():
    """Master and slave in one mesh, as a mesh file gives them."""
    a, b = am.box((1, 1), 2), am.box((1, 1), 2, origin=(0, 1))
    n = len(a.points)
    surfaces = {
        "floor": a.surfaces["bottom"], "low": a.surfaces["top"],
        "high": tuple(Facets(f.kind, f.nodes + n) for f in b.surfaces["bottom"]),
        "roof": tuple(Facets(f.kind, f.nodes + n) for f in b.surfaces["top"]),
    }  # fmt: skip
    cells = (Cells("quad", np.concatenate([a.cells[0].nodes, b.cells[0].nodes + n])),)
    mesh = am.Mesh(np.concatenate([a.points, b.points]), cells, surfaces)
    model = am.Model(
        [am.Body(mesh, SOFT)],
        [am.Fix("floor", 0), am.Fix("roof", (0, -0.02))],
        [am.Contact("high", master="low", mu=0.3, method="nodal")],
    )
    solution = am.drive(model.assemble())
    assert solution.converged
    assert (solution.r[:, 0] > 0).all()


def test_unknown_masters_are_named():
    with pytest.raises(am.InvalidInput, match=r"'lower\.topp'.*did you mean"):
        stack(2, 2, 2, contacts=[am.Contact("upper.bottom", master="lower.topp", mu=1)])
    with pytest.raises(am.InvalidInput, match="either an obstacle or a master"):
        am.Contact("a", am.Plane((0, 1)), master="b", mu=1)
