"""All solutions in 3D, for one load or for all loads and friction between two.

Boxes are divided as a tree says until a y excludes them (`boxes`), or all is decided and there
is at most one curve of solutions near a line (`tubes`).  Tubes that touch are one chain.
"""

import numpy as np

from .boxes import ARCS, Problem, divided
from .numbers import need
from .tubes import SIZES, tube


def chains(low, high):
    """The tubes (j) of every set of tubes whose ranges touch."""
    left, out = np.ones(len(low), dtype=bool), []
    while left.any():
        new = [int(np.argmax(left))]
        left[new[0]], chain = False, []
        while new:
            chain.append(new.pop())
            j = np.flatnonzero(left)
            met = ((low[j] <= high[chain[-1]]) & (high[j] >= low[chain[-1]])).all(axis=1)
            left[j[met]] = False
            new += [*j[met]]
        out.append(np.array(chain))
    return out


def leaves(problem, tree, span):
    """The boxes that y exclude, and those that are decided."""
    nc = len(problem.rubs)
    stack, boxes = [("." * nc, (ARCS[0],) * nc, span)], {-1: [], -2: []}
    for node in tree:
        need(stack and -2 <= node <= nc, "no tree")
        box = stack.pop()
        if node < 0:
            boxes[int(node)].append(box)
        else:
            stack += reversed(divided(box, int(node), problem.rubs))
    need(not stack, "no tree")
    need(all(set(box[0]) <= set(SIZES) for box in boxes[-2]), "a contact is not decided")
    return boxes[-1], boxes[-2]


def curves(W, q, mu, tree, y, x, k, t, r, span, distance, end=None, mu_end=None):
    """All solutions in words; t (s,), r (s, nc, 3): one of every curve."""
    problem = Problem(W, q, mu, end, mu_end)
    first, last = (float(s) for s in span)
    need(0 <= first <= last <= (0 if end is None else 1), "no span of time")
    out, rest = leaves(problem, tree, (first, last))
    need(len(y) == len(out) and len(x) == len(k) == len(rest), "no tree")
    for j in range(0, len(y), 1000):
        need(problem.excluded(out[j : j + 1000], y[j : j + 1000]).all(), "a box is left")
    tubes = [tube(problem, box, c[: 1 + sum(SIZES[x] for x in box[0])], int(j))
             for box, c, j in zip(rest, x, k, strict=True)]  # fmt: skip
    need(any(tubes), "no solution")
    sure, low, high, off = (np.array(a) for a in zip(*filter(None, tubes), strict=True))
    found, at = chains(low, high), np.column_stack([t, r.reshape(len(r), -1) / problem.to_r])
    need(all(sure[chain].any() for chain in found), "there may be a solution, or none")
    beside = [((low[chain] <= at[:, None]) & (at[:, None] <= high[chain])).all(2).any(1)
              for chain in found]  # fmt: skip
    need(len(at) == len(found) and (np.sum(beside, axis=1) == 1).all(), "another list")
    need(off.max() * problem.to_r <= distance, "solutions are not that near")
    if end is None:
        return f"this load: all solutions are within {distance:.1e} of {len(found)}"
    ends = [(low[chain, 0].min(), high[chain, 0].max()) for chain in found]
    lonely = sum(a > first and b < last for a, b in ends)
    told = ", ".join(sorted(f"{max(a, first):.6f} to {min(b, last):.6f}" for a, b in ends))
    return (f"all loads from {first:g} to {last:g} between two: all solutions are within "
            f"{distance:.1e} of {len(found)} curves ({told}), {lonely} with neither end")
