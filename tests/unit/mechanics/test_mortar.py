"""Dual mortar contact: clipping, dual functions, patch tests, balance of forces, rims."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import amontons as am
from amontons.mechanics.contact.clipping import clip, quadrature
from amontons.mechanics.contact.dual import dual_functions, nodes_with_multiplier
from amontons.mechanics.contact.mortar import mortar_contact, mortar_obstacle
from amontons.mechanics.contact.nodal import nodal_contact
from amontons.mechanics.contact.overlap import winding_number
from amontons.mechanics.contact.segments import Surface
from amontons.mechanics.elements.elasticity import cell_stress
from amontons.mechanics.meshes.facets import Cells, Facets
from amontons.problem.one_sided import one_sided

SOFT = am.LinearElastic(young=100, poisson=0.0)
RUBBER = am.LinearElastic(young=100, poisson=0.3)


def areas(subject, window):
    corners, count = clip(subject, window)
    polygon, _, weight = quadrature(corners, count, 2)
    return np.bincount(polygon, weight.sum(axis=1), minlength=len(subject))


def polygons(rng, k, n):
    angle = np.sort(rng.uniform(0, 2 * np.pi, (k, n)), axis=1)
    return np.stack([np.cos(angle), np.sin(angle)], axis=2)


@pytest.mark.parametrize(("n", "m"), [(3, 3), (3, 4), (4, 3), (4, 4)])
def test_parts_of_a_polygon_add_up_to_it(n, m):
    """Cut by the cells of a grid; and whoever is the window, the area is the same."""
    rng = np.random.default_rng(n + 4 * m)
    subject = polygons(rng, 30, n)
    square = np.array([[0, 0], [1, 0], [1, 1], [0, 1]]) / 2
    corner = np.stack(np.meshgrid(*[np.arange(-1, 1, 0.5)] * 2), axis=-1).reshape(-1, 1, 2)
    total = sum(areas(subject, np.tile(corner[k] + square, (30, 1, 1))) for k in range(16))
    whole = areas(subject, np.tile(4 * square[None] - 1, (30, 1, 1)) * 1.0)
    np.testing.assert_allclose(total, whole, atol=1e-14)
    other = polygons(rng, 30, m) + 0.3
    np.testing.assert_allclose(areas(subject, other), areas(other, subject), atol=1e-14)
    assert (areas(subject, other) > 0.01).any()


def test_dual_functions_are_biorthogonal_and_add_up_to_one():
    rng = np.random.default_rng(0)
    root = rng.uniform(0.1, 1, (5, 4, 6))  # shape functions at six points that add up to one
    phi = root / root.sum(axis=1, keepdims=True)
    mass = phi @ np.swapaxes(phi, 1, 2)
    real = np.ones((5, 4), dtype=bool)
    kept = np.array([[1, 1, 1, 1], [1, 1, 0, 1], [0, 1, 0, 1], [0, 0, 1, 0], [1, 0, 0, 1]]) > 0
    psi = dual_functions(mass, kept, real)
    np.testing.assert_allclose(psi.sum(axis=1) @ np.ones(4), 4, atol=1e-11)
    np.testing.assert_allclose(np.einsum("fqa,fax->fx", psi, phi), 1, atol=1e-11)
    product = psi @ mass
    for f in range(5):
        part = product[f][np.ix_(kept[f], kept[f])]
        np.testing.assert_allclose(part, np.diag(mass[f].sum(axis=1)[kept[f]]), atol=1e-11)
        assert not psi[f][~kept[f]].any()


def test_every_facet_has_a_multiplier():
    nodes = np.array([[0, 1], [2, 3], [4, 5]])
    held = np.array([False, True, True, True, False, True])
    hardly = np.array([False, False, False, False, True, True])
    reached = np.array([1, 1, 1, 1, 0.02, 0.01])
    kept = nodes_with_multiplier(nodes, nodes >= 0, held, hardly, reached)
    assert kept.tolist() == [True, False, True, True, True, False]


def distorted(mesh, amount=0.12, seed=0):
    """The same box with its inner points moved, faces and edges in themselves."""
    rng = np.random.default_rng(seed)
    low, high = mesh.bounding_box()
    grid = (high - low) / np.array(mesh.grid)
    shift = amount * grid * rng.uniform(-1, 1, mesh.points.shape)
    shift[(mesh.points == low) | (mesh.points == high)] = 0
    return am.Mesh(mesh.points + shift, mesh.cells, mesh.surfaces)


def two_blocks(dim, lower, upper, kinds=(None, None), *, change=None, material=SOFT, **parts):
    """Two blocks on each other, pressed from above until the pressure is 1."""
    size, up = (1,) * dim, (0,) * (dim - 1) + (1,)
    low = am.box(size, lower, kinds[0])
    high = am.box(size, upper, kinds[1], origin=up)
    if change:
        low, high = change(low), change(high)
    bodies = [am.Body(low, material, name="lower"), am.Body(high, material, name="upper")]
    push = (0,) * (dim - 1) + (-0.02,)
    model = {
        "supports": [am.Fix("upper.top", push), am.Fix("lower.bottom", 0)],
        "contacts": [am.Contact("upper.bottom", master="lower.top", mu=0.5, method="mortar")],
    }
    return am.Model(bodies, **(model | parts))


MESHES = [
    (2, 3, 4, ("quad", "quad")), (2, 5, 2, ("tri", "quad")),
    (2, (3, 1), (7, 2), ("quad", "tri")),
    (3, (2, 3, 1), (3, 2, 1), ("hex", "hex")), (3, 2, (4, 4, 2), ("hex", "hex")),
    (3, (2, 2, 1), 3, ("hex", "tet")), (3, 3, (2, 1, 2), ("tet", "hex")),
]  # fmt: skip


@pytest.mark.parametrize(("dim", "lower", "upper", "kinds"), MESHES)
def test_uniform_pressure_passes_meshes_that_do_not_match(dim, lower, upper, kinds):
    model = two_blocks(dim, lower, upper, kinds)
    solution = am.solve(model, tolerance=1e-12)
    np.testing.assert_allclose(solution.pressure, 1, rtol=1e-10)
    np.testing.assert_allclose(solution.shear, 0, atol=1e-10)
    for body, displacement in zip(model.bodies, solution.displacement, strict=True):
        stress = cell_stress(body.mesh, body.material, displacement)
        np.testing.assert_allclose(stress[:, dim - 1, dim - 1], -1, rtol=1e-10)
    assert one_sided(model.assemble()) is not None


def test_uniform_pressure_passes_distorted_quadrilaterals():
    """Their shape functions are rational on the plane: exact up to the quadrature."""
    model = two_blocks(3, (3, 3, 1), (2, 4, 1), change=distorted)
    solution = am.solve(model, tolerance=1e-12)
    np.testing.assert_allclose(solution.pressure, 1, rtol=1e-8)


def blocks_apart(dim, shift, lower=3, upper=4, kinds=(None, None)):
    low = am.box((1,) * dim, (lower,) * (dim - 1) + (1,), kinds[0])
    high = am.box((1,) * dim, (upper,) * (dim - 1) + (1,), kinds[1], origin=(*shift, 1))
    return low, high


@pytest.mark.parametrize("kinds", [("hex", "hex"), ("hex", "tet")])
@pytest.mark.parametrize("overhang", [1e-9, 1e-6, 1e-3, 0.03, 0.12, 0.2, 0.5])
def test_forces_and_moments_balance_on_a_partly_covered_surface(overhang, kinds):
    """A traction of one on what is covered: its resultant, on both sides, and no moment."""
    shift = (overhang, 0.7 * overhang)
    low, high = blocks_apart(3, shift, kinds=kinds)
    rows, on_master, _ = mortar_contact(high, "bottom", low, "top")
    points = np.concatenate([high.points, low.points])
    H = np.vstack([rows.H.toarray(), on_master.toarray()])
    for axis in np.eye(3):
        np.testing.assert_allclose(H.T @ np.tile(axis, len(points)), 0, atol=5e-14)
        np.testing.assert_allclose(H.T @ np.cross(axis, points).ravel(), 0, atol=5e-14)
    traction = np.zeros((len(rows.nodes), 3))
    traction[:, 0] = 1
    force = (H @ (rows.weights[:, None] * traction).ravel()).reshape(-1, 3)
    area = (1 - shift[0]) * (1 - shift[1])
    np.testing.assert_allclose(force[: len(high.points), 2].sum(), area, rtol=1e-7)
    centre = force[len(high.points) :, 2] @ low.points[:, :2]
    expected = -area * (1 + np.array(shift)) / 2
    np.testing.assert_allclose(centre, expected, rtol=1e-7)
    np.testing.assert_allclose(rows.gap, 0, atol=1e-13)
    assert abs(H).max() < 5


def test_action_is_reaction_on_curved_surfaces():
    """Forces cancel to rounding on surfaces with gaps between them, too."""
    low, high = blocks_apart(3, (0, 0), 5, 4)
    waves = [0.1 * np.sin(3 * m.points[:, :1]) * (m.points[:, 2:] == 1) for m in (low, high)]
    low, high = (
        am.Mesh(m.points + [0, 0, 1] * wave, m.cells, m.surfaces)
        for m, wave in zip((low, high), waves, strict=True)
    )
    rows, on_master, found = mortar_contact(high, "bottom", low, "top")
    assert found.all()
    for axis in np.eye(3):
        push = rows.H.T @ np.tile(axis, 50) + on_master.T @ np.tile(axis, 72)
        np.testing.assert_allclose(push, 0, atol=1e-14)
    np.testing.assert_allclose(rows.frames[:, 0, 2] > 0.8, True)
    assert 1e-4 < abs(rows.gap).max() < 0.02


def test_gaps_have_the_signs_of_nodal_contact():
    low, high = blocks_apart(2, (0.0,))
    for rise in (0.2, -0.1):
        moved = am.Mesh(high.points + [0, rise], high.cells, high.surfaces)
        rows = mortar_contact(moved, "bottom", low, "top")[0]
        np.testing.assert_allclose(rows.gap, rise)
        np.testing.assert_allclose(rows.frames, [[[0, 1], [1, 0]]] * 5, atol=1e-15)
        np.testing.assert_allclose(rows.weights, [0.125, 0.25, 0.25, 0.25, 0.125])


@pytest.mark.parametrize("dim", [2, 3])
def test_obstacles_push_on_average(dim):
    """Against a plane mortar is nodal; to a ball the mean gap is smaller than the nodal."""
    up = (0,) * (dim - 1) + (1,)
    mesh = am.box((1,) * dim, 3)
    nodal = nodal_contact(mesh, "bottom", am.Plane((*up[:-1], 2), (0,) * (dim - 1) + (-0.1,)))
    rows, found = mortar_obstacle(
        mesh, "bottom", am.Plane((*up[:-1], 2), (0,) * (dim - 1) + (-0.1,))
    )
    assert found.all()
    for name in ("nodes", "weights", "gap", "frames"):
        np.testing.assert_allclose(getattr(rows, name), getattr(nodal, name), atol=1e-15)
    np.testing.assert_allclose(rows.H.toarray(), nodal.H.toarray(), atol=1e-15)
    ball = am.Sphere((0.5,) * (dim - 1) + (-2,), 1.9)
    off = mortar_obstacle(mesh, "bottom", ball)[0].gap - nodal_contact(mesh, "bottom", ball).gap
    curvature = (
        dim - 1
    ) / 2  # of the gap, over h^2: int psi (x - x_p)^2 / D_p = -h^2 / 6 inside
    assert off.min() < -0.5 * curvature * (1 / 3) ** 2 / 6 / 2
    assert off.min() > -curvature * (1 / 3) ** 2 / 6


def pressed(rotation=None, length=1.0, force=1.0):
    """A block with a round foot pushed and dragged on another, in other units and axes."""
    low, high = blocks_apart(3, (0.1, 0.15), 4, 3)
    turn = np.eye(3) if rotation is None else rotation.as_matrix()
    round_foot = (high.points[:, 2:] == 1) * [0, 0, 0.05]
    rise = round_foot * ((high.points[:, :2] - 0.6) ** 2).sum(axis=1, keepdims=True)
    material = am.LinearElastic(young=100 * force / length**2, poisson=0.3)
    bodies = [
        am.Body(am.Mesh(length * points @ turn.T, m.cells, m.surfaces), material, name=name)
        for m, points, name in ((low, low.points, "lower"), (high, high.points + rise, "upper"))
    ]
    move = tuple(length * turn @ [0.01, 0.002, -0.05])
    return am.Model(
        bodies,
        [am.Fix("lower.bottom", 0), am.Fix("upper.top", move)],
        [am.Contact("upper.bottom", master="lower.top", mu=0.3, method="mortar")],
    )


def test_results_depend_on_neither_axes_nor_units():
    rotation = Rotation.from_rotvec([0.3, -1.1, 0.7])
    plain = am.solve(pressed(), tolerance=1e-11)
    assert min(plain.counts.values()) > 0
    turned = am.solve(pressed(rotation), tolerance=1e-11)
    size = abs(plain.pressure).max()
    np.testing.assert_allclose(turned.pressure, plain.pressure, atol=1e-8 * size)
    np.testing.assert_allclose(
        turned.force, plain.force @ rotation.as_matrix().T, atol=1e-8 * abs(plain.force).max()
    )
    scaled = am.solve(pressed(length=1e3, force=1e-4), tolerance=1e-11)
    np.testing.assert_allclose(1e10 * scaled.pressure, plain.pressure, atol=1e-8 * size)
    np.testing.assert_allclose(1e-3 * scaled.gap, plain.gap, atol=1e-9)


def half_or_whole(dim, half):
    """A soft block with a round foot on another one; x < 0 is left out in the half."""
    cells = (lambda n: (n, 2)) if dim == 2 else (lambda n: (n, 2, 1))

    def block(n, height, name):
        width, start = (1, 0) if half else (2, -1)
        rest = (0,) * (dim - 2)
        mesh = am.box((width, *[1] * (dim - 1)), (n if half else 2 * n, *cells(n)[1:]),
                      origin=(start, *rest, height))  # fmt: skip
        points = mesh.points.copy()
        if name == "upper":
            points[:, -1] += 0.02 * points[:, 0] ** 2 * (points[:, -1] == 1)
        return am.Body(am.Mesh(points, mesh.cells, mesh.surfaces), RUBBER, name=name)

    rest = (None,) * (dim - 2)
    supports = [am.Fix("lower.bottom", 0), am.Fix("upper.top", (0, *(0,) * (dim - 2), -0.05))]
    if half:
        supports += [am.Fix(f"{b}.left", (0, *rest, None)) for b in ("lower", "upper")]
    contact = am.Contact("upper.bottom", master="lower.top", mu=0.2, method="mortar")
    return am.Model([block(3, 0, "lower"), block(4, 1, "upper")], supports, [contact])


@pytest.mark.parametrize("dim", [2, 3])
def test_half_a_model_gives_half_of_the_solution(dim):
    model = half_or_whole(dim, True)
    half, whole = (
        am.solve(model, tolerance=1e-11),
        am.solve(half_or_whole(dim, False), tolerance=1e-11),
    )
    # the foot passes for a circle, which half of it tells a little differently
    np.testing.assert_allclose(half.resultant[-1], whole.resultant[-1] / 2, rtol=1e-5)
    size = whole.pressure.max()
    for x, pressure in zip(half.points, half.pressure, strict=True):
        same = np.linalg.norm(whole.points - x, axis=1) < 1e-9
        np.testing.assert_allclose(whole.pressure[same], pressure, atol=1e-5 * size)
    basis = one_sided(model.assemble())
    assert (basis.dofs < 0).sum() == (1 if dim == 2 else 3)


def test_nodes_that_supports_hold_leave_their_share_to_others():
    """A side of the slave is held: uniform traction still arrives, on fewer multipliers."""
    supports = [am.Fix("lower.bottom", 0), am.Fix("upper.left", (0, 0, -0.02))]
    model = two_blocks(3, 3, (4, 3, 2), supports=supports)
    held = model.discretisation
    rows = held.placed[0].rows
    assert rows.points[:, 0].min() == 0.25
    assert len(rows.nodes) == 16
    traction = np.zeros((16, 3))
    traction[:, 0] = 1
    force = (held.whole_H @ (rows.weights[:, None] * traction).ravel()).reshape(-1, 3)
    split = held.offsets[1] // 3
    np.testing.assert_allclose(force[:split, 2].sum(), -1)  # all of it on the master
    np.testing.assert_allclose(force.sum(axis=0), 0, atol=1e-14)
    solution = am.solve(model)
    assert solution.converged
    assert one_sided(model.assemble()) is not None


SPRINGS = {"stiffness": 1.0, "stick_stiffness": 0.5}
CURVE = am.OverclosureCurve((0, 1), (0, 1))


@pytest.mark.parametrize(("dim", "order", "kind", "first", "last", "law", "shear"), [
    (2, 1, "quad", 1.1, 2.3, {"mu": 0.9, **SPRINGS}, 0.025),
    (2, 1, "quad", 0.0, 4.0, {"mu": 0.1, "cohesion": 0.05, **SPRINGS}, 0.015),
    (2, 1, "tri", 1.97, 3.2, {"mu": 0.5, "cap": 0.01, **SPRINGS}, 0.01),
    (2, 2, "quad", 0.0, 4.0, {"tresca": 0.01, "stiffness": 1.0}, 0.01),
    (2, 2, "tri", 1.1, 2.3, {"mu": 0.1, "stiffness": CURVE}, 0.01),
    (3, 1, "hex", 1.1, 2.3, {"mu": 0.9, **SPRINGS}, 0.025),
    (3, 1, "tet", 1.97, 3.2, {"tied": True, **SPRINGS}, 0.025),
])  # fmt: skip
def test_laws_are_those_of_all_that_neighbours_of_dropped_nodes_bear(
    dim, order, kind, first, last, law, shear
):
    """A block inside facets of the slave, or a slave with held ends: .1 deep, .05 slid."""
    mid, wide = (0,) * (dim - 2), (1,) * (dim - 1)
    slab = am.box((4, *wide), (4, *wide), kind, origin=(0, *mid, -1))
    block = am.box((last - first, *wide), (2, *wide), kind, origin=(first, *mid, 0))
    stiff = am.LinearElastic(young=1e6, poisson=0.0)
    bodies = [am.Body(mesh, stiff, name=name, order=order)
              for mesh, name in ((slab, "lower"), (block, "upper"))]  # fmt: skip
    held = [am.Fix("lower.bottom", 0), am.Fix("upper.top", (0.05, *mid, -0.1))]
    if last - first == 4:
        held += [am.Fix(f"lower.{side}", 0) for side in ("left", "right")]
    contact = am.Contact("lower.top", master="upper.bottom", method="mortar", **law)
    found = am.solve(am.Model(bodies, held, [contact]), tolerance=1e-10)
    (pair,), area = found.pairs.values(), last - first
    assert pair.area == pytest.approx(area, rel=1e-9)
    np.testing.assert_allclose(found.pressure, 0.1, rtol=1e-4)
    np.testing.assert_allclose(np.linalg.norm(found.shear, axis=1), shear, rtol=1e-4)
    np.testing.assert_allclose(abs(found.resultant[[0, -1]]), [shear * area, 0.1 * area],
                               rtol=1e-4)  # fmt: skip


def test_one_slave_meets_two_bodies():
    left = am.Body(am.box((1, 1), (3, 2)), SOFT, name="left")
    right = am.Body(am.box((1, 1), (5, 2), origin=(1, 0)), SOFT, name="right")
    beam = am.Body(am.box((2, 1), (7, 2), origin=(0, 1)), SOFT, name="beam")
    model = am.Model(
        [left, right, beam],
        [am.Fix("left.bottom", 0), am.Fix("right.bottom", 0), am.Fix("beam.top", (0, None))],
        [am.Contact("beam.bottom", master=f"{side}.top", mu=0.3, method="mortar")
         for side in ("left", "right")],
        [am.Traction("beam.top", (0, -1))],
    )  # fmt: skip
    solution = am.solve(model)
    np.testing.assert_allclose(solution.resultant, (0, 2), atol=1e-7)
    np.testing.assert_allclose(solution.pressure, 1, atol=0.02)


def test_an_overlap_deeper_than_a_facet_is_found():
    """0.3 deep with facets of 0.1; but the far side of a body is not in contact."""
    low = am.box((1, 1), (10, 10))
    high = am.box((1, 1), (8, 8), origin=(0, 0.7))
    rows, _, found = mortar_contact(high, "bottom", low, "top")
    assert found.all()
    np.testing.assert_allclose(rows.gap, -0.3)
    solid, over = am.box((1, 1, 1), 4), am.box((1, 1, 1), 3, origin=(0, 0, 0.4))
    np.testing.assert_allclose(mortar_contact(over, "bottom", solid, "top")[0].gap, -0.6)
    with pytest.raises(am.InvalidInput, match="no part of the slave has a master"):
        mortar_contact(low, "bottom", low, "top")


def test_winding_number():
    for mesh in (am.box((1, 1), 2, "tri"), am.box((1, 1, 1), 2, "tet"), am.box((1, 1, 1), 2)):
        assert winding_number(mesh, np.full(mesh.dim, 0.3)) == pytest.approx(1)
        assert winding_number(mesh, np.full(mesh.dim, 1.3)) == pytest.approx(0, abs=1e-12)


def test_bad_surfaces_are_named():
    low, high = blocks_apart(3, (0, 0))
    with pytest.raises(am.InvalidInput, match="9 facets are on both sides"):
        mortar_contact(low, "top", low, "top")
    with pytest.raises(am.InvalidInput, match="no part of the slave has a master"):
        mortar_contact(high, "top", low, "top")
    away = am.Mesh(high.points + [3, 0, 0], high.cells, high.surfaces)
    with pytest.raises(am.InvalidInput, match="no part of the slave has a master"):
        mortar_contact(away, "bottom", low, "top")


def test_facets_without_area_are_named():
    """Meshes do not accept such cells; another source of facets might have them."""
    points = np.array([[0, 0, 0], [1, 0, 0], [1 + 1e-13, 1e-13, 0], [0.5, 0.2, 1.0]])
    with pytest.raises(am.InvalidInput, match=r"'foot'.*nodes \[0, 1, 2\].*no area"):
        Surface.of(points, (Facets("tri", np.array([[0, 1, 2]])),), "foot")


def test_two_pieces_of_one_mesh():
    a, b = am.box((1, 1), 2), am.box((1, 1), 3, origin=(0, 1))
    n = len(a.points)
    surfaces = {
        "floor": a.surfaces["bottom"], "low": a.surfaces["top"],
        "high": tuple(Facets(f.kind, f.nodes + n) for f in b.surfaces["bottom"]),
    }  # fmt: skip
    cells = (Cells("quad", np.concatenate([a.cells[0].nodes, b.cells[0].nodes + n])),)
    mesh = am.Mesh(np.concatenate([a.points, b.points]), cells, surfaces)
    rows, on_master, found = mortar_contact(mesh, "high", mesh, "low")
    assert found.all()
    np.testing.assert_allclose(
        (rows.H + on_master).T @ np.ones(mesh.points.size), 0, atol=1e-14
    )


def test_supports_may_not_push_into_an_obstacle():
    mesh = am.Body(am.box((1, 1), 3), SOFT)
    contact = am.Contact("bottom", am.Plane((0, 1)), mu=0.3, method="mortar")
    with pytest.raises(am.InvalidInput, match=r"supports hold the node.*push it 0.1"):
        am.Model([mesh], [am.Fix("left", (0, -0.1))], [contact]).assemble()


@pytest.mark.parametrize("seed", range(12))
def test_blocks_at_any_angle(seed):
    """Covered area, its centre, balance and moderate averages, however facets cross."""
    rng = np.random.default_rng(seed)
    kinds = rng.choice(["hex", "tet"], 2)
    low = distorted(am.box((1, 1, 1), (*rng.integers(1, 7, 2), 1), kinds[0]), seed=seed)
    size = rng.uniform(0.5, 1.5, 3)
    high = distorted(am.box(size, (*rng.integers(1, 7, 2), 1), kinds[1]), seed=seed)
    turn = Rotation.from_euler("z", rng.uniform(0, 2 * np.pi)).as_matrix()
    middle = [0.5, 0.5, 1] + np.append(rng.uniform(-0.4, 0.4, 2), 0)
    corners = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]) * size
    place = [
        (x - [size[0] / 2, size[1] / 2, 0]) @ turn.T + middle for x in (corners, high.points)
    ]
    window = np.array([[[0, 0], [1, 0], [1, 1], [0, 1.0]]])
    _, where, weight = quadrature(*clip(place[0][None, :, :2], window), 2)
    axes = Rotation.random(rng=rng).as_matrix()
    bodies = [am.Mesh(points @ axes.T, mesh.cells, mesh.surfaces)
              for points, mesh in ((place[1], high), (low.points, low))]  # fmt: skip
    rows, on_master, _ = mortar_contact(bodies[0], "bottom", bodies[1], "top")
    H = np.vstack([rows.H.toarray(), on_master.toarray()])
    points = np.concatenate([body.points for body in bodies])
    for axis in np.eye(3):
        np.testing.assert_allclose(H.T @ np.tile(axis, len(points)), 0, atol=1e-12)
        np.testing.assert_allclose(H.T @ np.cross(axis, points).ravel(), 0, atol=1e-12)
    traction = np.zeros((len(rows.nodes), 3))
    traction[:, 0] = 1
    force = (H @ (rows.weights[:, None] * traction).ravel()).reshape(-1, 3) @ axes[:, 2]
    n = len(high.points)
    np.testing.assert_allclose(force[:n].sum(), weight.sum(), rtol=1e-7)
    centre = np.einsum("tq,tqc->c", weight, where)
    np.testing.assert_allclose(force[:n] @ place[1][:, :2], centre, atol=1e-7)
    np.testing.assert_allclose(-force[n:] @ low.points[:, :2], centre, atol=1e-7)
    assert abs(H).max() < 6


def test_small_facets_on_a_large_one():
    """One facet under 400, and 400 under one."""
    for counts in ((1, 20), (20, 1)):
        low, high = blocks_apart(3, (0, 0), *counts)
        rows, on_master, found = mortar_contact(high, "bottom", low, "top")
        assert found.all()
        np.testing.assert_allclose(rows.weights.sum(), 1)
        push = rows.H.T @ np.ones(high.points.size) + on_master.T @ np.ones(low.points.size)
        np.testing.assert_allclose(push, 0, atol=1e-13)


def test_closed_surfaces():
    """A whole disc in a hole: the far side of the hole does not count."""

    def ring(inside, outside, around):
        box = am.box((1, 1), (2, around))
        r, angle = inside + (outside - inside) * box.points[:, 0], 2 * np.pi * box.points[:, 1]
        points = np.column_stack([r * np.cos(angle), r * np.sin(angle)])
        last = box.points[:, 1] == 1
        number = np.arange(len(points))
        number[last] = number[:3]
        cells = (Cells("quad", number[box.cells[0].nodes]),)
        sides = {k: tuple(Facets(f.kind, number[f.nodes]) for f in box.surfaces[k])
                 for k in ("left", "right")}  # fmt: skip
        return am.Mesh(points[~last], cells, sides)

    disc, plate = ring(0.2, 1.0, 21), ring(1.02, 2.0, 34)
    rows, _, found = mortar_contact(disc, "right", plate, "left")
    assert found.all()
    np.testing.assert_allclose(rows.gap, 0.02, atol=3e-4)  # facets alone: 1e-2
    np.testing.assert_allclose(rows.weights.sum(), 42 * np.sin(np.pi / 21), rtol=1e-3)


def test_forces_balance_the_load_of_a_body_held_by_contact_alone():
    """Also on a rim where some nodes have no multiplier and others act on them."""
    low, high = blocks_apart(3, (0.23, 0.1), 4, 3)
    bodies = [am.Body(low, RUBBER, name="lower"), am.Body(high, RUBBER, name="upper")]
    contact = am.Contact("upper.bottom", master="lower.top", mu=0.3, method="mortar")
    load = am.Traction("upper.top", (0.05, 0.02, -1))
    model = am.Model(bodies, [am.Fix("lower.bottom", 0)], [contact], [load])
    assert len(model.discretisation.placed[0].rows.nodes) == 12
    solution = am.drive(model.assemble(), tolerance=1e-10)
    np.testing.assert_allclose(model.recover(solution).resultant, (-0.05, -0.02, 1), atol=1e-8)


def dual_moments(n):
    """Integrals of t (1 - t) psi_i over [0, 1] with n elements, psi dual to hat functions."""
    at, weights = np.polynomial.legendre.leggauss(3)
    s, weights = (at + 1) / 2, weights / (2 * n)
    out = np.zeros(n + 1)
    for e in range(n):
        t = (e + s) / n
        out[e] += (t * (1 - t) * weights) @ (2 - 3 * s)
        out[e + 1] += (t * (1 - t) * weights) @ (3 * s - 1)
    return out


def tresca_bounds(bound, method="mortar", high=None, low=None):
    """Forces that bound friction, and the contacts, of a unit block on a plane or a block."""
    bodies = [am.Body(high or am.box((1, 1, 1), (4, 4, 1)), SOFT, name="upper")]
    partner = {"obstacle": am.Plane((0, 0, 1))}
    if low is not None:
        bodies.append(am.Body(low, SOFT, name="lower"))
        partner = {"master": "lower.top"}
    slave = "bottom" if low is None else "upper.bottom"
    contact = am.Contact(slave, tresca=bound, method=method, **partner)
    fixes = [am.Fix("top" if low is None else "upper.top", 0)]
    fixes += [am.Fix("lower.bottom", 0)] if low is not None else []
    model = am.Model(bodies, fixes, [contact])
    return model.assemble().law.limit, model.discretisation.placed[0].rows


def test_a_tresca_bound_is_integrated_with_the_dual_functions():
    """As [HSW] Table 4.1 has it; nodal contact takes the value at the node times its area."""

    def bound(x):
        return 800 * x[:, 0] * x[:, 1] * (1 - x[:, 0]) * (1 - x[:, 1])

    limit, rows = tresca_bounds(bound)
    where = np.rint(4 * rows.points[:, :2]).astype(int)
    np.testing.assert_allclose(limit, 800 * dual_moments(4)[where].prod(axis=1), rtol=1e-12)
    nodal, rows = tresca_bounds(bound, "nodal")
    np.testing.assert_allclose(nodal, bound(rows.points) * rows.weights)


@pytest.mark.parametrize("shift", [0.0, 0.3])
def test_tresca_bounds_between_meshes_that_do_not_match(shift):
    """A traction on the bound has its integral; other bounds count by the weight."""
    low, high = blocks_apart(3, (shift, 0), 4, 3)
    area = (1 - shift) * (1 + shift) / 2  # of x over [shift, 1]
    limit, rows = tresca_bounds(lambda x: x[:, 0], high=high, low=low)
    force = rows.H[:, ::3] @ -limit  # on the whole surface, also on nodes without multiplier
    np.testing.assert_allclose(np.abs(force).sum(), area, rtol=1e-12)
    limit, rows = tresca_bounds(7.0, high=high, low=low)
    np.testing.assert_allclose(limit, 7 * rows.weights)
    same, _ = tresca_bounds(lambda x: np.full(len(x), 7.0), high=high, low=low)
    np.testing.assert_allclose(same, limit)
    values = np.arange(16.0)
    limit, rows = tresca_bounds(values, high=high, low=low)
    slave = high.surface_nodes("bottom")
    given = values[np.searchsorted(slave, rows.nodes)]
    np.testing.assert_allclose(limit, given * rows.weights)


def test_tresca_bounds_are_not_negative():
    """Dual functions are, so that a bound next to zeros may have a negative integral."""
    limit, _ = tresca_bounds(lambda x: np.where(x[:, 0] < 0.25, 1.0, 0.0))
    assert (limit >= 0).all()
    assert limit.max() > 0


@pytest.mark.parametrize(("dim", "kind"), [(2, "quad"), (2, "tri"), (3, "hex"), (3, "tet")])
def test_a_slave_that_goes_around_an_edge_has_the_normals_of_what_can_touch(dim, kind):
    """Averages with the facets around the edge would take 7 to 11 % of the force."""
    wide = (1.5,) * (dim - 1) + (1.0,)
    low = am.box(wide, (6,) * (dim - 1) + (2,), kind, origin=(-0.25,) * (dim - 1) + (-1.0,))
    high = am.box((1.0,) * dim, (4,) * (dim - 1) + (2,), kind)
    skin = tuple(b for name, blocks in high.surfaces.items() if name != "top" for b in blocks)
    high = am.Mesh(high.points, high.cells, high.surfaces | {"skin": skin})
    push = (0.002,) + (0.0,) * (dim - 2) + (-0.01,)
    found = [
        am.solve(am.Model(
            [am.Body(low, RUBBER, "low"), am.Body(high, RUBBER, "high")],
            [am.Fix("low.bottom", 0), am.Fix("high.top", push)],
            [am.Contact(f"high.{slave}", master="low.top", mu=0.3)],
        ), tolerance=1e-12) for slave in ("bottom", "skin")
    ]  # fmt: skip
    for one, other in zip(found[0].displacement, found[1].displacement, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-10 * 0.01)
