"""Bodies of revolution: Lamé's tube, press fits, Hertz, punches, cones; what is refused."""

import numpy as np
import pytest

import amontons as am
from amontons.mechanics.elements import cell_stress, stiffness
from amontons.mechanics.elements.elasticity import body_load
from amontons.mechanics.elements.mass import mass
from amontons.mechanics.meshes import second_order
from amontons.mechanics.meshes.surfaces import nodal_weights

STEEL = am.LinearElastic(210e3, 0.3)
KINDS = [("quad", 1), ("tri", 1), ("quad", 2), ("tri", 2), ("quad", "serendipity")]


def section(low, high, cells, kind="quad", order=1):
    mesh = am.box((high[0] - low[0], high[1] - low[1]), cells, kind, origin=low)
    if order == 1:
        return mesh
    return second_order(mesh, serendipity=order == "serendipity")


def ring(low, high, cells, law=STEEL, name="", kind="quad", order=1):
    mesh = section(low, high, cells, kind, order)
    return am.Body(mesh, law, name, order=mesh.order, axisymmetric=True)


@pytest.mark.parametrize(("kind", "order"), KINDS)
def test_volume_mass_and_weights_go_around(kind, order):
    """A ring of 2 to 3 by 4: volume 20 pi, mantle 24 pi, its top 5 pi."""
    mesh = section((2, 0), (3, 4), (2, 3), kind, order).turned()
    assert mesh.axisymmetric
    force = body_load(mesh, np.tile([0.0, 7.0], (len(mesh.points), 1)))
    assert force.sum(axis=0) == pytest.approx([0, 7 * 20 * np.pi], abs=1e-10)
    around = {side: nodal_weights(mesh.points, mesh.surface(side), axisymmetric=True).sum()
              for side in ("right", "top")}  # fmt: skip
    assert around == pytest.approx({"right": 24 * np.pi, "top": 5 * np.pi})
    law = am.LinearElastic(1.0, 0.3, density=2.0)
    along = np.tile([0.0, 1.0], len(mesh.points))
    assert along @ mass(mesh, law) @ along == pytest.approx(40 * np.pi)


@pytest.mark.parametrize(("kind", "order"), KINDS)
def test_uniform_strain_is_exact(kind, order):
    """u = (a r, b z): stress and energy are those of a uniform strain diag(a, b, a)."""
    mesh = section((0, 0), (2, 3), (3, 2), kind, order).turned()
    a, b = 1e-3, -2e-3
    u = mesh.points * [a, b]
    stress = cell_stress(mesh, STEEL, u)
    lame, shear = STEEL.lame_lambda(), STEEL.shear
    radial, axial = lame * (2 * a + b) + 2 * shear * a, lame * (2 * a + b) + 2 * shear * b
    expected = np.diag([radial, axial, radial])
    np.testing.assert_allclose(stress, np.broadcast_to(expected, stress.shape), atol=1e-9)
    K = stiffness(mesh, STEEL)
    energy = 0.5 * u.ravel() @ K @ u.ravel()
    assert energy == pytest.approx(0.5 * (2 * a * radial + b * axial) * 12 * np.pi)
    along = np.tile([0.0, 1.0], len(mesh.points))
    assert np.abs(K @ along).max() < 1e-9 * np.abs(K.data).max()
    assert abs(K - K.T).max() == 0


@pytest.mark.parametrize(("kind", "order", "error"), [
    ("quad", 1, 2e-3), ("tri", 1, 4e-3), ("quad", 2, 3e-6), ("tri", 2, 3e-5),
    ("quad", "serendipity", 3e-6),
])  # fmt: skip
def test_tube_under_inner_pressure(kind, order, error):
    """Lamé: plane strain between two rigid smooth plates, 10 to 20 mm, 50 MPa inside."""
    body = ring((10, 0), (20, 5), (16, 4), kind=kind, order=order)
    held = [am.Fix(side, (None, 0)) for side in ("bottom", "top")]
    wall = am.Contact("right", am.Plane((-1, 0), (30, 0)), mu=0.0)
    solution = am.solve(am.Model([body], held, [wall], [am.Pressure("left", 50.0)]))
    a, b, p = 10.0, 20.0, 50.0
    k, nu, young = p * a**2 / (b**2 - a**2), STEEL.poisson, STEEL.young
    r, u = body.mesh.points[:, 0], solution.displacement[0][:, 0]
    exact = (1 + nu) / young * k * ((1 - 2 * nu) * r + b**2 / r)
    np.testing.assert_allclose(u, exact, rtol=error)


