"""Shear tractions of two spheres pressed, pushed and drawn back, against the closed form.

    python -m benchmarks.cattaneo_mindlin [--only "mortar, 18 : 14"] [--missing]

The model of `verify.spheres` with cells that grow with depth: two half spaces whose gap is that
of two spheres, nu = 0.  Errors of the nodal tractions (force over area) are root mean squares
over the contact, in parts of mu p0: against the closed form at the node, and against its mean
over the square that belongs to the node.  `exact forces` is what the forces of the closed form
itself, over the areas, differ from it at the nodes: its roots at the edges of the zones leave
an error of the order of the mesh width to any nodal traction.

Rows are added to results/cattaneo_mindlin.json; results/cattaneo_mindlin.md is written of all.
"""

import argparse
import json
import sys
import time
from pathlib import Path

import numpy as np
from scipy.optimize import brentq

sys.path.insert(0, str(Path(__file__).parent))

from machine import describe
from mortar_models import graded

import amontons as am

HERE = Path(__file__).parent / "results"
YOUNG, MU, RADIUS = 1000.0, 0.3, 100.0
SIDE, ZONE, REST, GROWTH = 15.0, 1.25, 6, 1.3
RUNS = {  # name: cells of slave and master in the zone, order, method
    f"{kind}{method}, {mine} : {theirs}": (mine, theirs, order, method)
    for kind, method, order, pairs in (
        ("", "mortar", 1, ((6, 6), (9, 9), (13, 13), (18, 18))),
        ("", "nodal", 1, ((6, 6), (9, 9), (13, 13), (18, 18))),
        ("", "mortar", 1, ((6, 5), (9, 7), (13, 10), (18, 14), (7, 9), (10, 13), (14, 18))),
        ("second order, ", "mortar", 2, ((4, 4), (6, 6), (6, 5))),
    )
    for mine, theirs in pairs
}


def block(cells, up):
    """A half of a block beside z = 0, y > 0, with equal cells in the zone."""
    fine = ZONE / cells
    deep = int(np.ceil(np.log1p(SIDE / fine * (GROWTH - 1)) / np.log(GROWTH)))
    growth = brentq(lambda g: fine * (g**deep - 1) / (g - 1) - SIDE, 1 + 1e-6, 3)
    across = cells + REST
    box = am.box((1, 1, 1), (2 * across, across, deep))
    x = np.column_stack([2 * box.points[:, 0] - 1, box.points[:, 1],
                         box.points[:, 2] - (up < 0)])  # fmt: skip
    steps = [graded(np.abs(x[:, c]), ZONE / SIDE, across, cells) for c in range(2)]
    heights = np.concatenate([[0], np.cumsum(fine * growth ** np.arange(deep))]) / SIDE
    steps.append(np.interp(np.abs(x[:, 2]), np.linspace(0, 1, deep + 1), heights))
    return am.Mesh(SIDE * np.sign(x) * np.column_stack(steps), box.cells, box.surfaces)


def model(mine, theirs, order, method):
    """Pressed until t = 1, pushed until 2, and drawn back until 3."""
    law, depth = am.LinearElastic(YOUNG, 0.0), 1 / RADIUS
    bodies = [am.Body(block(mine, 1), law, "upper", order=order),
              am.Body(block(theirs, -1), law, "lower", order=order)]  # fmt: skip
    top = (lambda x, t: 0.7 * MU * depth * max(0.0, 1 - abs(t - 2)), 0,
           lambda x, t: -1.1 * depth * min(t, 1.0))  # fmt: skip
    sides = [am.Fix(f"{body}.front", (None, 0, None)) for body in ("upper", "lower")]
    return am.Model(
        bodies, [am.Fix("upper.top", top), am.Fix("lower.bottom", 0), *sides],
        [am.Contact("upper.bottom", master="lower.top", mu=MU, method=method,
                    clearance=lambda p: (p[:, 0] ** 2 + p[:, 1] ** 2) / (2 * RADIUS))],
    )  # fmt: skip


def zones_of(fields, before):
    """(a, mu p0, share Q / (mu P), [(radius, factor)]) of Johnson (1985), 7.2 and 7.4."""
    load = 2 * abs(fields.force[:, 2].sum())
    share = -2 * fields.force[:, 0].sum() / (MU * load)
    a = (1.5 * load * RADIUS / YOUNG) ** (1 / 3)
    first = a * np.cbrt(1 - (share if before is None else before))
    zones = [(a, 1.0), (first, -1.0)]
    if before is not None:
        zones = [(a, -1.0), (first, -1.0), (a * np.cbrt(1 - (before - share) / 2), 2.0)]
    return a, MU * 1.5 * load / (np.pi * a**2), share, zones


