"""What changes when slave and master change places, over the mesh: ironing in 3D.

    python benchmarks/large_sliding_swap.py [--fine 1 1.5 2]

The case of `large_sliding_growth`: pressed in by two load steps, dragged by two.  Writes
results/large_sliding_swap.md beside this file.
"""

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import argparse
from pathlib import Path

import numpy as np
from large_sliding_growth import ironing

import amontons as am

HERE = Path(__file__).parent
HEAD = """# Slave and master change places

Regenerate: `python benchmarks/large_sliding_swap.py`.

A die pressed by 0.05 into a slab in two load steps, then dragged by 0.05 in two more, in 3D,
friction 0.3: changes of the normal force when the slab's side is the slave instead of the
die's, and of the horizontal force while it is dragged.  Cells: along the die.

| cells | contacts | {steps} |
|---|---|---|---|---|---|---|---|
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
    line = f"| {round(5 * fine)} | {contacts} | {cells} |"
    print(line, flush=True)
    return line


def main():
    """Measure and write the page."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--fine", type=float, nargs="+", default=[1, 1.5, 2])
    rows = [row(fine) for fine in parser.parse_args().fine]
    text = HEAD.format(steps=" | ".join(STEPS)) + "\n".join(rows) + "\n"
    (HERE / "results/large_sliding_swap.md").write_text(text)


if __name__ == "__main__":
    main()
