"""Two deforming bodies of second order where they are now: patch test, slopes, rotations."""

import numpy as np
import pytest
from tangent_checker import checked_tangents

import amontons as am
from amontons.mechanics.contact.current_mortar import MortarPair
from amontons.mechanics.contact.facing import Skin
from amontons.mechanics.meshes.order import second_order
from amontons.mechanics.model.large_deformation import large_deformation, large_step

NEO = am.NeoHookean(1.0, 0.3)
STEP = 2e-7  # differences miss 1e-6 with steps of 1e-6, and less by its square
KINDS = {2: ("quad", "tri"), 3: ("hex", "tet")}


def mesh(size, cells, kind, origin, *, serendipity=False, order=2):
    """A box of second order."""
    box = am.box(size, cells, kind=kind, origin=origin)
    return second_order(box, serendipity=serendipity) if order == 2 else box


def blocks(dim, kinds, *, serendipity=(False, False), orders=(2, 2), swap=False, mu=0.3):
    """Two unit cubes of meshes that do not match, one on the other: (bodies, contact)."""
    counts = ((3, 2), (2, 2)) if dim == 2 else ((3, 2, 1), (2, 3, 1))
    down = (0,) * (dim - 1) + (-1,)
    lower, upper = (
        am.Body(mesh((1,) * dim, cells, kind, at, serendipity=eight, order=order), NEO,
                name=name)
        for cells, kind, at, name, eight, order in zip(
            counts, kinds, (down, (0,) * dim), ("lower", "upper"), serendipity, orders,
            strict=True)
    )  # fmt: skip
    sides = ("upper.bottom", "lower.top")[:: -1 if swap else 1]
    return [lower, upper], am.Contact(sides[0], master=sides[1], mu=mu)


def squeezed(dim, bodies, pair):
    """Both held along planes of symmetry and pressed together by 30 %."""
    free = (None,) * (dim - 1)
    supports = [am.Fix("lower.bottom", (*free, 0)), am.Fix("upper.top", (*free, -0.6))]
    for name in ("lower", "upper"):
        supports.append(am.Fix(f"{name}.left", (0, *[None] * (dim - 1))))
        if dim == 3:
            supports.append(am.Fix(f"{name}.front", (None, 0, None)))
    return am.Model(bodies, supports, [pair])


CASES = [
    (2, ("quad", "quad"), (False, False), (2, 2)), (2, ("quad", "tri"), (True, False), (2, 2)),
    (2, ("tri", "quad"), (False, False), (2, 1)), (3, ("hex", "hex"), (False, False), (2, 2)),
    (3, ("hex", "hex"), (True, True), (2, 2)), (3, ("hex", "tet"), (True, False), (2, 2)),
    (3, ("tet", "tet"), (False, False), (2, 2)), (3, ("hex", "tet"), (False, False), (1, 2)),
]  # fmt: skip


@pytest.mark.parametrize("swap", [False, True])
@pytest.mark.parametrize(("dim", "kinds", "serendipity", "orders"), CASES)
def test_patch(dim, kinds, serendipity, orders, swap):
    """Meshes that do not match, 30 % shorter: one stretch everywhere, one pressure."""
    bodies, pair = blocks(dim, kinds, serendipity=serendipity, orders=orders, swap=swap)
    model = squeezed(dim, bodies, pair)
    solution = am.solve(model, tolerance=1e-12)
    stretches = []
    for body, moved in zip(model.bodies, solution.displacement, strict=True):
        basis = np.c_[body.mesh.points, np.ones(len(body.mesh.points))]
        fit = np.linalg.lstsq(basis, moved, rcond=None)[0]
        assert np.abs(basis @ fit - moved).max() < 1e-10
        stretches.append(fit[:dim])
    assert np.abs(stretches[0] - stretches[1]).max() < 1e-10
    assert np.ptp(solution.pressure) < 1e-10
    assert dim == 3 or solution.convergence.iterations <= 6


@pytest.mark.parametrize("mu", [0.0, 0.3])
@pytest.mark.parametrize(("dim", "kinds", "serendipity", "orders"), CASES)
def test_the_tangent_is_exact(dim, kinds, serendipity, orders, mu):
    bodies, pair = blocks(dim, kinds, serendipity=serendipity, orders=orders, mu=mu)
    model = am.Model(bodies, [am.Fix("lower.bottom", 0), am.Fix("upper.top", 0)], [pair])
    rng = np.random.default_rng(3)
    dofs = large_deformation(model).parts.X.size
    before = 0.01 * rng.standard_normal(dofs)
    problem = large_step(model, np.zeros(dofs), np.zeros(dofs), before)
    draws = (rng.standard_normal((2, problem.unknowns)) * [[0.01], [1.0]] for _ in range(10))
    assert checked_tangents(problem, draws) > 5