def errors(fields, before, width):
    """(share, h / a, errors at nodes, of means, of exact forces)."""
    a, peak, share, zones = zones_of(fields, before)
    near = np.linalg.norm(fields.points[:, :2], axis=1) < 1.4 * a
    points, weights = fields.points[near, :2], fields.weights[near]
    found = -fields.force[near, 0] / weights / peak
    at = (np.arange(16) + 0.5) / 16 - 0.5
    hat = np.outer(1 - np.abs(2 * at), 1 - np.abs(2 * at))

    def over(size, share_of):
        inside = size * np.stack(np.meshgrid(at, at, indexing="ij"), axis=-1)
        r = np.linalg.norm(points[:, None, None] + inside, axis=3)
        whole = sum(s * b / a * np.sqrt(np.maximum(1 - (r / b) ** 2, 0)) for b, s in zones)
        return (whole * share_of).sum(axis=(1, 2)) / share_of.sum()

    def rms(error):
        return float(np.sqrt(weights @ error**2 / (np.pi * a**2 / 2)))

    r = np.linalg.norm(points, axis=1)
    exact = sum(s * b / a * np.sqrt(np.maximum(1 - (r / b) ** 2, 0)) for b, s in zones)
    means = over(width, np.ones(hat.shape))
    return share, width / a, rms(found - exact), rms(found - means), rms(
        over(2 * width, hat) - exact)  # fmt: skip


def run(name):
    """The row of a run: seconds, and per stage what `errors` says."""
    mine, theirs, order, method = RUNS[name]
    began, before, stages = time.process_time(), None, []
    steps = am.evolve(model(mine, theirs, order, method), am.QuasiStatic(step=1.0), until=3.0,
                      tolerance=1e-9)  # fmt: skip
    for number, step in enumerate(steps):
        told = errors(step.fields, before, ZONE / mine)
        if number:
            before = told[0]
            stages.append(told)
    return {"name": name, "seconds": time.process_time() - began, "stages": stages}


def family(name):
    """Runs whose orders are told together: all but the numbers, and who is finer."""
    mine, theirs, order, method = RUNS[name]
    finer = "alike" if mine == theirs else "finer slave" if mine > theirs else "finer master"
    return f"{'second order, ' if order == 2 else ''}{method}, {finer}"


def page(rows):
    """Lines of the page."""
    rows = sorted(rows, key=lambda row: list(RUNS).index(row["name"]))
    head = ["cells", "h / a", "pushed: at nodes", "means", "exact forces",
            "drawn back: at nodes", "means", "exact forces", "order", "CPU s"]  # fmt: skip
    lines = [head, ["---"] * len(head)]
    last = {}
    for row in rows:
        one, two = row["stages"]
        before, order = last.get(family(row["name"])), ""
        if before is not None:
            steps = np.log(np.array(before[1][1]) / two[1])
            order = ", ".join(f"{np.log(b[2] / n[2]) / steps:.1f}" for b, n in
                              zip(before, row["stages"], strict=True))  # fmt: skip
        last[family(row["name"])] = row["stages"]
        told = [f"{100 * value:.1f}" for stage in (one, two) for value in stage[2:]]
        lines.append([row["name"], f"{one[1]:.3f}", *told, order, f"{row['seconds']:.0f}"])
    return [f"| {' | '.join(line)} |" for line in lines]


def keep(doc, runs, run, page, head):
    """Run what the command line asks for, add it to what is stored, write the page of all.

    doc: of the program, results/NAME.json, .md and _notes.txt by its name; runs: names; head:
    title, and lines above the table.
    """
    name = Path(sys.argv[0]).stem
    parser = argparse.ArgumentParser(description=doc)
    parser.add_argument("--only", action="append", default=[])
    parser.add_argument("--missing", action="store_true", help="leave out what is stored")
    asked = parser.parse_args()
    stored = HERE / f"{name}.json"
    rows = json.loads(stored.read_text()) if stored.exists() else []
    for one in runs:
        there = any(row["name"] == one for row in rows)
        if (asked.only and one not in asked.only) or (asked.missing and there):
            continue
        rows = [row for row in rows if row["name"] != one] + [run(one)]
        print(rows[-1], flush=True)
        stored.write_text(json.dumps(rows) + "\n")
    notes = HERE / f"{name}_notes.txt"
    machine = "; ".join(f"{k} {v}" for k, v in describe().items())
    title, *words = head
    text = [f"# {title}", "", f"`python -m benchmarks.{name}`", "", machine, "", *words, "",
            *page(rows), ""]  # fmt: skip
    (HERE / f"{name}.md").write_text(
        "\n".join(text) + ("\n" + notes.read_text() if notes.exists() else "")
    )


def main():
    """Run what is asked for and write the page."""
    keep(__doc__, RUNS, run, page, [
        "Two spheres, pushed and drawn back",
        "Errors of the shear in percent of mu p0 and their orders in h (at nodes).",
    ])  # fmt: skip


if __name__ == "__main__":
    main()
