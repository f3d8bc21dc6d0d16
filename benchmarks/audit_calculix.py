"""`python -m benchmarks.audit_calculix`: what an audit says of decks that CalculiX solves.

Every model is written as a deck, solved by CalculiX, and audited with its own deck, with the
sides exchanged, with half the friction, with displacements 5 % larger, and of another sign.
How far its contact force is from that of our own solution, hard on the curved surfaces, tells
which of them are right.
"""

from __future__ import annotations

import os
import re

os.environ.setdefault("OMP_NUM_THREADS", "1")

import subprocess
import tempfile
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click
import numpy as np

import amontons as am
from amontons.io.decks.written import write_deck
from amontons.mechanics.meshes import second_order

from .machine import describe

E = 210e3
STEEL = am.LinearElastic(E, 0.3)
SURFACE, NODE, MORTAR = "SURFACE TO SURFACE", "NODE TO SURFACE", "MORTAR"
STIFF, SOFT = 100.0, 1.0  # penalty over Young's modulus, per length
LIMIT = 200  # seconds of a run
PAIR = re.compile(r"(\*(?:CONTACT PAIR|TIE)\b.*\n)(\w+), *(\w+)\n")
FRICTION = re.compile(r"(\*FRICTION\n)[^,\n]+")


@dataclass(frozen=True)
class Case:
    """A model, the contact of CalculiX and its penalty over Young's modulus."""

    name: str
    make: Callable[[], am.Model]
    kind: str = SURFACE
    penalty: float = STIFF


def blocks(
    kind: str | None = None, order: int = 1, law: am.LinearElastic = STEEL, dim: int = 3,
    **contact: Any,
) -> am.Model:  # fmt: skip
    """A block pressed on a wider one and dragged, somewhere across its facets."""
    sizes = [(12, 10, 6), (6, 5.5, 5)] if dim == 3 else [(12, 6), (5.5, 4)]
    away = (2.3, 1.7, 6.0) if dim == 3 else (3.1, 6.0)
    cells = [(6, 5, 3), (4, 3, 3)] if dim == 3 else [(24, 12), (9, 7)]
    low = am.box(sizes[0], cells[0], kind)
    high = am.box(sizes[1], cells[1], kind, origin=away)
    if order == 2:
        low, high = (second_order(mesh, serendipity=True) for mesh in (low, high))
    motion = (0.01, 0.0, -0.02) if dim == 3 else (0.008, -0.015)
    pair = am.Contact("high.bottom", master="low.top", **(contact or {"mu": 0.25}))
    bodies = [am.Body(low, law, "low"), am.Body(high, law, "high")]
    return am.Model(bodies, [am.Fix("low.bottom", 0.0), am.Fix("high.top", motion)], [pair])


def shrunk(order: int = 1) -> am.Model:
    """A ring shrunk onto a shaft, around the y axis."""
    shaft = am.box((6, 12), (6, 9), origin=(4, 0))
    hub = am.box((6, 6), (6, 7), origin=(10 - 0.012, 3))
    if order == 2:
        shaft, hub = (second_order(mesh, serendipity=True) for mesh in (shaft, hub))
    bodies = [am.Body(shaft.turned(), STEEL, "shaft"), am.Body(hub.turned(), STEEL, "hub")]
    return am.Model(
        bodies, [am.Fix("shaft.bottom", (None, 0.0)), am.Fix("hub.top", (None, 0.0))],
        [am.Contact("hub.left", master="shaft.right", mu=0.15)],
    )  # fmt: skip