def fit(cells, law, *, kind="quad", order=1, method=None, push=None):
    """A tube of 20 / 40.005 mm in one of 40 / 60 mm, 19 mm long."""
    shaft = ring((10, 0), (20.0025, 19), cells[0], law, "shaft", kind, order)
    hub = ring((20, 0), (30, 19), cells[1], law, "hub", kind, order)
    held = [am.Fix("shaft.bottom", (None, 0)), am.Fix("hub.bottom", (None, 0))]
    if push is not None:
        held = [am.Fix("shaft.top", (None, push)), am.Fix("hub.bottom", (None, 0))]
    pair = am.Contact("shaft.right", master="hub.left", mu=0.1, method=method)
    return am.Model([shaft, hub], held, [pair])


LAME = 6.1523  # MPa, both tubes of E 210 GPa, nu 0
MATCHING, OTHER = ((5, 10), (5, 10)), ((4, 9), (6, 13))


@pytest.mark.parametrize("cells", [MATCHING, OTHER])
@pytest.mark.parametrize(("kind", "order"), KINDS)
@pytest.mark.parametrize("method", [None, "nitsche"])
def test_press_fit(cells, kind, order, method):
    law = am.LinearElastic(210e3, 0.0)
    solution = am.solve(fit(cells, law, kind=kind, order=order, method=method))
    mean = solution.fields.force[:, 0].sum() / (2 * np.pi * 20 * 19)
    assert -mean == pytest.approx(LAME, rel=5e-3)
    if order != 1:
        assert solution.pressure == pytest.approx(LAME, rel=2e-3)
    pushed = am.solve(fit(cells, law, kind=kind, order=order, method=method, push=-0.05))
    assert pushed.fields.force[:, 1].sum() == pytest.approx(1468.9, rel=5e-3)
    assert pushed.supports["hub.bottom"].force[1] == pytest.approx(1468.9, rel=5e-3)
    assert (pushed.status == am.ContactStatus.SLIP).all()


def test_press_fit_with_poissons_effect():
    """With nu 0.3 the tubes want to change their length, and friction keeps them from it.

    Without friction the stress is plane and the pressure Lamé's; with mu 0.1 the pressure is
    no longer even, and its mean is a little larger.
    """
    law = am.LinearElastic(210e3, 0.3)
    model = fit(OTHER, law, order=2)
    free = am.solve(model.with_mu(0.0))
    assert free.pressure == pytest.approx(LAME, rel=1e-3)
    rough = am.solve(model)
    assert np.ptp(rough.pressure) > 0.01 * LAME


@pytest.mark.parametrize("method", ["nodal", "mortar", "nitsche"])
@pytest.mark.parametrize("order", [1, 2])
def test_hertz_sphere_on_a_plane(order, method):
    """F = 4/3 E* sqrt(R) d^1.5, and the peak 3 F / (2 pi a^2) with a^3 = 3 F R / (4 E*)."""
    law, R, depth, far = am.LinearElastic(1000.0, 0.3), 10.0, 0.02, 100
    n = 20 if order == 1 else 12
    grade = np.concatenate([np.linspace(0, 0.6, n + 1),
                            0.6 * (far / 0.6) ** (np.arange(1, n + 1) / n)])
    mesh = am.box((1, 1), (2 * n, 2 * n))
    place = (2 * n * mesh.points).round().astype(int)
    # downwards the cells are mirrored: the mesh turns them back
    points = np.column_stack([grade[place[:, 0]], -grade[place[:, 1]]])
    body = am.Body(am.Mesh(points, mesh.cells, mesh.surfaces), law, order=order,
                   axisymmetric=True)  # fmt: skip
    pair = am.Contact("bottom", am.Sphere((0, R - depth), R), mu=0.0, method=method)
    solution = am.solve(am.Model([body], [am.Fix("top", (None, 0))], [pair]))
    stiff, force = 1000 / (1 - 0.3**2), -solution.fields.resultant[1]
    assert force == pytest.approx(4 / 3 * stiff * np.sqrt(R) * depth**1.5, rel=0.03)
    peak = (6 * force * stiff**2 / np.pi**3 / R**2) ** (1 / 3)
    assert solution.pressure.max() == pytest.approx(peak, rel=0.03)


