"""What large sliding must not depend on: tangents, patches on random meshes, turns, moments.

    python benchmarks/large_sliding_invariants.py [--states 1000] [--meshes 3] [--angles 3]

Tangents are compared with differences of sixth order at random states, every other of which
has slave nodes 1e-4 beside nodes or middles of edges of the master; then slid off the master's
edges, where nodes fade.  A state is left out, and counted, where a piece of the law,
or which facets face each other, changes within the difference.  Writes
results/large_sliding_invariants.md beside this file.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
from large_sliding_states import (
    DIFFERENCE,
    NEO,
    STEP,
    comparable,
    folded_rotations,
    folded_tangents,
    of_tangent,
    rotation,
    turned_residual,
)

import amontons as am
from amontons.mechanics.model.large_deformation import large_deformation, large_step
from amontons.mechanics.model.nonlinear_parts import nonlinear_parts
from amontons.mechanics.steps.system import Inertia

CASES = [  # dimension, kinds of cells and orders of both bodies
    (2, ("quad", "tri"), (1, 1)), (2, ("quad", "quad"), (2, 2)), (3, ("hex", "hex"), (1, 1)),
    (3, ("tet", "hex"), (1, 1)), (3, ("hex", "tet"), (2, 2)), (3, ("hex", "hex"), (1, 2)),
]  # fmt: skip


PAGE = Path(__file__).parent / "results/large_sliding_invariants.md"
HEAD = """# What large sliding must not depend on

Regenerate: `python benchmarks/large_sliding_invariants.py`.

Tangents of whole problems (mu 0.3, finite strains) against differences of sixth order with
steps of 1e-6 (of fourth order with 1e-6 and 5e-7, extrapolated), at random states, half of them
with slave nodes 1e-4 beside nodes and middles of edges of the master, then slid off its edges;
left out where a piece of the law or the facets that face each other change within the
difference. Rotations by any angle: of residuals at random states, half of them slid off the
edges, while the nodes turn by one rotation and those at the end of the last step, since which
friction counts, by another one; and of round ends pressed and dragged by load steps, everything
turned (displacements and forces). Patch tests: two cubes of random meshes that do not match, 30
% shorter, mu 0 and 0.3, slave and master in turns; departure of all nodes from one stretch.
Moments: two round ends pressed by 20 % and slid by 0.3 of their width (in 3D 0.18); sum and
moment of all contact forces, over the sum of their sizes (times the width, 1). Moment of
momentum: the same two, free, hit each other off their centres while they turn; the largest
change over all steps, over the sum of the sizes of the nodes' momenta.

| what | model | over | worst, relative | CPU s |
|---|---|---|---|---|
"""
TOLD = """
Forces cancel to rounding, and so does their moment, by the couples of `contact.couples`.
Without these it was 5e-7 to 2e-9 of force times width between the round ends in 2D (6 to 48
facets).

Slid off the master's edges, nodes fade (`contact.fading`), and a sliver may be all that faces a
node: 1e-5 of its area and less, down to 1e-12. Averages of such a node are extrapolations from
the sliver; they are told to rounding over the square of its width. Other nodes get of it what
the law gives, (3) of `model.moved_pairs`, which is next to nothing, and not what its body asks
for at a random state: with that the tangent was up to 2e-1 off, and the residual itself told to
2e-7 only. Differences of lower order would not tell: those of second order have errors of up to
2e-7 at these states, and of 2e-4 in two states of 2D self contact of second order, where less
than 1e-3 of a node faces the master; those of fourth order have 1.3e-7 and 9e-8 there, and
3.7e-10 and 8.8e-10 with a tenth of the step; these of sixth 1.7e-10 and 2.0e-10.
Facets seen edge-on fade with two derivatives (`contact.edge_on`): where the second one jumped,
one state of 3D self contact was 2.9e-7 off with a facet that began to fade within a difference.
Where corners of a facet pass edges of another second derivatives jump, too, as clipping has it:
differences across that have errors of first order in their step.

