"""Paths over load and friction at large strains: 2D and 3D, obstacles and pairs of bodies."""

import numpy as np
import pytest

import amontons as am
from amontons.analysis.paths.parametrised import path_of
from amontons.analysis.paths.point_fields import fields_at


def block(share=1.0, mu=0.3):
    """A block in 3D that is pressed and dragged on a leaning plane: it meets node by node."""
    body = am.Body(am.box((1, 1, 1), cells=2), am.NeoHookean(1.0, 0.3))
    top = am.Fix("top", (0.2 * share, 0.1 * share, -0.2 * share))
    ground = am.Plane((0.1, 0.05, 1), (0.5, 0.5, -0.1))
    return am.Model([body], [top], [am.Contact("bottom", ground, mu=mu)])


def die(share=1.0, mu=0.3):
    """A block that is pressed on another one and dragged over three of its facets."""
    lower = am.Body(am.box((4, 1), cells=(8, 2), origin=(-1, -1)), am.NeoHookean(1, 0.3),
                    name="lower")  # fmt: skip
    upper = am.Body(am.box((1, 1), cells=3), am.NeoHookean(10, 0.3), name="upper")
    supports = [am.Fix("lower.bottom", 0), am.Fix("upper.top", (share, -0.2 * share))]
    return am.Model([lower, upper], supports,
                    [am.Contact("upper.bottom", master="lower.top", mu=mu)])  # fmt: skip


def cubes(share=1.0, mu=0.3):
    """The same in 3D, one cell on nine."""
    lower = am.Body(am.box((2, 2, 1), cells=(3, 3, 1), origin=(-0.5, -0.5, -1)),
                    am.NeoHookean(1, 0.3), name="lower")  # fmt: skip
    upper = am.Body(am.box((1, 1, 1), cells=1), am.NeoHookean(10, 0.3), name="upper")
    top = am.Fix("upper.top", (0.1 * share, 0.05 * share, -0.2 * share))
    return am.Model([lower, upper], [am.Fix("lower.bottom", 0), top],
                    [am.Contact("upper.bottom", master="lower.top", mu=mu)])  # fmt: skip


def arch(top):
    """A shallow arch under a punch so soft that it snaps through; both of them rubber."""
    strip = am.box((10, 0.12), cells=(30, 1), origin=(-5, 0))
    points = strip.points.copy()
    points[:, 1] += 0.8 * (1 - (points[:, 0] / 5) ** 2) - 0.92
    bow = am.Body(am.Mesh(points, strip.cells, strip.surfaces), am.NeoHookean(100.0, 0.3),
                  name="arch")  # fmt: skip
    punch = am.Body(am.box((1, 4), cells=(2, 3), origin=(-0.5, 0)), am.NeoHookean(0.012, 0.3),
                    name="punch")  # fmt: skip
    supports = [am.Fix("arch.left", 0), am.Fix("arch.right", 0), am.Fix("punch.top", top)]
    return am.Model([bow, punch], supports,
                    [am.Contact("punch.bottom", master="arch.top", mu=0.3)])  # fmt: skip


def test_an_arch_that_another_body_presses_snaps_through():
    branch = am.follow(arch((0.0, -3.5)))
    assert branch.stops == (am.Stop.INTERVAL, am.Stop.INTERVAL)
    high, low = (event.parameter for event in branch.folds)
    assert 0.60 < low < high < 0.63
    states = branch.at((low + high) / 2)
    forces = [branch.problem.describe(y, (low + high) / 2)["resultant_y"] for y in states]
    assert len(states) == 3
    assert forces[0] > forces[1] > forces[2] > 0  # ever lower: before, between and after
    for y in states:
        assert branch.problem.solution(y, (low + high) / 2).convergence.error < 1e-8
    assert branch.orientation[0] == 1


def test_an_evolution_of_two_bodies_jumps_where_the_path_turns():
    """Steps on the way end at the first fold; what stuck before does not begin as in slip."""
    model = arch(lambda x, t: (0.0, -3.5 * t))
    method = am.QuasiStatic(0.2, crossing=am.PathCrossing())
    steps = list(am.evolve(model, method, until=0.8))
    assert all(step.passage.arrived for step in steps)
    (jump,) = [step for step in steps if step.passage.jumped]
    assert jump.time == pytest.approx(0.8)
    assert jump.passage.folds == pytest.approx([0.6227, 0.6102], abs=1e-3)
    assert jump.solution.converged
    # after the jump the lower branch: less force than where it began
    forces = [-step.resultant()[1] for step in steps]
    assert abs(forces[3]) < abs(forces[2]) + 1e-3