def test_flat_punch():
    """F = 2 a E* d, on a half space."""
    law, a, depth = am.LinearElastic(1000.0, 0.3), 1.0, 0.01
    under, beside = 1 - (1 - np.linspace(0, 1, 17)) ** 2, 19 * np.linspace(0, 1, 33)[1:] ** 2
    grade = np.concatenate([under, 1 + beside])
    deep = 20 * np.linspace(0, 1, 41) ** 2
    mesh = am.box((1, 1), (48, 40))
    points = np.column_stack([grade[(mesh.points[:, 0] * 48).round().astype(int)],
                              -deep[(mesh.points[:, 1] * 40).round().astype(int)]])
    body = am.Body(am.Mesh(points, mesh.cells, mesh.surfaces), law, axisymmetric=True)
    punch = am.Contact("bottom", am.Plane((0, 1), (0, -depth)), mu=0.0,
                       where=lambda x: x[:, 0] <= a + 1e-9)  # fmt: skip
    with pytest.raises(am.InvalidInput, match="faces the obstacle"):
        am.solve(am.Model([body], [am.Fix("top", (None, 0))], [punch]))
    punch = am.Contact("bottom", am.Plane((0, -1), (0, -depth)), mu=0.0,
                       where=lambda x: x[:, 0] <= a + 1e-9)  # fmt: skip
    solution = am.solve(am.Model([body], [am.Fix("top", (None, 0))], [punch]))
    exact = 2 * a * 1000 / (1 - 0.3**2) * depth
    assert solution.fields.resultant[1] == pytest.approx(-exact, rel=0.06)


def test_cone_wedges_a_ring():
    """A ring on a smooth cone of half angle 30 degrees: F_z = N sin 30, forces balance."""
    angle = np.radians(30)
    mesh = section((10, 0), (12, 4), (4, 8))
    points = mesh.points + np.outer(mesh.points[:, 1] * np.tan(angle), [1.0, 0.0])
    body = am.Body(am.Mesh(points, mesh.cells, mesh.surfaces), STEEL, axisymmetric=True)
    cone = am.Plane((np.cos(angle), -np.sin(angle)), (10.0, 0.0))
    load = am.Traction("top", (0.0, 20.0))
    for mu in (0.0, 0.1):
        solution = am.solve(am.Model([body], [], [am.Contact("left", cone, mu=mu)], [load]))
        r = points[mesh.surface_nodes("top"), 0]
        total = 20.0 * np.pi * (r.max() ** 2 - r.min() ** 2)
        assert solution.fields.resultant[1] == pytest.approx(-total, rel=1e-6)
        normal = (solution.pressure * solution.fields.weights).sum()
        share = np.sin(angle) + mu * np.cos(angle)
        if mu == 0 or (solution.status == am.ContactStatus.SLIP).all():
            assert normal * share == pytest.approx(total, rel=1e-6)


def test_nodes_on_the_axis_stay_on_it():
    body = ring((0, 0), (2, 2), (3, 3))
    solution = am.solve(am.Model([body], [am.Fix("bottom", (None, 0))],
                                 [am.Contact("top", am.Plane((0, -1), (0, 1.9)), mu=0.0)]))
    on = body.mesh.points[:, 0] == 0
    assert (solution.displacement[0][on, 0] == 0).all()
    np.testing.assert_allclose(solution.pressure, 210e3 * 0.05, rtol=1e-6)
    pulled = am.Model([body], [am.Fix("left", (0.1, None))],
                      [am.Contact("top", am.Plane((0, -1), (0, 1.9)), mu=0.0)])
    with pytest.raises(am.InvalidInput, match="left.*another support prescribes 0"):
        pulled.assemble()