STRESS = am.LinearElastic(E, 0.3, plane="stress")
CASES = (
    Case("C3D8", blocks), Case("C3D8", blocks, NODE), Case("C3D8", blocks, MORTAR),
    Case("C3D8, no friction", lambda: blocks(mu=0.0)),
    Case("C3D8, tied", lambda: blocks(tied=True)),
    Case("C3D8, soft penalty", blocks, SURFACE, SOFT),
    Case("C3D8, soft penalty", blocks, NODE, SOFT),
    Case("C3D4", lambda: blocks("tet")), Case("C3D10", lambda: blocks("tet", 2)),
    Case("C3D20", lambda: blocks(order=2)), Case("CPE4", lambda: blocks(dim=2)),
    Case("CPE4", lambda: blocks(dim=2), NODE), Case("CPE3", lambda: blocks("tri", dim=2)),
    Case("CPE6", lambda: blocks("tri", 2, dim=2)), Case("CPE8", lambda: blocks(None, 2, dim=2)),
    Case("CPS4", lambda: blocks(law=STRESS, dim=2)),
    Case("CAX4, shrunk", shrunk), Case("CAX8, shrunk", lambda: shrunk(2)),
)


def rows(folder: Path) -> Iterator[str]:
    """A row of every case."""
    for number, case in enumerate(CASES):
        at = folder / str(number)
        at.mkdir()
        model = case.make()
        write_deck(model, at / "a.inp", penalty=case.penalty * E)
        text = (at / "a.inp").read_text().replace(SURFACE, case.kind)
        (at / "a.inp").write_text(text)
        try:
            run = subprocess.run(["ccx", "a"], cwd=at, capture_output=True, timeout=LIMIT,
                                 check=False).returncode  # fmt: skip
        except subprocess.TimeoutExpired:
            run = -1
        if run:
            yield f"| {case.name} | {case.kind} | did not run ({run}) |" + " |" * 6
            continue
        yield _row(case, model, at)


def _row(case: Case, model: am.Model, at: Path) -> str:
    found = am.audit(at / "a.inp", at / "a.frd")
    own = next(iter(am.solve(model).pairs.values())).force
    off = float(np.linalg.norm(found.pairs[0].force - own) / np.linalg.norm(own))
    deck, moved = (at / "a.inp").read_text(), list(found.displacement)
    said = [_of_deck(at, PAIR.sub(r"\1\3, \2\n", deck))]
    rough = model.contacts[0].numbers.get("mu", 0.0)
    said.append(_of_deck(at, FRICTION.sub(rf"\g<1>{rough / 2}", deck)) if rough else "")
    said += [am.audit(found.model, [factor * part for part in moved], law="hard").verdict
             for factor in (1.05, -1.0)]  # fmt: skip
    failed = ", ".join(n for n, f in found.findings.items() if f.verdict.value != "right")
    return (f"| {case.name} | {case.kind} | {off:.2%} | {found.verdict} | {failed or 'none'} | "
            + " | ".join(said) + " |")  # fmt: skip


def _of_deck(at: Path, text: str) -> str:
    """What is said of the result with another deck."""
    (at / "b.inp").write_text(text)
    return am.audit(at / "b.inp", at / "a.frd").verdict


@click.command(context_settings={"help_option_names": ["-h", "--help"]})
@click.option("--output", type=click.Path(path_type=Path), help="Write the page here.")
def main(output: Path | None) -> None:
    """Solve with CalculiX, and audit."""
    warnings.simplefilter("ignore", am.DoubtWarning)
    lines = [
        "# Audits of CalculiX", "", "`python -m benchmarks.audit_calculix`", "",
        "; ".join(f"{key} {value}" for key, value in describe().items()), "",
        "Models written as decks, solved by CalculiX, and audited: as they are, with slave and "
        "master exchanged, with half the friction, displacements times 1.05 and times -1. "
        "Off: its contact force against that of our own solution, hard on the curved "
        "surfaces; coarse meshes, on which contact at points and on average differ by some "
        "percent. Shrunk rings are closed by their overlap, of which 5 % are within what is "
        "allowed; CalculiX' flat sector takes friction from that of first order.", "",
        "| elements | contact | off | said | not right | exchanged | mu / 2 | x 1.05 | x -1 |",
        "|" + "---|" * 9,
    ]  # fmt: skip
    with tempfile.TemporaryDirectory() as made:
        for row in rows(Path(made)):
            click.echo(row)
            lines.append(row)
    if output is not None:
        output.write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
