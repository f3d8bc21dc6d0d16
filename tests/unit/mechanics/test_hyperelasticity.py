"""Hyperelastic laws and their element loops: energy, stress, tangent, rotations, limits."""

import numpy as np
import pytest

import amontons as am
from amontons.core.errors import InvalidInput, InvertedCells
from amontons.mechanics.elements import stiffness
from amontons.mechanics.elements.hyperelasticity import (
    CiarletGeymonat,
    HyperelasticBody,
    NeoHookean,
    cauchy_stress,
)
from amontons.mechanics.meshes import Cells, Mesh, second_order

LAWS = (NeoHookean(3.0, 0.3), CiarletGeymonat(3.0, 0.35), CiarletGeymonat(2.0, 0.2, a=0.3))
PYRAMID = Mesh(
    [[0, 0, 0], [1, 0, 0], [1.1, 1, 0], [0, 1, 0], [0.4, 0.5, 0.9]],
    (Cells("pyramid", np.arange(5)[None], "default"),),
)


def meshes():
    """One small mesh of every kind of cell."""
    return {
        "quad": am.box((2, 1), cells=(3, 2)),
        "tri": am.box((2, 1), cells=(3, 2), kind="tri"),
        "tri6": second_order(am.box((2, 1), cells=(2, 1), kind="tri")),
        "quad9": second_order(am.box((2, 1), cells=(2, 1))),
        "hex": am.box((2, 1, 1), cells=(2, 2, 1)),
        "tet": am.box((2, 1, 1), cells=(2, 1, 1), kind="tet"),
        "tet10": second_order(am.box((2, 1, 1), cells=(1, 1, 1), kind="tet")),
        "pyramid": PYRAMID,
    }


def deformed(mesh, seed):
    """Displacements of a random large but admissible deformation."""
    rng = np.random.default_rng(seed)
    slope = np.eye(mesh.dim) + 0.25 * rng.uniform(-1, 1, (mesh.dim, mesh.dim))
    return mesh.points @ (slope - np.eye(mesh.dim)).T + 0.01 * rng.uniform(
        -1, 1, mesh.points.shape
    )


def energy_density(law, F):
    """W of the two laws, written from their textbook formulas for a 3x3 F."""
    C, J = F.T @ F, np.linalg.det(F)
    if isinstance(law, NeoHookean):
        return (law.shear / 2 * (np.trace(C) - 3) - law.shear * np.log(J)
                + law.lame_lambda() / 2 * np.log(J) ** 2)  # fmt: skip
    cofactor = np.linalg.det(C) * np.linalg.inv(C).T
    a, b = law.a, law.shear / 2 - law.a
    c, d = law.lame_lambda() / 4 - law.shear / 2 + law.a, law.lame_lambda() / 2 + law.shear
    return (a * (np.trace(C) - 3) + b * (np.trace(cofactor) - 3)
            + c * (np.linalg.det(C) - 1) - d * np.log(J))  # fmt: skip


@pytest.mark.parametrize("law", LAWS, ids=repr)
@pytest.mark.parametrize("kind", meshes())
def test_tangent_forces_and_energy_belong_together(kind, law):
    mesh = meshes()[kind]
    body, u = HyperelasticBody(mesh, law), deformed(mesh, 3)
    forces, blocks = body.tangent(u)
    direction = np.random.default_rng(5).standard_normal(u.shape)
    step = 1e-5
    ahead, behind = body.forces(u + step * direction), body.forces(u - step * direction)
    predicted = (body.matrix(blocks) @ direction.ravel()).reshape(u.shape)
    error = np.abs((ahead - behind) / (2 * step) - predicted).max()
    assert error < 1e-6 * np.abs(predicted).max()
    work = (body.energy(u + step * direction) - body.energy(u - step * direction)) / (2 * step)
    assert work == pytest.approx((forces * direction).sum(), rel=1e-6)
    assert np.array_equal(forces, body.forces(u))


@pytest.mark.parametrize("law", LAWS, ids=repr)
@pytest.mark.parametrize("kind", meshes())
def test_patch(kind, law):
    """A uniform F: the energy of the formula, no force inside, stress from differences of W."""
    mesh = meshes()[kind]
    F = np.eye(3)
    rng = np.random.default_rng(1)
    F[: mesh.dim, : mesh.dim] += 0.3 * rng.uniform(-1, 1, (mesh.dim, mesh.dim))
    u = mesh.points @ (F - np.eye(3))[: mesh.dim, : mesh.dim].T
    body = HyperelasticBody(mesh, law)
    volume = 1.0 if kind == "pyramid" else 2.0
    if kind != "pyramid":
        assert body.energy(u) == pytest.approx(volume * energy_density(law, F), rel=1e-12)
    P = np.zeros((3, 3))
    for i, k in np.ndindex(3, 3):
        shift = np.zeros((3, 3))
        shift[i, k] = 1e-6
        P[i, k] = (energy_density(law, F + shift) - energy_density(law, F - shift)) / 2e-6
    wanted = P @ F.T / np.linalg.det(F)
    found = cauchy_stress(mesh, law, u)
    assert np.abs(found - wanted).max() < 1e-8 * np.abs(wanted).max()
    forces = body.forces(u)
    outer = np.unique(np.concatenate([f.nodes.ravel() for f in mesh.boundary]))
    inner = np.setdiff1d(np.arange(len(mesh.points)), outer)
    assert np.abs(forces[inner]).max(initial=0) < 1e-13 * np.abs(P).max()
    # the moment of the nodal forces about the origin is the integral of P
    if kind != "pyramid":
        total = forces.T @ mesh.points
        dim = mesh.dim
        assert np.abs(total - volume * P[:dim, :dim]).max() < 1e-8 * np.abs(P).max()