def test_what_is_refused():
    flat, solid = am.box((1, 1), 1), am.box((1, 1, 1), 1)
    with pytest.raises(am.InvalidInput, match="mesh in 2D"):
        am.Body(solid, STEEL, axisymmetric=True)
    with pytest.raises(am.InvalidInput, match=r"r >= 0.*r = -0.5 at points\[0\]"):
        am.Body(am.box((1, 1), 1, origin=(-0.5, 0)), STEEL, axisymmetric=True)
    for law in (am.NeoHookean(1, 0.3), am.LinearElastic(1, 0.3, "stress")):
        with pytest.raises(am.InvalidInput, match="axisymmetric: expected LinearElastic"):
            am.Body(flat, law, axisymmetric=True)
    with pytest.raises(am.InvalidInput, match="True or False"):
        am.Body(flat, STEEL, axisymmetric="yes")
    both = [am.Body(flat, STEEL, "a", axisymmetric=True), am.Body(flat, STEEL, "b")]
    contact = am.Contact("a.top", am.Plane((0, -1), (0, 1)), mu=0.1)
    with pytest.raises(am.InvalidInput, match="all axisymmetric or none"):
        am.Model(both, contacts=[contact])
    moved = am.Contact("top", am.Plane((0, -1), (0, 1)), mu=0.1, kinematics="finite")
    with pytest.raises(am.InvalidInput, match="contact of small kinematics"):
        am.Model(both[:1], contacts=[moved])


def quarter(low, high, cells, law, name, order):
    """A quarter of a tube in 3D; of second order its sides are curved."""
    mesh = am.box((high - low, np.pi / 2, 5.0), cells, origin=(low, 0, 0))
    mesh = second_order(mesh, serendipity=True) if order == 2 else mesh
    r, angle, z = mesh.points.T
    points = np.column_stack([r * np.cos(angle), r * np.sin(angle), z])
    points[np.abs(points) < 1e-12] = 0
    mesh = am.Mesh(points, mesh.cells, mesh.surfaces)
    return am.Body(mesh, law, name, order=order)


@pytest.mark.parametrize(("order", "method", "error"), [
    (1, "mortar", 0.01), (2, "mortar", 0.02), (2, "nitsche", 1e-3),
])  # fmt: skip
def test_press_fit_beside_in_3d(order, method, error):
    """Facets of 15 degrees; with mortar a normal at each node, not everywhere."""
    law = am.LinearElastic(210e3, 0.0)
    bodies = [quarter(10, 20.0025, (2, 6, 1), law, "shaft", order),
              quarter(20, 30, (2, 6, 1), law, "hub", order)]  # fmt: skip
    held = [am.Fix(f"{body}.{side}", [0 if axis == k else None for k in range(3)])
            for body in ("shaft", "hub")
            for side, axis in (("front", 1), ("back", 0), ("bottom", 2))]  # fmt: skip
    pair = am.Contact("shaft.right", master="hub.left", mu=0.1, method=method)
    solution = am.solve(am.Model(bodies, held, [pair]))
    weights = solution.fields.weights
    assert weights.sum() == pytest.approx(np.pi / 2 * 20 * 5, rel=5e-3 if order == 1 else 2e-4)
    mean = (solution.pressure * weights).sum() / weights.sum()
    assert mean == pytest.approx(LAME, rel=error)


def test_a_body_with_an_equation_needs_no_support_against_what_strains_it():
    """A disc pressed onto a plane: only motion along the axis is free of strain."""
    mesh = am.box((1.0, 1.0), 2)
    body = am.Body(mesh, am.LinearElastic(100.0, 0.0), "disc", axisymmetric=True)
    top = mesh.surface_nodes("top")
    far, near = (int(top[np.argsort(mesh.points[top, 0])[k]]) for k in (-1, 0))
    level = am.Equation([(far, 1, 1.0), (near, 1, -1.0)])
    contact = am.Contact("bottom", am.Plane((0, 1)), mu=0.0)
    model = am.Model([body], [], [contact], [am.Pressure("top", 3.0)], constraints=[level])
    assert model.rests_on_contact
    found = am.solve(model, tolerance=1e-11)
    assert found.resultant[1] == pytest.approx(3.0 * np.pi, rel=1e-9)
    assert np.allclose(found.displacement[0][:, 1], -0.03 * mesh.points[:, 1], atol=1e-10)