def bent(dim, kinds, serendipity, orders):
    """Surfaces with a gap, waves and bulges, one of them without a row: (pair, positions)."""
    bodies, _ = blocks(dim, kinds, serendipity=serendipity, orders=orders)
    upper, lower = bodies[1].mesh, bodies[0].mesh
    x = np.concatenate([upper.points + 0.03, lower.points])
    x += 0.01 * np.random.default_rng(5).standard_normal(x.shape)
    skins = [
        Skin.of(upper.surface("bottom"), 0),
        Skin.of(lower.surface("top"), len(upper.points)),
    ]
    nodes = skins[0].all[1:]
    return MortarPair(nodes, *skins, np.ones((len(nodes), dim), dtype=bool)), x


def told(meeting, earlier, force):
    """What has derivatives, of the nodes that meet."""
    both = (meeting.met & earlier.met)[:, None]
    return [meeting.normals, meeting.distances * meeting.met[:, None],
            meeting.gap * meeting.met, meeting.averages.T @ force,
            meeting.couples.matrix @ force.ravel(), meeting.motion(earlier) * both]  # fmt: skip


@pytest.mark.parametrize(("dim", "kinds", "serendipity", "orders"), CASES)
def test_slopes_at_random_states(dim, kinds, serendipity, orders):
    pair, rest = bent(dim, kinds, serendipity, orders)
    earlier, rng = pair.at(rest), np.random.default_rng(0)
    checked = 0
    for _ in range(40):
        x, way = rest + 0.02 * rng.standard_normal(rest.shape), rng.standard_normal(rest.shape)
        here, behind, ahead = (pair.at(x + k * STEP * way) for k in (0, -1, 1))
        if not all((side.met == here.met).all() for side in (behind, ahead)):
            continue
        force = rng.standard_normal((len(here.met), dim)) * here.met[:, None]
        slopes, both = here.slopes, np.repeat(here.met & earlier.met, dim)
        found = [one @ way.ravel() for one in (
            slopes.normals, slopes.distances, slopes.gap, slopes.spread(force),
            here.couples.slopes(force), slopes.motion(earlier))]  # fmt: skip
        found[-1] = found[-1] * both
        sides = (told(side, earlier, force) for side in (ahead, behind))
        for mine, after, before in zip(found, *sides, strict=True):
            difference = (after - before).ravel() / (2 * STEP)
            assert np.abs(mine - difference).max() < 1e-7 * np.abs(difference).max()
        checked += 1
    assert checked > 30


@pytest.mark.parametrize(("dim", "kinds", "serendipity", "orders"), CASES)
def test_forces_balance_and_rotations_change_nothing(dim, kinds, serendipity, orders):
    pair, x = bent(dim, kinds, serendipity, orders)
    rng, here = np.random.default_rng(1), pair.at(x)
    force = rng.standard_normal((len(here.met), dim)) * here.met[:, None]
    spread = here.averages.T @ force
    assert np.abs(spread.sum(axis=0)).max() < 1e-13
    far = here.distances * here.passed[:, None]
    moments = [np.einsum("pi,pj->ij", *both) for both in ((x, spread), (far, force))]
    moments = [arm - arm.T for arm in moments]
    assert np.abs(moments[0] - moments[1]).max() < 1e-13
    couples = (here.couples.matrix @ force.ravel()).reshape(x.shape)
    assert np.abs(couples.sum(axis=0)).max() < 1e-13
    moment = np.einsum("pi,pj->ij", x, spread + couples)
    assert np.abs(moment - moment.T).max() < 1e-13
    for _ in range(3):
        turn = np.linalg.qr(rng.standard_normal((dim, dim)))[0]
        turn[0] *= np.sign(np.linalg.det(turn))
        after = pair.at(x @ turn.T + 1.0)
        assert (after.met == here.met).all()
        np.testing.assert_allclose(after.motion(here)[here.met], 0, atol=1e-11)
        np.testing.assert_allclose(after.gap[here.met], here.gap[here.met], atol=1e-12)
