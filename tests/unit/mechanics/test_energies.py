"""Laws given point by point: closed forms, tangents, turned frames, energies of users."""

import numpy as np
import pytest
from body_checker import check_energy_forces_and_tangent

import amontons as am
from amontons.core.errors import InvalidInput, InvertedCells
from amontons.mechanics.elements import stiffness
from amontons.mechanics.elements.cell_matrices import rule_of
from amontons.mechanics.elements.energies import MooneyRivlin, Ogden, SaintVenantKirchhoff
from amontons.mechanics.elements.hybrid import volumes_of
from amontons.mechanics.elements.hyperelasticity import HyperelasticBody
from amontons.mechanics.elements.nodal_stress import stress_of
from amontons.mechanics.elements.user_energy import UserEnergy
from amontons.mechanics.meshes import second_order

MOONEY = MooneyRivlin(0.3, 0.1, 50.0)
OGDEN = Ogden((0.63, 0.0012, -0.01), (1.3, 5.0, -2.0), 40.0)  # Ogden 1972, MPa
KIRCHHOFF = SaintVenantKirchhoff(2.0, 0.3)
YEOH = am.ReducedPolynomial((0.3, -0.05, 0.02), 50.0)
LAWS = (MOONEY, OGDEN, KIRCHHOFF, MooneyRivlin(0.5, 0.0, 2.0), YEOH)


def cauchy(law, F):
    """Of one 3x3 F."""
    return law.stress((np.asarray(F, dtype=float) - np.eye(3))[None])[0]


# ------------------------------------------------------------------ closed forms
def stretched(kind, s):
    """A deformation without change of volume: F."""
    if kind == "uniaxial":
        return np.diag([s, s**-0.5, s**-0.5])
    if kind == "biaxial":
        return np.diag([s, s, s**-2])
    F = np.eye(3)
    F[0, 1] = s
    return F


@pytest.mark.parametrize("s", [0.6, 1.0 + 1e-9, 1.7, 3.0])
def test_mooney_rivlin_by_hand(s):
    c10, c01 = MOONEY.c10, MOONEY.c01
    sigma = cauchy(MOONEY, stretched("uniaxial", s))
    assert sigma[0, 0] - sigma[1, 1] == pytest.approx(
        2 * (s**2 - 1 / s) * (c10 + c01 / s), rel=1e-12, abs=1e-14
    )
    sigma = cauchy(MOONEY, stretched("biaxial", s))
    assert sigma[0, 0] - sigma[2, 2] == pytest.approx(
        2 * (s**2 - s**-4) * (c10 + c01 * s**2), rel=1e-12, abs=1e-14
    )
    sigma = cauchy(MOONEY, stretched("shear", s))
    assert sigma[0, 1] == pytest.approx(2 * (c10 + c01) * s, rel=1e-12)
    assert sigma[0, 0] - sigma[2, 2] == pytest.approx(2 * c10 * s**2, rel=1e-11)
    assert sigma[1, 1] - sigma[2, 2] == pytest.approx(-2 * c01 * s**2, rel=1e-11)


@pytest.mark.parametrize("s", [0.6, 1.7, 3.0])
def test_ogden_by_hand(s):
    def tau(stretch):
        return sum(2 * mu / a * stretch**a for mu, a in zip(OGDEN.shears, OGDEN.exponents,
                                                            strict=True))  # fmt: skip

    sigma = cauchy(OGDEN, stretched("uniaxial", s))
    assert sigma[0, 0] - sigma[1, 1] == pytest.approx(tau(s) - tau(s**-0.5), rel=1e-12)
    assert abs(sigma[1, 1] - sigma[2, 2]) < 1e-14 * abs(sigma).max()
    sigma = cauchy(OGDEN, stretched("biaxial", s))
    assert sigma[0, 0] - sigma[2, 2] == pytest.approx(tau(s) - tau(s**-2), rel=1e-12)
    sigma = cauchy(OGDEN, stretched("shear", s))
    large = s / 2 + np.hypot(1, s / 2)  # of the principal stretches
    wanted = (tau(large) - tau(1 / large)) / (large**2 - large**-2) * s
    assert sigma[0, 1] == pytest.approx(wanted, rel=1e-12)


