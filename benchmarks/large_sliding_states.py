"""Random states for `large_sliding_invariants`, and those of one body that meets itself."""

from __future__ import annotations

import time

import numpy as np

import amontons as am
from amontons.mechanics.model.large_deformation import large_deformation, large_step

NEO = am.NeoHookean(1.0, 0.3)
STEP = 1e-6
DIFFERENCE = {-2: 1 / 12, -1: -2 / 3, 1: 2 / 3, 2: -1 / 12}  # error of order STEP^4
FOLDS = [(2, 1, 0.008), (2, 2, 0.004), (3, 1, 0.008), (3, 2, 0.004)]  # dim, order, noise


def alike(one, other):
    """Whether the same facets face each other, and the same nodes carry force."""
    return one.met.tolist() == other.met.tolist() and all(
        getattr(one.shared, name).tolist() == getattr(other.shared, name).tolist()
        for name in ("slave", "master", "kept"))  # fmt: skip


def of_tangent(problem, v, way):
    """The error of the tangent at v along `way`, over the largest entry."""
    found = problem.tangent(v) @ way
    change = sum(part * problem.residual(v + k * STEP * way) for k, part in DIFFERENCE.items())
    return np.abs(found - change / STEP).max() / np.abs(found).max()


def comparable(points):
    """Whether no piece of the law, and none of the facets that face each other, changes."""
    return all((point.pieces == points[0].pieces).all() and alike(
        point.meeting.parts[0], points[0].meeting.parts[0]) for point in points)  # fmt: skip


def rotation(rng, dim):
    """A random rotation (dim, dim) by any angle."""
    turn = np.linalg.qr(rng.standard_normal((dim, dim)))[0]
    turn[:, 0] *= np.linalg.det(turn)
    return turn


def turned_residual(model, moved, before, now, then):
    """(F (nodes, d) turned back, problem, law) of displacements now and before, both turned."""
    parts = large_deformation(model).parts
    X = parts.X
    u, old = ((X + part) @ turn.T - X for part, turn in ((moved, now), (before, then)))
    held = np.ones(X.size, dtype=bool)
    held[parts.free] = False
    problem = large_step(model, np.zeros(X.size), np.where(held, u.ravel(), 0.0), old.ravel())
    F = np.zeros(X.size)
    F[parts.free] = problem.residual(u.ravel()[parts.free])
    return F.reshape(X.shape) @ now, problem, problem.contact_point(u.ravel()[parts.free])


def slotted(dim, order):
    """A block with a slot from one side, all of whose outside may meet itself."""
    mesh = am.box((3, 1.9, 0.5)[:dim], (12, 19, 1)[:dim])
    (block,) = mesh.cells
    centre = mesh.points[block.nodes].mean(axis=1)
    kept = block.nodes[(centre[:, 0] < 1) | (np.abs(centre[:, 1] - 0.95) > 0.05)]
    used, nodes = np.unique(kept, return_inverse=True)
    points, cells = mesh.points[used], am.Cells(block.kind, nodes.reshape(kept.shape))
    mesh = am.Mesh(points, (cells,), node_sets={"left": np.flatnonzero(points[:, 0] < 1e-9)})
    mesh = mesh.with_surfaces({"all": mesh.boundary})
    body = am.Body(mesh, NEO, name="block", order=order)
    return am.Model([body], [am.Fix("left", 0)],
                    [am.Contact("block.all", master="block.all", mu=0.3)])  # fmt: skip


def folded_tangents(states):
    """Rows of the page: the worst tangents of the slotted block."""
    for dim, order, size in FOLDS:
        rng, begin = np.random.default_rng(6), time.process_time()
        model = slotted(dim, order)
        dofs = large_deformation(model).parts.X.size
        errors, left, inverted = [], 0, 0
        for _ in range(states):
            problem = large_step(model, np.zeros(dofs), np.zeros(dofs),
                                 size * rng.standard_normal(dofs))  # fmt: skip
            v, way = rng.standard_normal((2, problem.unknowns)) * [[size], [1.0]]
            try:
                points = [problem.contact_point(v + k * STEP * way) for k in (0, *DIFFERENCE)]
            except am.InvertedCells:
                inverted += 1
                continue
            if comparable(points):
                errors.append(of_tangent(problem, v, way))
            else:
                left += 1
        yield (f"| tangent | {dim}D one surface against itself, order {order} | {len(errors)} "
               f"({left} left out, cells inverted in {inverted}), "
               f"{np.sum(np.array(errors) > 1e-7)} above 1e-7 | {max(errors):.1e} | "
               f"{time.process_time() - begin:.0f} |")  # fmt: skip


def folded_rotations(states):
    """Rows of the page: what is left of residuals of the slotted block, all turned."""
    for dim, order, size in FOLDS:
        rng, begin = np.random.default_rng(7), time.process_time()
        model, worst, new, counted = slotted(dim, order), 0.0, 0, 0
        X = large_deformation(model).parts.X
        free = X[:, 0] > 1e-9
        for _ in range(states):
            moved = size * rng.standard_normal(X.shape)
            before = moved + size * rng.standard_normal(X.shape)
            turns = [(np.eye(dim),) * 2, (rotation(rng, dim), rotation(rng, dim))]
            try:
                found = [turned_residual(model, moved, before, *turn) for turn in turns]
            except am.InvertedCells:
                continue
            (one, _, _), (other, problem, point) = found
            worst = max(worst, np.abs(other - one)[free].max() / np.abs(one).max())
            new += bool((point.meeting.met & ~problem.earlier.met).any())
            counted += 1
        yield (f"| rotation | {dim}D one surface against itself, order {order} | {counted} "
               f"states, in {new} a node comes in front of the master | {worst:.1e} | "
               f"{time.process_time() - begin:.0f} |")  # fmt: skip
