"""What changes when slave and master change places, over the mesh: ironing in 3D.

    python benchmarks/large_sliding_swap.py [--ironing 1 2] [--space 1 1.6 2] [--block 1 2 4]
                                            [--curves 1 2] [--section 1 2 3 4 6 8]

Whole curves of ironing in 3D of `large_sliding`; the case of `large_sliding_growth`: pressed in
by two load steps, dragged by two; a block that ends within facets of the slab; whole curves of
the ironing in 2D of `large_sliding`; and the section in plane strain of the second, pressed
alike, on meshes that space does not allow, with the die at several places within a cell of the
slab.  Numbers: times as many cells.  Forces are kept in results/large_sliding_swap.json;
results/large_sliding_swap.md is written of all that are there.
"""

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import argparse
import json
from pathlib import Path

import numpy as np
from large_sliding_growth import ironing
from large_sliding_models import Case, die, ironing_in_space, shallow

import amontons as am

HERE = Path(__file__).parent
HEAD = """# Slave and master change places

Regenerate: `python benchmarks/large_sliding_swap.py`.

## Ironing in 3D

The mesh of `large_sliding` and finer ones, 8 load steps pressed and 20 dragged, friction 0.3:
root mean square of what the slave changes over that of the force, of all load steps of the
normal force and of the horizontal one while it is dragged; and what the mean changes.

| cells along the die | normal | horizontal | normal, mean | horizontal, mean |
|---|---|---|---|---|
"""
SPACE = """
## Four load steps

A die pressed by 0.05 into a slab in two load steps, then dragged by 0.05 in two more, in 3D:
normal force after the first with the die's side as the slave, and changes, when the slab's
side is the slave instead, of the normal force, and of the horizontal one while it is dragged.

| cells | contacts | force, press 1 | {steps} |
|---|---|---|---|---|---|---|---|---|
"""
BLOCK = """
## A side that ends within facets

A block of 1 x 0.5, ten times as stiff, is pressed by 0.02 into a slab of 3 x 1 in 2D, friction
0.3, with its ends at several places within a cell of the slab: normal force with either side
as the slave, mean over the places and the largest less the smallest of them; and the change by
the slave: of the mean, root mean square over the places, and the largest.  Cells: of the slab
beside the block.

| cells | block's side | over places | slab's side | over places | of the mean | rms | largest |
|---|---|---|---|---|---|---|---|
"""
CURVES = """
The ends of a block are singular points, and all forces come down to one limit at first order.
With the slab's side as the slave its last node lies outside: its law fades (`contact.fading`),
and up to which part of it tells how wide the block acts.

## Curves in 2D

Ironing in 2D, the shallow case of `large_sliding`, all load steps, told as in 3D.

| facets across the die | normal | horizontal | normal, mean | horizontal, mean |
|---|---|---|---|---|
"""
SECTION = """
## The section of the die

Both bodies of the four load steps in 2D, plane strain, pressed by the first two, with the die
at several places within a cell of the slab's surface: normal force with either side as the
slave over that of the finest mesh, {0:.5f} and {1:.5f} (mean of all of it): mean error, and
the largest departure of a place from that mean; closed nodes of the slave across the strip of
contact, of the first place, the die's and the slab's; and the largest change by the slave, and
the mean one.

| cells | step | closed | die's side | slab's side | change by the slave, largest | mean |
|---|---|---|---|---|---|---|
"""
TOLD = """
The largest changes fall as the length of cells to the power of {0:.1f} and {1:.1f} (least
squares).

The error is one of the mesh, of both ways: each node stands for a part of the strip of contact
as long as a facet, and forces scatter as its edge falls between other nodes.  With two to five
nodes in contact the scatter is as large as the changes by the slave, which have either sign.
Normals of the slave are those of what faces the master, and where a facet goes on beyond the
master's end those of the master, as far as it does (`contact.faced_normals`): the chord from
below a rim that is pressed in to what rises beside it tilts the forces by an angle that no
mesh makes smaller. With its normals the horizontal forces of the first table had .94 and .84 %.
"""
PLACES = 5
STEPS = ("press 1", "press 2", "drag 1", "drag 2", "horizontal 1", "horizontal 2")