@pytest.mark.parametrize("s", [0.6, 1.7, 3.0])
def test_saint_venant_kirchhoff_by_hand(s):
    lame, shear, E = KIRCHHOFF.lame_lambda(), KIRCHHOFF.shear, (s**2 - 1) / 2
    sigma = cauchy(KIRCHHOFF, np.diag([s, 1, 1]))
    np.testing.assert_allclose(
        sigma, np.diag([s * (lame + 2 * shear) * E, lame * E / s, lame * E / s]), rtol=1e-13
    )
    F = stretched("shear", s)
    E = (F.T @ F - np.eye(3)) / 2
    S = lame * s**2 / 2 * np.eye(3) + 2 * shear * E
    np.testing.assert_allclose(cauchy(KIRCHHOFF, F), F @ S @ F.T, rtol=1e-13)


@pytest.mark.parametrize("law", [MOONEY, OGDEN])
def test_pressure_is_that_of_the_volume(law):
    J = 1.2
    sigma = cauchy(law, J ** (1 / 3) * np.eye(3))
    np.testing.assert_allclose(sigma, law.bulk * (J - 1) * np.eye(3), atol=1e-13)


@pytest.mark.parametrize("apart", [0.0, 1e-15, 1e-12, 1e-9, 1e-6, 1e-3, 0.3])
def test_ogden_with_exponents_of_two_is_mooney_rivlin(apart):
    """Also where two or three principal stretches are equal, or almost."""
    twin = Ogden((0.6, 0.2), (2.0, -2.0), 50.0)
    Q = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    for stretches in ((1.3, 1.3 + apart, 0.8), (1.1, 1.1 + apart, 1.1 - apart)):
        C = (Q * np.square(stretches)) @ Q.T
        for mine, other in zip(twin.respond(C[None]), MOONEY.respond(C[None]), strict=True):
            np.testing.assert_allclose(mine, other, atol=2e-14)


def test_constants_at_rest():
    assert MOONEY.shear == pytest.approx(0.8)
    assert MOONEY.young == pytest.approx(9 * 50 * 0.8 / (150 + 0.8))
    for law in LAWS:
        linear = am.LinearElastic(law.young, law.poisson)
        for dim in (2, 3):
            np.testing.assert_allclose(law.moduli(dim), linear.moduli(dim), atol=1e-12 * 50)


# ------------------------------------------------------------------ bodies
def mesh_of(kind, integration):
    first = {"quad9": "quad", "tri6": "tri", "tet10": "tet"}.get(kind, kind)
    dim = 2 if first in ("quad", "tri") else 3
    mesh = am.box((2.0, 1.5, 1.0)[:dim], (2, 1, 1)[:dim], first)
    mesh = am.Mesh(mesh.points + 0.05 * np.sin(3 * mesh.points[:, ::-1]), mesh.cells,
                   mesh.surfaces)  # fmt: skip
    mesh = mesh if first == kind else second_order(mesh)
    return am.Body(mesh, KIRCHHOFF, integration=integration).mesh


def deformed(mesh, size=0.15):
    x = mesh.points
    return size * np.sin(x[:, ::-1] * 2) + 0.5 * size * x[:, :1] * x


@pytest.mark.parametrize("law", LAWS, ids=repr)
@pytest.mark.parametrize("kind", ["quad", "tri", "quad9", "hex", "tet10"])
@pytest.mark.parametrize("integration", ["full", "hybrid"])
def test_energy_forces_and_tangent_belong_together(law, kind, integration):
    mesh = mesh_of(kind, integration)
    check_energy_forces_and_tangent(HyperelasticBody(mesh, law), deformed(mesh))


@pytest.mark.parametrize("law", LAWS, ids=repr)
@pytest.mark.parametrize("kind", ["quad", "hex"])
def test_turned_frames_and_rest(law, kind):
    mesh = mesh_of(kind, "auto")
    body, u = HyperelasticBody(mesh, law), deformed(mesh)
    Q = np.linalg.qr(np.random.default_rng(3).normal(size=(mesh.dim, mesh.dim)))[0]
    Q[0] *= np.linalg.det(Q)
    forces, turned = body.forces(u), (mesh.points + u) @ Q.T - mesh.points
    size = 1e-11 * abs(forces).max()
    np.testing.assert_allclose(body.forces(turned), forces @ Q.T, atol=size)
    assert abs(body.forces(mesh.points @ (Q.T - np.eye(mesh.dim)))).max() < 1e-12
    linear = stiffness(mesh, law).tocsr()
    tangent = body.matrix(body.tangent(np.zeros_like(u))[1]).tocsr()
    assert abs(tangent - linear).max() < 1e-12 * abs(linear).max()


