"""Plane stress at finite strains: closed forms, a thin slab of hexahedra, decks and cases."""

import numpy as np
import pytest
from scipy.optimize import brentq

import amontons as am
from amontons.core.errors import InvertedCells
from amontons.mechanics.elements import stiffness
from amontons.mechanics.elements.discrete_gradient import DiscreteBody
from amontons.mechanics.elements.hyperelasticity import HyperelasticBody
from amontons.mechanics.elements.plane_stress import with_thickness

THIN = {"plane": "stress"}


def energy(C):
    return 0.4 * (np.trace(C, axis1=1, axis2=2) - 3) - 0.4 * np.log(np.linalg.det(C))


def stress(C):
    return 0.8 * (np.eye(3) - np.linalg.inv(C))


def moduli(C):
    I = np.linalg.inv(C)
    return 0.8 * (np.einsum("nik,njl->nijkl", I, I) + np.einsum("nil,njk->nijkl", I, I))


def volume(J):
    return 1.5 * (J - 1) ** 2, 3.0 * (J - 1), np.full_like(J, 3.0)


OWN = am.UserEnergy(energy, stress, moduli, volume, **THIN)
LAWS = [am.NeoHookean(1.0, 0.3, **THIN), am.NeoHookean(1.0, 0.4999, **THIN),
        am.CiarletGeymonat(1.0, 0.3, **THIN), am.MooneyRivlin(0.3, 0.1, 100.0, **THIN),
        am.ReducedPolynomial((0.3, -0.01, 0.002), 50.0, **THIN),
        am.Ogden((0.5, 0.1), (1.5, -2.0), 8.0, **THIN), OWN,
        am.SaintVenantKirchhoff(1.0, 0.3, **THIN)]  # fmt: skip
SHAPES = [("quad", "auto"), ("quad", "incompatible"), ("tri", "auto")]


def mesh_of(law, kind="quad", integration="auto", cells=2):
    return am.Body(am.box((1, 1), cells, kind), law, integration=integration).mesh


@pytest.mark.parametrize("law", LAWS)
def test_no_stress_across_whatever_the_law(law):
    rng = np.random.default_rng(3)
    gradient = 0.15 * rng.standard_normal((20, 2, 2))
    F = np.tile(np.eye(3), (20, 1, 1))
    F[:, :2, :2] += gradient
    c, _, S, _ = with_thickness(law, F.swapaxes(1, 2) @ F)
    F[:, 2, 2] = np.sqrt(c)
    solid = law.stress(F - np.eye(3))  # of the law in three dimensions
    np.testing.assert_allclose(law.stress(gradient), solid, atol=1e-10)
    assert abs(solid[:, 2]).max() < 1e-10
    assert abs(S[:, 2]).max() < 1e-10


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("law", LAWS[:-1])
def test_forces_and_tangents_are_derivatives_of_the_energy(law, shape):
    rng, mesh, h = np.random.default_rng(1), mesh_of(law, *shape), 1e-6
    body = HyperelasticBody(mesh, law)
    u = 0.06 * rng.standard_normal(mesh.points.shape)
    way = rng.standard_normal(u.shape)
    force, blocks = body.tangent(u)
    slope = (body.energy(u + h * way) - body.energy(u - h * way)) / (2 * h)
    assert (force * way).sum() == pytest.approx(slope, rel=1e-7)
    change = (body.forces(u + h * way) - body.forces(u - h * way)) / (2 * h)
    found = (body.matrix(blocks) @ way.ravel()).reshape(u.shape)
    assert abs(found - change).max() < 1e-7 * abs(found).max()
    assert not body.keeps_volume


@pytest.mark.parametrize("law", [LAWS[0], OWN])
def test_small_strains_are_those_of_linear_plane_stress(law):
    mesh = mesh_of(law)
    linear = am.LinearElastic(law.young, law.poisson, "stress")
    u = 1e-6 * np.random.default_rng(0).standard_normal(mesh.points.shape)
    near = stiffness(mesh, linear) @ u.ravel()
    found = HyperelasticBody(mesh, law).forces(u).ravel()
    np.testing.assert_allclose(found, near, atol=2e-5 * abs(near).max())