A node that faced nobody at the end of the last step and does now counts its motion against the
facets that it meets now, which take along the place where it was (`contact.newcomers`): it
turns with the rest.  In fixed axes against the closest node, as before, rotations changed
forces by up to 3.7e-8 in 11 of 1 002 states.  So does a node that only a sliver faced then.

One surface against itself: a block with a slot, all of its outside, where the root of the slot
and the ends of both arms are seen edge-on by its sides.  Facets fade there before their
projection crosses itself (`contact.edge_on`); the tangent was up to 1e2 off without.  There
slivers of 1e-9 of a node's area may be beside slivers alone, which do not fade.  Averages of
such a node are extrapolated by 1 / d over the width d of the sliver, and rounding of places,
which no rotation can do without, changes forces by up to eps / d^2: 1e-10 in a random state.
Rows say so: changes above 1e-12 are beside the worst of three that moving all places by up to
2.2e-16 of themselves makes, without a rotation.  No rule is one of fixed axes.
"""
KINDS = ("tangent", "tangent, self contact", "rotation", "rotation, self contact", "patch",
         "moment", "moment of momentum")  # fmt: skip
LINES: list[str] = []


def tell(line):
    """Print a row of the table and keep it for the page."""
    print(line, flush=True)
    LINES.append(line)


def uneven(mesh, rng, size):
    """Nodes moved at random, those of sides along them."""
    x = mesh.points.copy()
    low, high = x.min(axis=0), x.max(axis=0)
    for k in range(x.shape[1]):
        inner = (x[:, k] > low[k] + 1e-9) & (x[:, k] < high[k] - 1e-9)
        x[inner, k] += size * rng.uniform(-1, 1, inner.sum())
    return replace(mesh, points=x)


def bodies(dim, kinds, orders, rng, *, wider=0.0):
    """Two cubes of uneven meshes, one on the other."""
    counts = ((4, 2), (3, 2)) if dim == 2 else ((3, 3, 1), (2, 2, 1))
    out = []
    for name, kind, order, cells, z in zip(("lower", "upper"), kinds, orders, counts, (-1, 0),
                                           strict=True):  # fmt: skip
        more = wider if name == "lower" else 0.0
        size = (1 + 2 * more,) * (dim - 1) + (1,)
        mesh = am.box(size, cells, kind=kind, origin=(-more,) * (dim - 1) + (z,))
        mesh = uneven(mesh, rng, 0.2 / max(cells))
        out.append(am.Body(mesh, NEO, name=name, order=order))
    return out


def pair_of(both, *, off=False):
    """The cubes in contact; off: with the larger one, below, as the slave."""
    sides = ("upper.bottom", "lower.top")[:: -1 if off else 1]
    return am.Model(both, [am.Fix("lower.bottom", 0), am.Fix("upper.top", 0)],
                    [am.Contact(sides[0], master=sides[1], mu=0.3)])  # fmt: skip


def beside_edges(parts, v, rng):
    """v with slave nodes moved to 1e-4 beside nodes and middles of edges of the master."""
    pair = parts.contact.pairs[0]
    u = np.zeros(parts.X.size)
    u[parts.free] = v
    x = parts.X + u.reshape(parts.X.shape)
    at = x[pair.master.nodes]
    marks = np.concatenate([at, (at + np.roll(at, 1, axis=1)) / 2]).reshape(-1, x.shape[1])
    away = np.linalg.norm(x[pair.slaves, None, :-1] - marks[None, :, :-1], axis=2)
    near = away.min(axis=1) < 0.15
    goal = marks[away.argmin(axis=1)[near]][:, :-1]
    x[pair.slaves[near], :-1] = goal + 1e-4 * rng.standard_normal(goal.shape)
    return (x - parts.X).ravel()[parts.free]


def tangents(states, *, off=False):
    """The worst relative error of the tangent over random states of all cases.

    off: the slave, larger now, slid beyond the master's edges, with nodes whose law fades.
    """
    for dim, kinds, orders in CASES:
        rng, begin = np.random.default_rng(1), time.process_time()
        both = bodies(dim, kinds, orders, rng, wider=0.2)
        model = pair_of(both, off=off)
        parts = large_deformation(model).parts
        worst, counted, left, faded, above = 0.0, 0, 0, 0, 0
        held = np.ones(parts.X.size, dtype=bool)
        held[parts.free] = False
        before = 0.01 * rng.standard_normal(parts.X.size)
        for k in range(states // len(CASES) + 1):
            moved = np.zeros(parts.X.shape)
            if off:
                moved[parts.ends[0] :, :-1] = rng.uniform(-0.6, 0.6, dim - 1)
                moved[parts.ends[0] :, -1] = -0.01
            moved = moved.ravel()
            problem = large_step(model, np.zeros(parts.X.size), np.where(held, moved, 0.0),
                                 before + moved)  # fmt: skip
            v = moved[parts.free] + 0.015 * rng.standard_normal(problem.unknowns)
            v = beside_edges(parts, v, rng) if k % 2 and not off else v
            way = rng.standard_normal(problem.unknowns)
            points = [problem.contact_point(v + k * STEP * way) for k in (0, *DIFFERENCE)]
            if not comparable(points):
                left += 1
                continue
            error = of_tangent(problem, v, way)
            worst, counted = max(worst, error), counted + 1
            faded += points[0].mixed is not None
            above += error > 1e-7
        more = f", slid off, {faded} fade, {above} above 1e-7" if off else ""
        tell(f"| tangent | {dim}D {'/'.join(kinds)} {orders} | {counted} ({left} left out)"
              f"{more} | {worst:.1e} | {time.process_time() - begin:.0f} |")


def rotations(states, *, came=False):
    """What is left of residuals at random states when both ends of the step turn.

    Half of the states slid off the master's edges.  The nodes now turn by one rotation and
    those at the end of the last step, since which friction counts, by another one: forces
    have to turn with the first, whatever the second.  came: those slid off the edges were
    somewhere else at the end of the last step.
    """
    for dim, kinds, orders in CASES:
        rng, begin = np.random.default_rng(2), time.process_time()
        both = bodies(dim, kinds, orders, rng, wider=0.2)
        models = pair_of(both), pair_of(both, off=True)
        worst, faded, new = 0.0, 0, 0
        count = states // len(CASES) + 1
        for k in range(count):
            model, off = models[k % 2], k % 2
            parts = large_deformation(model).parts
            X = parts.X
            moved = 0.015 * rng.standard_normal(X.shape)
            moved[parts.ends[0] :, :-1] += off * rng.uniform(-0.6, 0.6, dim - 1)
            moved[parts.ends[0] :, -1] -= 0.01
            before = moved + 0.01 * rng.standard_normal(X.shape)
            if came and off:
                before[parts.ends[0] :, :-1] += rng.uniform(-0.6, 0.6, dim - 1)
            turns = [(np.eye(dim),) * 2, (rotation(rng, dim), rotation(rng, dim))]
            (one, _, _), (other, problem, point) = (
                turned_residual(model, moved, before, *turn) for turn in turns)  # fmt: skip
            worst = max(worst, np.abs(other - one).max() / np.abs(one).max())
            faded += point.mixed is not None
            new += bool((point.meeting.met & ~problem.earlier.met).any())
        far = ", which slid far in the step" if came else ""
        tell(f"| rotation | {dim}D {'/'.join(kinds)} {orders} | {count} states{far}, {faded} "
             f"fade, in {new} a node comes in front of the master | "
             f"{worst:.1e} | {time.process_time() - begin:.0f} |")


def turned_way(row):
    """A component of the way of a round end, by its row of a rotation: down, then along."""
    return lambda x, t: row[0] * 0.15 * max(t - 1, 0) - row[-1] * min(t, 1) / 6


def turned_solutions(angles):
    """What changes of pressed and dragged round ends when everything is turned."""
    for d, n, order in ((2, 6, 1), (2, 5, 2), (3, 3, 1), (3, 2, 2)):
        rng, begin, found = np.random.default_rng(3), time.process_time(), []
        for turn in (np.eye(d), *(rotation(rng, d) for _ in range(angles))):
            both = [round_end((k,) * d, name, up=not j, order=order)
                    for j, (k, name) in enumerate(((n, "one"), (n + 1, "other")))]  # fmt: skip
            both = [replace(each, mesh=replace(each.mesh, points=each.mesh.points @ turn.T))
                    for each in both]  # fmt: skip

            held = am.Fix("one.top", tuple(turned_way(row) for row in turn))
            model = am.Model(both, [held, am.Fix("other.top", 0)],
                             [am.Contact("one.bottom", master="other.bottom", mu=0.3)])
            steps = list(am.evolve(model, am.QuasiStatic(0.5), until=2.0, tolerance=1e-12))
            told = [np.concatenate([step.state.displacement.reshape(-1, d),
                                    np.reshape(step.resultant(), (-1, d))]) @ turn
                    for step in steps]  # fmt: skip
            found.append(np.array(told))
        size = np.abs(found[0]).max()
        worst = max(np.abs(other - found[0]).max() for other in found[1:]) / size
        tell(f"| rotation | {d}D round ends, order {order}, mu 0.3 | {angles} angles, "
              f"{len(steps)} steps solved | {worst:.1e} | "
              f"{time.process_time() - begin:.0f} |")  # fmt: skip


def patches(meshes):
    """The worst departure from one stretch, over random meshes, both sides, mu 0 and 0.3."""
    for dim, kinds, orders in CASES:
        worst, begin, failed = 0.0, time.process_time(), 0
        for seed in range(meshes):
            both = bodies(dim, kinds, orders, np.random.default_rng(seed))
            free = (None,) * (dim - 1)
            held = [am.Fix("lower.bottom", (*free, 0)), am.Fix("upper.top", (*free, -0.6))]
            for k, side in enumerate(("left", "front")[: dim - 1]):
                hold = tuple(0 if j == k else None for j in range(dim))
                held += [am.Fix(f"{body.name}.{side}", hold) for body in both]
            sides = ("upper.bottom", "lower.top")[:: -1 if seed % 2 else 1]
            for mu in (0.0, 0.3):
                model = am.Model(both, held, [am.Contact(sides[0], master=sides[1], mu=mu)])
                found = am.solve(model, tolerance=1e-11, check=False)
                failed += not found.converged
                for body, moved in zip(model.bodies, found.displacement, strict=True):
                    basis = np.c_[body.mesh.points, np.ones(len(body.mesh.points))]
                    fit = np.linalg.lstsq(basis, moved, rcond=None)[0]
                    worst = max(worst, float(np.abs(basis @ fit - moved).max()))
        tell(f"| patch | {dim}D {'/'.join(kinds)} {orders} | {2 * meshes} solves, {failed} "
              f"above 1e-11 | {worst:.1e} | {time.process_time() - begin:.0f} |")


def round_end(cells, name, *, up, order=1, young=1.0):
    """A block with a round end at the origin, above or below."""
    d = len(cells)
    mesh = am.box((1.0,) * d, cells)
    x = mesh.points - np.append([0.5] * (d - 1), 0.0)
    square = (x[:, :-1] ** 2).sum(axis=1)
    x[:, -1] += (1.0 - np.sqrt(1.0 - square)) * (1 - x[:, -1])
    turn = np.ones(d)
    turn[[0, -1]] = 1 if up else -1
    law = am.NeoHookean(young, 0.3, density=1.0)
    return am.Body(replace(mesh, points=x * turn), law, name=name, order=order)


def moments():
    """Sum and moment of contact forces between round ends that slide, over meshes."""
    for n, order, mu in ((6, 1, 0.3), (48, 1, 0.3), (6, 2, 0.3), (4, 1, 0.0), (4, 1, 0.3),
                         (3, 2, 0.3)):  # fmt: skip
        begin, d = time.process_time(), 3 if n in (3, 4) else 2
        more = (n,) * (d - 1)
        both = [round_end((n, *more), "one", up=True, order=order),
                round_end((n + n // 3, *more), "other", up=False, order=order)]  # fmt: skip
        way = (lambda x, t: 0.3 * max(t - 1, 0), *[0.0] * (d - 2),
               lambda x, t: -0.2 * min(t, 1))  # fmt: skip
        model = am.Model(both, [am.Fix("one.top", way), am.Fix("other.top", 0)],
                         [am.Contact("one.bottom", master="other.bottom", mu=mu)])  # fmt: skip
        *_, step = am.evolve(model, am.QuasiStatic(0.2), until=2.0 if d == 2 else 1.6,
                              tolerance=1e-9)  # fmt: skip
        parts = large_deformation(step.model).parts
        u = step.state.displacement.reshape(parts.X.shape)
        f = (parts.meet(u).columns(step.frames) @ step.state.force.ravel()).reshape(u.shape)
        arm, size = (parts.X + u).T @ f, np.abs(f).sum()
        lost, total = np.abs(arm - arm.T).max() / size, np.abs(f.sum(axis=0)).max() / size
        tell(f"| moment | {d}D round ends, {n} facets, order {order}, mu {mu:g} | "
              f"sum of forces {total:.0e} | {lost:.1e} | "
              f"{time.process_time() - begin:.0f} |")  # fmt: skip


def velocity(x):
    """Off the centres towards each other, both turning."""
    side = np.sign(x[-1])
    spun = [-0.6 * side * x[1]] if len(x) == 3 else []
    return np.array([0.4 * side - 0.8 * x[-1], *spun, 0.8 * x[0] - 0.6 * side])


def momenta():
    """What is lost of momentum and its moment while round ends roll off each other."""
    for d, order, mu, step, count in ((2, 1, 0.3, 4e-3, 300), (2, 2, 0.3, 4e-3, 150),
                                      (2, 1, 0.0, 4e-3, 150), (3, 1, 0.3, 1e-2, 100),
                                      (3, 2, 0.3, 1e-2, 40)):  # fmt: skip
        begin, n = time.process_time(), (4 if d == 2 else 3) // order
        both = [round_end((n + k,) * d, name, up=not k, order=order, young=10.0)
                for k, name in enumerate(("one", "other"))]  # fmt: skip
        model = am.Model(both, [], [am.Contact("one.bottom", master="other.bottom", mu=mu)])
        start = am.at_rest(model, velocity=velocity)
        M, X = Inertia(model, 0.0, 0.0, False).M, nonlinear_parts(model).X
        told, closed = [], 0
        steps = am.evolve(model, am.MoreauJean(step), until=count * step, start=start)
        for state in (start, *(one.state for one in steps)):
            p = (M @ state.velocity).reshape(X.shape)
            arm = (X + state.displacement.reshape(X.shape)).T @ p
            told.append(np.append(p.sum(axis=0), arm - arm.T))
            closed += bool(np.abs(state.force).max() > 0)
        sums = np.abs(np.array(told) - told[0]).max(axis=0) / np.abs(M @ start.velocity).sum()
        tell(f"| moment of momentum | {d}D round ends, order {order}, mu {mu:g} | "
              f"{count} steps, {closed} in contact, momentum {sums[:d].max():.0e} | "
              f"{sums[d:].max():.1e} | {time.process_time() - begin:.0f} |")


def main():
    """Measure, and write the page."""
    asked = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    asked.add_argument("--states", type=int, default=1000)
    asked.add_argument("--meshes", type=int, default=3)
    asked.add_argument("--angles", type=int, default=3)
    asked.add_argument("--only", nargs="+", choices=KINDS, default=KINDS,
                       help="keep the rows of the others as the page has them")  # fmt: skip
    given = asked.parse_args()
    known = [line for line in PAGE.read_text().splitlines() if line.startswith("| ")]
    for kind in KINDS:
        if kind not in given.only:
            LINES.extend(line for line in known if line.startswith(f"| {kind} |"))
        elif kind == "tangent":
            tangents(given.states)
            tangents(given.states, off=True)
        elif kind == "rotation":
            rotations(given.states)
            rotations(given.states // 4, came=True)
            turned_solutions(given.angles)
        elif kind.endswith("self contact"):
            folded = folded_tangents if kind.startswith("tangent") else folded_rotations
            for line in folded(given.states // 20):
                tell(line)
        elif kind == "patch":
            patches(given.meshes)
        else:
            (moments if kind == "moment" else momenta)()
    PAGE.write_text(HEAD + "\n".join(LINES) + "\n" + TOLD)


if __name__ == "__main__":
    main()