@pytest.mark.parametrize("law", LAWS, ids=repr)
def test_inverted_cells_and_what_is_no_number(law):
    mesh = mesh_of("quad", "auto")
    body = HyperelasticBody(mesh, law)
    for ask in (body.forces, body.tangent, body.energy):
        with pytest.raises(InvertedCells, match="det F is -1"):
            ask(mesh.points * [0.0, -2.0])
        with pytest.raises(InvertedCells):
            ask(np.full_like(mesh.points, np.nan))


@pytest.mark.parametrize("law", [*LAWS, am.NeoHookean(1.0, 0.4999)], ids=repr)
def test_a_pressed_block_of_each(law):
    """In contact; stresses at nodes and the force on the obstacle agree."""
    body = am.Body(am.box((2, 1), (8, 4)), law)
    model = am.Model([body], [am.Fix("top", (0, -0.1))],
                     [am.Contact("bottom", am.Plane((0, 1)), mu=0.0)])  # fmt: skip
    solution = am.solve(model)
    assert solution.converged
    centres, _ = stress_of(body.mesh, law, solution.displacement[0])
    low = centres[: 8, 1, 1]
    assert -low.mean() * 2 == pytest.approx(solution.resultant[1], rel=0.15)


# ------------------------------------------------------------------ an energy of one's own
EYE = np.eye(3)


def own(**changed):
    """Neo-Hookean, shear 2: w = tr C - 3 - 2 ln J, U = 15 (J - 1)^2."""
    def energy(C):
        return np.trace(C, axis1=1, axis2=2) - 3 - np.log(np.linalg.det(C))

    def stress_of(C):
        return 2 * (EYE - np.linalg.inv(C))

    def moduli_of(C):
        inverse = np.linalg.inv(C)
        return 2 * (np.einsum("nik,njl->nijkl", inverse, inverse)
                    + np.einsum("nil,njk->nijkl", inverse, inverse))  # fmt: skip

    def volume_of(J):
        return 15 * (J - 1) ** 2, 30 * (J - 1), np.full_like(J, 30.0)

    given = {"energy": energy, "stress_of": stress_of, "moduli_of": moduli_of,
             "volume_of": volume_of}  # fmt: skip
    return UserEnergy(**(given | changed))


def test_an_energy_of_ones_own():
    law = own(name="seal")
    assert law.shear == pytest.approx(2.0)
    assert law.lame_lambda() == pytest.approx(30.0)
    mesh = mesh_of("hex", "auto")
    u, body = deformed(mesh), HyperelasticBody(mesh, law)
    assert body.keeps_volume
    neo = am.NeoHookean(law.young, law.poisson)
    twin = HyperelasticBody(mesh, own(volume_of=None))
    shape = HyperelasticBody(mesh_of("hex", "full"), neo)
    even = 0.1 * mesh.points  # a uniform stretch tells the volume terms apart
    size = sum(volumes_of(mesh, c, rule_of(mesh, c)).sum() for c in mesh.cells)
    apart = size * 15 * np.array([np.log(1.1**3), 1.1**3 - 1]) ** 2
    assert shape.energy(even) - twin.energy(even) == pytest.approx(apart[0], rel=1e-12)
    assert body.energy(even) - twin.energy(even) == pytest.approx(apart[1], rel=1e-12)
    forces, blocks = body.tangent(u)
    K = body.matrix(blocks)
    assert abs((K - K.T).data).max(initial=0.0) <= 1e-13 * abs(blocks).max()
    np.testing.assert_allclose(body.forces(u), forces, atol=1e-12)


@pytest.mark.parametrize(("changed", "message"), [
    ({"stress_of": lambda C: 1.01 * 2 * (EYE - np.linalg.inv(C))}, "stress: differs from 2 d"),
    ({"stress_of": lambda C: C[:, :2]}, r"stress: expected shape \(12, 3, 3\)"),
    ({"stress_of": "S"}, "stress_of: expected a function"),
    ({"moduli_of": lambda C: np.zeros((len(C), 3, 3, 3, 3))}, "moduli: differs from"),
    ({"moduli_of": lambda C: np.random.default_rng(0).normal(size=(len(C), 3, 3, 3, 3))},
     "moduli: expected them symmetric"),
    ({"energy": lambda C: np.full(len(C), np.nan)}, "energy is not a finite number at C ="),
    ({"energy": lambda C: "much"}, "energy: expected an array"),
    ({"volume_of": lambda J: (15 * (J - 1) ** 2, 31 * (J - 1), 30 + 0 * J)}, "derivative of U"),
    ({"volume_of": lambda J: (15 * J**2, 30 * J, 30 + 0 * J)}, "the undeformed body has"),
    ({"volume_of": lambda J: (J, J)}, "expected U, U' and U''"),
])  # fmt: skip
def test_what_is_wrong_with_an_energy_is_named(changed, message):
    with pytest.raises(InvalidInput, match=message):
        own(**changed)


