"""What changes when slave and master change places, over the mesh: ironing in 3D.

    python benchmarks/large_sliding_swap.py [--fine 1 1.6 2 3] [--section 1 2 3 4 6 8]
                                            [--block 1 2 4] [--curves 1 2]

The case of `large_sliding_growth`: pressed in by two load steps, dragged by two; a block that
ends within facets of the slab; whole curves of the ironing in 2D of `large_sliding`; and the
section in plane strain of the first, pressed alike, on meshes that space does not allow, with
the die at several places within a cell of the slab.  Writes
results/large_sliding_swap.md beside this file.
"""

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import argparse
from pathlib import Path

import numpy as np
from large_sliding_growth import ironing
from large_sliding_models import Case, die, shallow

import amontons as am

HERE = Path(__file__).parent
HEAD = """# Slave and master change places

Regenerate: `python benchmarks/large_sliding_swap.py{options}`.

A die pressed by 0.05 into a slab in two load steps, then dragged by 0.05 in two more, in 3D,
friction 0.3: normal force after the first with the die's side as the slave, and changes, when
the slab's side is the slave instead, of the normal force, and of the horizontal one while it is
dragged.  Cells: along the die.

| cells | contacts | force, press 1 | {steps} |
|---|---|---|---|---|---|---|---|---|
"""
BLOCK = """
## A side that ends within facets

A block of 1 x 0.5, ten times as stiff, is pressed by 0.02 into a slab of 3 x 1 in 2D, friction
0.3, with its ends at {places} places within a cell of the slab: normal force with either side
as the slave, mean over the places and the largest less the smallest of them; and the largest
change by the slave.  Cells: of the slab beside the block.

| cells | block's side | over places | slab's side | over places | change by the slave |
|---|---|---|---|---|---|
"""
CURVES = """
The ends of a block are singular points, and all forces come down to one limit at first order.
With the slab's side as the slave its last node lies outside: its law fades (`contact.fading`),
and up to which part of it tells how wide the block acts.  With 0.4 of its neighbours' the
force is nearly the same wherever the block ends; with 0.2, as before, it was 5 % different with
5 cells and 3 % with 10, also without friction, for other stiffnesses and depths, triangles and
second order; with 0.5 up to 1.3 %.  The largest changes in 3D were 5.5, 1.9 and 1.9 % then: 8
cells change more now, by a force with the slab's side as the slave that is closer to that of 10
cells (press 1: 0.01867, 0.01915 before).  With the die's ends at four places within a cell of
the slab, 5 cells, the force after press 2 is 0.0427 to 0.0440 with the die's side as the slave
and 0.0439 to 0.0443 with the slab's (0.0442 to 0.0464 before).

## Curves in 2D

Ironing in 2D, the shallow case of `large_sliding`, all load steps: root mean square of what
the slave changes, over that of the force; the horizontal one while it is dragged, and its mean.

| facets across the die | normal | horizontal | horizontal, mean |
|---|---|---|---|
"""
SECTION = """
The horizontal force ripples as nodes of one side pass those of the other, with the die's side
as the slave by 1.2 % with 9 facets across it, with the slab's by 0.5; with 18 by 0.5 both.

## Why the first step differs most

The section of both bodies in 2D, plane strain, pressed by the same two load steps, with the die
at {places} places within a cell of the slab's surface: normal force with either side as the
slave over that of the finest mesh, {force_1:.5f} and {force_2:.5f} (mean of all of it): mean
error, and the largest departure of a place from that mean; closed nodes of the slave across the
strip of contact, of the first place, the die's and the slab's; and the largest change by the
slave, and the mean one.

| cells | step | closed | die's side | slab's side | change by the slave, largest | mean |
|---|---|---|---|---|---|---|
"""
TOLD = """
The largest changes fall as the length of cells to the power of {0:.1f} and {1:.1f} (least
squares).
The meshes in 3D above have too few cells, and each its own place of the die, to tell an order.

The error is one of the mesh, of both ways.  Either side's force goes to the same limit, the
means over places of the die at about second order in the length of cells at first; and it
scatters as the edge of the strip of contact falls between other nodes: each node stands for a
part of the strip as long as a facet.  In the first step, with two to five nodes in contact, the
scatter is as large as the changes by the slave, which have either sign, and falls with the mesh
like these.  The section has no ends of the cylinder; in 3D they scatter as the block above.
The side with the smaller cells, here the die's, scatters less and is the better slave.
"""
STEPS = ("press 1", "press 2", "drag 1", "drag 2", "horizontal 1", "horizontal 2")


def forces(fine, swap):
    """(contacts, force on the die after every load step (4, 3))."""
    out = []
    for step in am.evolve(ironing(fine).model(swap), am.QuasiStatic(1.0), until=4):
        out.append(np.ravel(step.resultant()))
    return len(step.solution.r), np.array(out) * (-1 if swap else 1)


def row(fine):
    """A row of the page."""
    (contacts, one), (_, other) = (forces(fine, swap) for swap in (False, True))
    changes = other / one - 1
    told = [*changes[:, 2], *changes[2:, 0]]
    cells = " | ".join(f"{100 * change:+.2f} %" for change in told)
    line = f"| {round(5 * fine)} | {contacts} | {abs(one[0, 2]):.5f} | {cells} |"
    print(line, flush=True)
    return line