def forces(fine, swap):
    """(contacts, force on the die after every load step (4, 3))."""
    out = []
    for step in am.evolve(ironing(fine).model(swap), am.QuasiStatic(1.0), until=4):
        out.append(np.ravel(step.resultant()))
    return len(step.solution.r), np.array(out) * (-1 if swap else 1)


def space(fine):
    """Forces of the four load steps, either side the slave."""
    (contacts, one), (_, other) = (forces(fine, swap) for swap in (False, True))
    return {"contacts": contacts, "one": one.tolist(), "other": other.tolist()}


def space_row(fine, found):
    """A row of the second table."""
    one, other = np.array(found["one"]), np.array(found["other"])
    changes = other / one - 1
    told = [*changes[:, 2], *changes[2:, 0]]
    cells = " | ".join(f"{100 * change:+.2f} %" for change in told)
    return f"| {round(5 * fine)} | {found['contacts']} | {abs(one[0, 2]):.5f} | {cells} |"


def block(fine):
    """Normal forces (places, 2 slaves) on a block."""
    force = np.zeros((PLACES, 2))
    for place in range(PLACES):
        slab = am.box((3, 1), (round(15 * fine), round(5 * fine)))
        upper = am.box((1, 0.5), (round(6 * fine), round(3 * fine)),
                       origin=(0.9 + place / PLACES * 0.2 / fine, 1.0))  # fmt: skip
        case = Case(slab, upper, (1.0, 10.0), 0.02, 0.0, 0.3, 1, 0)
        for k in range(2):
            (step,) = am.evolve(case.model(bool(k)), am.QuasiStatic(1.0), until=1)
            force[place, k] = abs(np.ravel(step.resultant())[1])
    return force.tolist()


def block_row(fine, found):
    """A row of the third table."""
    force = np.array(found)
    mean = force.mean(axis=0)
    spread = 100 * np.ptp(force, axis=0) / mean
    change = 100 * (force[:, 1] / force[:, 0] - 1)
    sides = " | ".join(f"{mean[k]:.5f} | {spread[k]:.2f} %" for k in range(2))
    of_mean, rms = 100 * (mean[1] / mean[0] - 1), np.sqrt((change**2).mean())
    largest = np.abs(change).max()
    return f"| {round(5 * fine)} | {sides} | {of_mean:+.2f} % | {rms:.2f} % | {largest:.2f} % |"


def curves(case):
    """Forces after all load steps, either side the slave, and facets across the die."""
    told = []
    for swap in (False, True):
        steps = am.evolve(case.model(swap), am.QuasiStatic(1.0), until=case.steps)
        told.append(np.array([np.ravel(step.resultant()) for step in steps]))
    x = case.upper.points[case.upper.surface("bottom")[0].nodes][..., 0]
    return {"one": told[0].tolist(), "other": (-told[1]).tolist(), "presses": case.presses,
            "facets": len(np.unique(x.mean(axis=1).round(9)))}  # fmt: skip


def curves_row(found):
    """A row of the first and the fourth table."""
    one, other = np.array(found["one"]), np.array(found["other"])
    told = []
    for c, first in ((-1, 0), (0, found["presses"])):
        before, after = one[first:, c], other[first:, c]
        told.append((np.sqrt(((after - before) ** 2).sum() / (before**2).sum()),
                     after.mean() / before.mean() - 1))  # fmt: skip
    parts = [f"{100 * rms:.2f} %" for rms, _ in told]
    parts += [f"{100 * mean:+.2f} %" for _, mean in told]
    return f"| {found['facets']} | {' | '.join(parts)} |"