@pytest.mark.parametrize(
    ("make", "changes", "patterns"),
    [(block, 9, {"lfflfffff", "lllllllll"}), (die, 4, {"----", "--f-"}), (cubes, 0, {"ssss"})],
)
def test_the_path_over_the_load_is_that_of_load_steps(make, changes, patterns):
    branch = am.follow(make())
    assert branch.stops == (am.Stop.INTERVAL, am.Stop.INTERVAL)
    assert sum(e.kind is am.EventKind.STATUS for e in branch.events) == changes
    seen = set()
    for share in (0.3, 0.8, 1.0):
        (y,) = branch.at(share)
        found = branch.problem.solution(y, share)
        solved = am.solve(make(share), tolerance=1e-10)
        assert found.pattern == solved.pattern
        np.testing.assert_allclose(y, solved.v, atol=1e-8)
        np.testing.assert_allclose(found.r, solved.r, atol=1e-8)
        seen.add(found.pattern)
    assert seen >= patterns


def test_fields_of_a_point_are_those_of_supports_at_its_time():
    """Forces and areas too, of reports: not only displacements."""
    steady, solved = die(), am.solve(die(0.5), tolerance=1e-10)
    top = am.Fix("upper.top", lambda x, t: (t, -0.2 * t))
    timed = am.Model(steady.bodies, [steady.supports[0], top], steady.contacts)
    branch = am.follow(timed, at=0.5, max_points=2)
    (y,) = branch.at(0.5)
    fields = fields_at(timed, branch, branch.problem.solution(y, 0.5), 0.5)
    for name in ("displacement", "reaction"):
        for own, told in zip(getattr(solved, name), getattr(fields, name), strict=True):
            np.testing.assert_allclose(told, own, atol=1e-8)
    np.testing.assert_allclose(fields.force, solved.force, atol=1e-8)


@pytest.mark.parametrize(("make", "sticks"), [(block, "l"), (die, "-"), (cubes, "s")])
def test_the_path_over_the_friction_is_that_of_problems_with_it(make, sticks):
    branch = am.follow(make(), "friction", (0.0, 1.0))
    assert branch.stops == (am.Stop.INTERVAL, am.Stop.INTERVAL)
    assert set(str(branch[0].piece)) <= {"l", "-", "+"}
    assert sticks in str(branch[-1].piece)
    for mu in (0.0, 0.25, 1.0):
        (y,) = branch.at(mu)
        found = branch.problem.solution(y, mu)
        solved = am.solve(make(mu=mu), tolerance=1e-10)
        np.testing.assert_allclose(y, solved.v, atol=1e-8)
        np.testing.assert_allclose(found.r, solved.r, atol=1e-8)


@pytest.mark.parametrize("make", [block, die, cubes])
@pytest.mark.parametrize("parameter", ["load", "friction"])
def test_derivatives_on_pieces_also_below_no_friction(make, parameter):
    path = path_of(make(), parameter, (0.0, 1.0))
    rng = np.random.default_rng(0)
    y = path.found_at(0.6) + 1e-3 * rng.standard_normal(path.step.unknowns)
    pieces = {path.piece(y, 0.6), "s" * path.step.contacts}
    for piece in pieces:
        for p in (0.6, -0.05) if parameter == "friction" else (0.6,):
            dy, dp, h = rng.standard_normal(y.shape), rng.standard_normal(), 1e-7
            J, Jp = path.jacobian_of(piece, y, p)
            ahead = path.residual_of(piece, y + h * dy, p + h * dp)
            behind = path.residual_of(piece, y - h * dy, p - h * dp)
            change = (ahead - behind) / (2 * h)
            assert np.abs(J @ dy + Jp * dp - change).max() < 1e-5 * np.abs(change).max()
    assert (path.margins(path.piece(y, 0.6), y, 0.6) >= 0).all()
    below, at, above = (path.margins(path.piece(y, 0.6), y, p) for p in (-0.1, 0.0, 0.1))
    if parameter == "friction":  # margins are straight lines, too
        told = np.isfinite(at)
        np.testing.assert_allclose((below + above)[told], 2 * at[told], atol=1e-12)