def pulled(law, stretch, across):
    """Nominal stress sigma_xx J / l of a block stretched along x, and along y if `across`."""
    body = am.Body(am.box((1, 1), 2), law)
    supports = [am.Fix("left", (0, None)), am.Fix("right", (stretch - 1, None)),
                am.Fix("bottom", (None, 0))]  # fmt: skip
    supports += [am.Fix("top", (None, stretch - 1))] if across else []
    *_, step = am.evolve(am.Model([body], supports), am.QuasiStatic(0.25), until=1.0)
    return step.supports[next(n for n in step.supports if "right" in n)].force[0]


@pytest.mark.parametrize("stretch", [0.6, 1.5, 2.0])
def test_rubber_pulled_along_one_and_two_axes(stretch):
    """P = G (l - l^-2), and G (l - l^-5) where both sides are pulled: incompressible."""
    rubber = am.MooneyRivlin(0.5, 0.0, 1e6, **THIN)
    assert pulled(rubber, stretch, False) == pytest.approx(stretch - stretch**-2, rel=1e-5)
    assert pulled(rubber, stretch, True) == pytest.approx(stretch - stretch**-5, rel=1e-5)


@pytest.mark.parametrize("stretch", [0.7, 1.6])
def test_a_compressible_law_pulled_along_one_axis(stretch):
    """tau_i = G (l_i^2 - 1) + lambda ln J, of sides that are free zero."""
    law = am.NeoHookean(1.0, 0.3, **THIN)
    G, lame = law.shear, law.lame_lambda()

    def aside(b):
        return G * (b**2 - 1) + lame * np.log(stretch * b**2)

    b = brentq(aside, 0.3, 2.0, xtol=1e-14)
    nominal = (G * (stretch**2 - 1) + lame * np.log(stretch * b**2)) / stretch
    assert pulled(law, stretch, False) == pytest.approx(nominal, rel=1e-8)


def pressed(height=None):
    """Force per thickness on a block that is pressed onto a floor and dragged; None: thin."""
    law = am.NeoHookean(1.0, 0.3, **THIN) if height is None else am.NeoHookean(1.0, 0.3)
    floor, below, above = ((0, 1), "bottom", "top")
    size, count, more, supports = (1, 0.6), (6, 4), (), []
    if height is not None:  # z = 0 is its middle
        floor, below, above = (0, 1, 0), "front", "back"
        size, count, more = (*size, height), (*count, 1), (None,)
        supports = [am.Fix("bottom", (None, None, 0))]
    body = am.Body(am.box(size, count), law, integration="incompatible")
    model = am.Model([body], [am.Fix(above, (0.1, -0.1, *more)), *supports],
                     [am.Contact(below, am.Plane(floor), mu=0.3)])  # fmt: skip
    solution = am.solve(model)
    assert solution.converged
    return np.asarray(solution.resultant).ravel()[:2] / (height or 1)


def test_a_thin_slab_of_hexahedra_in_contact_comes_to_plane_stress():
    thin = pressed()
    apart = [abs(pressed(height) / thin - 1) for height in (0.1, 0.002)]
    assert (apart[0] > 3 * apart[1]).all()
    assert (apart[1] < 2e-3).all()


DECK = """*NODE
1, 0, 0
2, 1, 0
3, 1, 1
4, 0, 1
*ELEMENT, TYPE=CPS4, ELSET=ALL
1, 1, 2, 3, 4
*MATERIAL, NAME=RUBBER
*HYPERELASTIC, NEO HOOKE
0.5, 2e-5
*SOLID SECTION, ELSET=ALL, MATERIAL=RUBBER
1.
*NSET, NSET=LEFT
1, 4
*NSET, NSET=RIGHT
2, 3
*STEP, NLGEOM
*STATIC
0.25, 1.
*BOUNDARY
LEFT, 1
1, 2
2, 2
RIGHT, 1, 1, 0.5
*NODE FILE
U
*END STEP
"""