def section(fine):
    """Forces (places, 2 slaves, 2 steps) and closed nodes (2, 2) of the first place."""

    def cells(*counts):
        return tuple(round(fine * k) for k in counts)

    force, closed = np.zeros((PLACES, 2, 2)), np.zeros((2, 2), dtype=int)
    for place in range(PLACES):
        slab = am.box((3, 1), cells(15, 4))
        beside = place / PLACES * 3 / cells(15)[0]
        upper = die((0.8, 0.5), cells(5, 3), (0.9 + beside, 1.0))
        model = Case(slab, upper, (1.0, 10.0), 0.05, 0.05, 0.3, 2, 2).model
        for k in range(2):
            steps = am.evolve(model(bool(k)), am.QuasiStatic(1.0), until=2)
            for j, step in enumerate(steps):
                force[place, k, j] = abs(np.ravel(step.resultant())[1])
                if not place:
                    closed[k, j] = (step.solution.r[:, 0] > 0).sum()
    return {"force": force.tolist(), "closed": closed.tolist()}


def section_rows(found):
    """The last table, of forces by fine, with the text around it."""
    asked = sorted(found)
    limit = np.array(found[asked[-1]]["force"]).mean(axis=(0, 1))
    lines, fallen = [], []
    for fine in asked:
        force, closed = (np.array(found[fine][name]) for name in ("force", "closed"))
        error = 100 * (force / limit - 1)
        mean = error.mean(axis=0)
        spread = np.abs(error - mean).max(axis=0)
        change = 100 * (force[:, 1] / force[:, 0] - 1)
        largest = np.abs(change).max(axis=0)
        fallen.append(largest)
        for j in range(2):
            sides = " | ".join(f"{mean[k, j]:+.2f} +- {spread[k, j]:.2f} %" for k in range(2))
            nodes = f"{closed[0, j]}, {closed[1, j]}"
            lines.append(
                f"| {round(5 * fine)} | press {j + 1} | {nodes} | {sides} | "
                f"{largest[j]:.2f} % | {change[:, j].mean():+.2f} % |"
            )
    orders = -np.polyfit(np.log(asked), np.log(fallen), 1)[0]
    return SECTION.format(*limit) + "\n".join(lines) + "\n" + TOLD.format(*orders)


MEASURED = {
    "ironing": (lambda fine: curves(ironing_in_space(round(fine))), [1, 2]),
    "space": (space, [1, 1.6, 2]),
    "block": (block, [1, 2, 4]),
    "curves": (lambda fine: curves(shallow(round(fine))), [1, 2]),
    "section": (section, [1, 2, 3, 4, 6, 8]),
}


def written(found):
    """The page of all that is kept, by part and fine."""
    kept = {part: {float(fine): found[part][fine] for fine in sorted(found[part], key=float)}
            for part in found}  # fmt: skip
    heads = {"ironing": HEAD, "space": SPACE.format(steps=" | ".join(STEPS)), "block": BLOCK,
             "curves": CURVES}  # fmt: skip
    rows = {"ironing": lambda _, one: curves_row(one), "space": space_row, "block": block_row,
            "curves": lambda _, one: curves_row(one)}  # fmt: skip
    text = ""
    for part, head in heads.items():
        lines = [rows[part](fine, one) for fine, one in kept.get(part, {}).items()]
        text += head + "".join(line + "\n" for line in lines)
    if len(kept.get("section", {})) > 1:
        text += section_rows(kept["section"])
    (HERE / "results/large_sliding_swap.md").write_text(text)


def main():
    """Measure what is asked for, keep it, and write the page."""
    parser = argparse.ArgumentParser()
    for part, (_, fines) in MEASURED.items():
        parser.add_argument(f"--{part}", type=float, nargs="*", default=fines)
    asked = vars(parser.parse_args())
    stored = HERE / "results/large_sliding_swap.json"
    found = json.loads(stored.read_text()) if stored.exists() else {}
    for part, (measure, _) in MEASURED.items():
        for fine in asked[part]:
            found.setdefault(part, {})[f"{fine:g}"] = measure(fine)
            stored.write_text(json.dumps(found, indent=1) + "\n")
            print(part, fine, flush=True)
    written(found)


if __name__ == "__main__":
    main()