UNIT, SHEAR, LAME = np.eye(3), 0.385, 0.577
MODULI = LAME * np.einsum("ij,kl->ijkl", UNIT, UNIT) + SHEAR * (
    np.einsum("ik,jl->ijkl", UNIT, UNIT) + np.einsum("il,jk->ijkl", UNIT, UNIT)
)


def crushed(least):
    """Saint Venant-Kirchhoff, no number where tr C is below least()."""

    def told(C, values):
        kept = np.trace(C, axis1=1, axis2=2) >= least()
        return np.where(kept.reshape(-1, *[1] * (values.ndim - 1)), values, np.nan)

    def stress(C):
        E = (C - UNIT) / 2
        return told(C, np.einsum("ijkl,nkl->nij", MODULI, E))

    def energy(C):
        E = (C - UNIT) / 2
        return told(C, np.einsum("nij,ijkl,nkl->n", E, MODULI, E) / 2)

    def moduli(C):
        return told(C, np.broadcast_to(MODULI, (len(C), 3, 3, 3, 3)))

    return am.UserEnergy(energy, stress, moduli)


def test_a_curve_that_ends_where_an_energy_is_no_number_says_where():
    least = [0.0]
    body = am.Body(am.box((1, 1), cells=1), crushed(lambda: least[0]), name="cube")
    model = am.Model([body], [am.Fix("top", (0, -0.2))],
                     [am.Contact("bottom", am.Plane((0, 1)), mu=0.3)])  # fmt: skip
    least[0] = 2.85
    branch = am.follow(model, at=0.1)
    assert branch.stops[1] is am.Stop.STEP_TOO_SMALL
    detail = branch.events[-1].detail
    assert "energy is not a finite number" in detail
    assert "of body 'cube'" in detail


def test_starts_without_numbers_and_models_without_contacts_are_refused():
    branch = am.follow(die(), at=0.5, max_points=2)
    with pytest.raises(am.InvalidInput, match="start: expected finite numbers"):
        am.follow(die(), start=np.full_like(branch[0].state, np.nan), at=0.5)
    free = am.Model(die().bodies, die().supports, [])
    with pytest.raises(am.UnsupportedForm, match="without contacts no path is followed"):
        am.follow(free)


class Touch:
    """y - p + max(0, m(p)) with m > 0 from 0.3 to 0.302: two borders within one step."""

    def _reach(self, p):
        return (p - 0.3) * (0.302 - p)

    def residual(self, y, p):
        return self.residual_of(self.piece(y, p), y, p)

    def residual_of(self, piece, y, p):
        return y - p + (self._reach(p) if piece == "in" else 0.0)

    def jacobian(self, y, p):
        return self.jacobian_of(self.piece(y, p), y, p)

    def jacobian_of(self, piece, y, p):
        slope = 0.602 - 2 * p if piece == "in" else 0.0
        return np.eye(1), np.array([slope - 1.0])

    def margins(self, piece, y, p):
        return np.array([self._reach(p) * (1 if piece == "in" else -1)])

    def piece(self, y, p):
        return "in" if self._reach(p) > 0 else "out"

    def pieces(self, y, p, tolerance):
        return ["in", "out"] if abs(self._reach(p)) <= tolerance else [self.piece(y, p)]


@pytest.mark.parametrize(("start", "end"), [(0.299, 0.31), (0.303, 0.29)])
def test_a_piece_that_is_shorter_than_a_step_is_passed(start, end):
    """The first step ends inside of it, the next one, from its border, beyond it."""
    options = am.Continuation(step=0.004)
    interval = (min(start, end), max(start, end))
    branch = am.follow(Touch(), start=[start], at=start, interval=interval, options=options)
    assert branch.stops == (am.Stop.INTERVAL, am.Stop.INTERVAL)
    events = [e for e in branch.events if e.kind is am.EventKind.STATUS]
    at = sorted(e.parameter for e in events)
    np.testing.assert_allclose(at, [0.3, 0.302], atol=1e-9)