@pytest.mark.parametrize("law", LAWS, ids=repr)
@pytest.mark.parametrize("kind", ["quad", "tri6", "hex"])
def test_rigid_motions_and_rotations(kind, law):
    mesh = meshes()[kind]
    Q = np.linalg.qr(np.random.default_rng(2).standard_normal((mesh.dim, mesh.dim)))[0]
    Q[0] *= np.linalg.det(Q)
    body, u = HyperelasticBody(mesh, law), deformed(mesh, 7)
    assert (
        np.abs(body.forces(mesh.points @ (Q.T - np.eye(mesh.dim)) + 1)).max()
        < 1e-13 * law.young
    )
    x = mesh.points + u
    turned = body.forces(x @ Q.T - 3 - mesh.points)
    assert np.abs(turned - body.forces(u) @ Q.T).max() < 1e-12 * np.abs(turned).max()


@pytest.mark.parametrize("law", LAWS, ids=repr)
@pytest.mark.parametrize("kind", [k for k in meshes() if k != "pyramid"])
def test_the_tangent_at_rest_is_linear_elasticity(kind, law):
    mesh = meshes()[kind]
    linear = stiffness(mesh, am.LinearElastic(law.young, law.poisson)).tocsr()
    body = HyperelasticBody(mesh, law)
    tangent = body.matrix(body.tangent(np.zeros_like(mesh.points))[1]).tocsr()
    assert abs(tangent - linear).max() < 1e-12 * abs(linear).max()


@pytest.mark.parametrize("law", LAWS, ids=repr)
def test_inverted_cells_are_reported_and_never_a_number(law):
    mesh = am.box((1, 1), cells=2)
    body = HyperelasticBody(mesh, law)
    u = mesh.points * [0.0, -2.0]
    for ask in (body.forces, body.tangent, body.energy):
        with pytest.raises(InvertedCells, match="det F is -1"):
            ask(u)
        with pytest.raises(InvertedCells):
            ask(np.full_like(u, np.nan))


def test_several_regions():
    points = [[0, 0], [1, 0], [2, 0], [0, 1], [1, 1], [2, 1]]
    left, right = np.array([[0, 1, 4, 3]]), np.array([[1, 2, 5, 4]])
    mesh = Mesh(points, (Cells("quad", left, "left"), Cells("quad", right, "right")))
    u = deformed(mesh, 4)
    both = HyperelasticBody(mesh, {"left": LAWS[0], "right": LAWS[1]}).forces(u)
    only = [HyperelasticBody(mesh, law).forces(u) for law in LAWS[:2]]
    assert np.allclose(both[[0, 3]], only[0][[0, 3]], atol=1e-14)
    assert np.allclose(both[[2, 5]], only[1][[2, 5]], atol=1e-14)
    with pytest.raises(InvalidInput, match="region 'right'"):
        HyperelasticBody(mesh, {"left": LAWS[0], "right": am.LinearElastic(1.0, 0.3)})


def test_laws_refuse_what_they_can_not_be():
    with pytest.raises(InvalidInput, match="young"):
        NeoHookean(-1.0, 0.3)
    with pytest.raises(InvalidInput, match="poisson"):
        NeoHookean(1.0, 0.5)
    with pytest.raises(InvalidInput, match="NeoHookean"):
        CiarletGeymonat(1.0, -0.1)
    with pytest.raises(InvalidInput, match="polyconvex"):
        CiarletGeymonat(1.0, 0.3, a=5.0)
    with pytest.raises(InvalidInput, match="shear"):
        CiarletGeymonat.from_lame(1.0, -2.0)
    law = CiarletGeymonat.from_lame(4000.0, 120.0)
    assert law.a == pytest.approx(30)
    assert law.coefficients == pytest.approx((30, 30, 970, 2120, 0))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: am.NeoHookean("1", 0.3), "young: expected a number, got '1'"),
        (lambda: am.NeoHookean(1.0, None), "poisson: expected a number, got None"),
        (lambda: am.CiarletGeymonat(1.0, 0.3, "x"), "a: expected between"),
        (lambda: am.CiarletGeymonat.from_lame("1", 1.0), "lame_lambda, shear: expected"),
        (lambda: am.CiarletGeymonat.from_lame(np.nan, 1.0), "lame_lambda, shear: expected"),
    ],
)
def test_constants_have_to_be_numbers(make, message):
    with pytest.raises(InvalidInput, match=message):
        make()