def block(fine, places):
    """A row of the second table."""
    force = np.zeros((places, 2))
    for place in range(places):
        slab = am.box((3, 1), (15 * fine, 5 * fine))
        upper = am.box((1, 0.5), (6 * fine, 3 * fine),
                       origin=(0.9 + place / places * 0.2 / fine, 1.0))  # fmt: skip
        case = Case(slab, upper, (1.0, 10.0), 0.02, 0.0, 0.3, 1, 0)
        for k in range(2):
            (step,) = am.evolve(case.model(bool(k)), am.QuasiStatic(1.0), until=1)
            force[place, k] = abs(np.ravel(step.resultant())[1])
    mean = force.mean(axis=0)
    spread = 100 * np.ptp(force, axis=0) / mean
    change = 100 * np.abs(force[:, 1] / force[:, 0] - 1).max()
    sides = " | ".join(f"{mean[k]:.5f} | {spread[k]:.2f} %" for k in range(2))
    line = f"| {5 * fine} | {sides} | {change:.2f} % |"
    print(line, flush=True)
    return line


def curve(fine):
    """A row of the third table."""
    case, told = shallow(fine), []
    for swap in (False, True):
        steps = am.evolve(case.model(swap), am.QuasiStatic(1.0), until=case.steps)
        told.append(np.array([np.ravel(step.resultant()) for step in steps]))
    one, other = told[0], -told[1]
    parts = []
    for c, first in ((1, 0), (0, case.presses)):
        before, after = one[first:, c], other[first:, c]
        parts.append(np.sqrt(((after - before) ** 2).sum() / (before**2).sum()))
    mean = other[case.presses :, 0].mean() / one[case.presses :, 0].mean() - 1
    facets = len(case.upper.surface("bottom")[0].nodes)
    line = (f"| {facets} | {100 * parts[0]:.2f} % | {100 * parts[1]:.2f} % | "
            f"{100 * mean:+.2f} % |")  # fmt: skip
    print(line, flush=True)
    return line


def section(fine, places):
    """Forces (places, 2 slaves, 2 steps) and closed nodes (2, 2) of the first place."""

    def cells(*counts):
        return tuple(round(fine * k) for k in counts)

    force, closed = np.zeros((places, 2, 2)), np.zeros((2, 2), dtype=int)
    for place in range(places):
        slab = am.box((3, 1), cells(15, 4))
        beside = place / places * 3 / cells(15)[0]
        upper = die((0.8, 0.5), cells(5, 3), (0.9 + beside, 1.0))
        model = Case(slab, upper, (1.0, 10.0), 0.05, 0.05, 0.3, 2, 2).model
        for k in range(2):
            steps = am.evolve(model(bool(k)), am.QuasiStatic(1.0), until=2)
            for j, step in enumerate(steps):
                force[place, k, j] = abs(np.ravel(step.resultant())[1])
                if not place:
                    closed[k, j] = (step.solution.r[:, 0] > 0).sum()
    print(fine, force.round(6).tolist(), flush=True)
    return force, closed


def section_rows(asked, places):
    """(forces of the limit (2,), rows of the last table, orders of largest changes (2,))."""
    found = [section(fine, places) for fine in asked]
    limit, lines, fallen = found[-1][0].mean(axis=(0, 1)), [], []
    for fine, (force, closed) in zip(asked, found, strict=True):
        error = 100 * (force / limit - 1)
        mean = error.mean(axis=0)
        spread = np.abs(error - mean).max(axis=0)
        change = 100 * (force[:, 1] / force[:, 0] - 1)
        largest = np.abs(change).max(axis=0)
        fallen.append(largest)
        for j in range(2):
            sides = " | ".join(f"{mean[k, j]:+.2f} +- {spread[k, j]:.2f} %" for k in range(2))
            nodes = f"{closed[0, j]}, {closed[1, j]}"
            lines.append(f"| {round(5 * fine)} | press {j + 1} | {nodes} | {sides} | "
                         f"{largest[j]:.2f} % | {change[:, j].mean():+.2f} % |")
    return limit, lines, -np.polyfit(np.log(asked), np.log(fallen), 1)[0]


def main():
    """Measure and write the page."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--fine", type=float, nargs="+", default=[1, 1.6, 2, 3])
    parser.add_argument("--section", type=float, nargs="+", default=[1, 2, 3, 4, 6, 8])
    parser.add_argument("--block", type=int, nargs="+", default=[1, 2, 4])
    parser.add_argument("--curves", type=int, nargs="+", default=[1, 2])
    parser.add_argument("--places", type=int, default=5)
    asked = parser.parse_args()
    options = "".join(
        f" --{name} {' '.join(f'{v:g}' for v in np.ravel(value))}"
        for name, value in vars(asked).items() if value != parser.get_default(name)
    )  # fmt: skip
    text = HEAD.format(options=options, steps=" | ".join(STEPS))
    text += "\n".join(row(fine) for fine in asked.fine) + "\n"
    text += BLOCK.format(places=asked.places)
    text += "\n".join(block(fine, asked.places) for fine in asked.block) + "\n" + CURVES
    text += "\n".join(curve(fine) for fine in asked.curves) + "\n"
    (first, second), flat, orders = section_rows(asked.section, asked.places)
    text += SECTION.format(places=asked.places, force_1=first, force_2=second)
    text += "\n".join(flat) + "\n" + TOLD.format(*orders)
    (HERE / "results/large_sliding_swap.md").write_text(text)


if __name__ == "__main__":
    main()