def test_decks_and_cases_have_it(tmp_path):
    """CPS4 with *HYPERELASTIC; `plane` of the laws in case files."""
    deck = tmp_path / "pulled.inp"
    deck.write_text(DECK)
    model = am.read_case(deck).model
    assert model.bodies[0].material["ALL"].plane == "stress"
    side = am.solve(model).displacement[0][2, 1]
    assert (1 + side) ** 2 * 1.5 == pytest.approx(1, rel=1e-4)  # l b^2 = 1
    case = tmp_path / "case.toml"
    case.write_text(CASE)
    law = am.read_case(case).model.bodies[0].material
    assert "stress" in str(law)


CASE = """
[mesh]
box = [1, 1]
cells = 2
[material.default]
law = "mooney-rivlin"
c10 = 0.5
bulk = 100
plane = "stress"
[[fix]]
on = "top"
value = [0, -0.1]
[[contact]]
slave = "bottom"
obstacle = { plane = { point = [0, 0], normal = [0, 1] } }
friction = { coulomb = 0.3 }
"""


FLAT = [am.NeoHookean(1.0, 0.4), am.NeoHookean(1.0, 0.3, **THIN), am.MooneyRivlin(0.3, 0.1, 9)]


@pytest.mark.parametrize("law", FLAT)
def test_cells_that_are_flat_but_for_rounding_are_inverted(law):
    """F of rank one, det F some 1e-17: no traceback of a matrix that has no inverse."""
    mesh = am.Body(am.box((1, 0.6), (6, 4)), law).mesh
    u = np.zeros_like(mesh.points)
    u[mesh.points[:, 1] > 0.5] = (0.15, -0.15)
    with pytest.raises(InvertedCells):
        HyperelasticBody(mesh, law).forces(u)


def test_discrete_gradients_keep_the_energy():
    rng, law = np.random.default_rng(3), LAWS[0]
    for shape in SHAPES:
        mesh = mesh_of(law, *shape)
        before = 0.02 * rng.standard_normal(mesh.points.shape)
        after = before + 0.05 * rng.standard_normal(mesh.points.shape)
        elastic = HyperelasticBody(mesh, law)
        between = DiscreteBody(mesh, dict.fromkeys(mesh.regions, law)).between
        work = (between(before, after) * (after - before)).sum()
        gain = elastic.energy(after) - elastic.energy(before)
        assert work == pytest.approx(gain, abs=1e-13)


def test_no_thickness_and_other_planes_are_told():
    law = am.SaintVenantKirchhoff(1.0, 0.4, **THIN)
    with pytest.raises(InvertedCells, match="no thickness is without stress"):
        law.stress(np.array([[[0.9, 0], [0, 0.9]]]))
    with pytest.raises(am.InvalidInput, match='plane: expected "strain" or "stress"'):
        am.Ogden((0.5,), (1.5,), 8.0, plane="thin")

    def sheared(C):
        return energy(C) + 0.5 * (C[:, 0, 0] - 1) * C[:, 0, 2]

    def its_stress(C):
        out = stress(C)
        out[:, 0, 0] += C[:, 0, 2]
        out[:, 0, 2] += 0.5 * (C[:, 0, 0] - 1)
        out[:, 2, 0] += 0.5 * (C[:, 0, 0] - 1)
        return out

    def its_moduli(C):
        out = moduli(C)
        for i, j, k, l in ((0, 0, 0, 2), (0, 0, 2, 0), (0, 2, 0, 0), (2, 0, 0, 0)):
            out[:, i, j, k, l] += 1.0
        return out

    am.UserEnergy(sheared, its_stress, its_moduli, volume)
    with pytest.raises(am.InvalidInput, match="for which z is an axis"):
        am.UserEnergy(sheared, its_stress, its_moduli, volume, **THIN)