def test_an_energy_may_write_into_what_it_gets():
    def volume_of(J):
        J -= 1
        return 15 * J**2, 30 * J, np.full_like(J, 30.0)

    def energy(C):
        w = np.trace(C, axis1=1, axis2=2) - 3 - np.log(np.linalg.det(C))
        C[:] = 0.0
        return w

    mesh = mesh_of("hex", "auto")
    laws = own(), own(energy=energy, volume_of=volume_of)
    bodies = [HyperelasticBody(mesh, law) for law in laws]
    u = deformed(mesh)
    np.testing.assert_array_equal(bodies[1].forces(u), bodies[0].forces(u))


def test_an_energy_that_ends_somewhere_keeps_the_last_good_state():
    """Chains that are stretched out: no number beyond tr C = 3.06."""
    most = 0.06

    def energy(C):
        return own().energy(C) - np.where(np.trace(C, axis1=1, axis2=2) > 3 + most, np.nan, 0)

    law = own()
    ending = own()
    object.__setattr__(ending, "energy", energy)  # not asked at the samples
    model = am.Model([am.Body(am.box((1, 1), 2), ending)], [am.Fix("top", (0, -0.3))],
                     [am.Contact("bottom", am.Plane((0, 1)), mu=0.0)])  # fmt: skip
    with pytest.raises(am.NotConverged, match="energy is not a finite number at C ="):
        am.solve(model)
    assert am.solve(am.Model([am.Body(am.box((1, 1), 2), law)], model.supports,
                             model.contacts)).converged  # fmt: skip


@pytest.mark.parametrize(("make", "message"), [
    (lambda: MooneyRivlin(0.3, 0.1, -1.0), "bulk: expected a stress > 0"),
    (lambda: MooneyRivlin(0.3, -0.4, 10.0), "shear modulus > 0"),
    (lambda: am.ReducedPolynomial((), 10.0), "coefficients: expected finite numbers"),
    (lambda: am.ReducedPolynomial((-1.0, 2.0), 10.0), "shear modulus > 0"),
    (lambda: MooneyRivlin(0.5, 0.5, 1.0), "two thirds of the shear"),
    (lambda: MooneyRivlin("1", 0.5, 1.0), "c10: expected a number"),
    (lambda: Ogden((1.0, 2.0), (2.0,), 9.0), "one for each of 2 shears"),
    (lambda: Ogden((1.0,), (0.0,), 9.0), "none that is zero"),
    (lambda: SaintVenantKirchhoff(1.0, -0.2), "poisson: expected between 0"),
    (lambda: SaintVenantKirchhoff(-1.0, 0.2), "young"),
])  # fmt: skip
def test_constants_that_can_not_be(make, message):
    with pytest.raises(InvalidInput, match=message):
        make()


CASE = """
[mesh]
box = [2, 1]
cells = [4, 2]
[material.default]
{law}
[[fix]]
on = "top"
value = [0, -0.05]
[[contact]]
slave = "bottom"
friction = {{ coulomb = 0.0 }}
obstacle = {{ plane = {{ normal = [0, 1] }} }}
"""


@pytest.mark.parametrize(("law", "wanted"), [
    ('law = "mooney-rivlin"\nc10 = 0.3\nc01 = 0.1\nbulk = 50', MOONEY),
    ('law = "mooney-rivlin"\nc10 = 0.5\nbulk = 2', LAWS[3]),
    ('law = "reduced-polynomial"\ncoefficients = [0.3, -0.05, 0.02]\nbulk = 50', YEOH),
    ('law = "ogden"\nshears = [0.63, 0.0012, -0.01]\nexponents = [1.3, 5, -2]\nbulk = 40', 
     OGDEN),
    ('law = "saint-venant-kirchhoff"\nyoung = 2\npoisson = 0.3', KIRCHHOFF),
])  # fmt: skip
def test_laws_of_case_files(tmp_path, law, wanted):
    path = tmp_path / "block.toml"
    path.write_text(CASE.format(law=law))
    assert am.read_case(path).model.bodies[0].material == wanted
