"""`python -m reproduce.ligursky2014`: the command line; see `README.md` for what it found."""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import click

from ..record import check_parts, heading, levels_of, regenerate, stored
from . import (
    block,
    claims,
    convergence,
    disc,
    examples,
    figure2,
    rates,
    stress,
    tables,
    time_steps,
    vee,
    vee_curves,
)

HERE = Path(__file__).parent
REFERENCE = json.loads((HERE / "reference.json").read_text())
Work = Callable[[Sequence[int], Path], Any]


def _example(name: str) -> Work:
    return lambda levels, out: examples.EXAMPLES[name]()


WORK: dict[str, Work] = {
    **{name: _example(name) for name in examples.EXAMPLES},
    "example5-model": disc.run,
    "figure2": figure2.run,
    "vee": vee.run,
    "vee-curves": vee_curves.run,
    "friction": vee.run_friction,
    "friction-curves": vee_curves.run_friction,
    "first-order": lambda levels, out: rates.rows(),
    "stress": lambda levels, out: stress.rows(),
    "block": block.run,
    "block-paper": block.run_theirs,
    "block-friction": block.run_friction,
    "time-steps": time_steps.run,
}
PAGES: dict[str, Callable[[Any], list[str]]] = {
    **{
        name: (lambda rows, name=name: tables.example(name, rows)) for name in examples.EXAMPLES
    },
    "example5-model": lambda rows: ["## Example 5 as a model", "", *tables.table(rows)],
    "figure2": lambda rows: ["## Null directions (figure 2)", "", *tables.table(rows)],
    "vee": lambda found: tables.vee(found, REFERENCE["vee"]),
    "vee-curves": lambda found: convergence.page(
        "figure 9", convergence.vee_rows(found), convergence.vee_claims(found)
    ),
    "friction": tables.friction,
    "friction-curves": vee_curves.page_friction,
    "first-order": lambda rows: ["## First-order systems (section 3.1.1)", "",
                                 *tables.table(rows)],
    "stress": lambda rows: ["## Stress of the block (section 3.2.2)", "", *tables.table(rows)],
    "block": lambda found: block.page(found, REFERENCE.get("block", {})),
    "block-friction": block.page_friction,
    "time-steps": time_steps.page,
}
FIGURES = {"figure2": ("2",), "vee-curves": ("9", "10"), "friction-curves": ("11",),
           "block": ("12", "13"), "block-friction": ("14",)}  # fmt: skip
DRAWN = {  # from all levels that are stored
    "block": ("figure12.png", block.draw_curves),
    "block-friction": ("figure14.png", block.draw_friction),
}


@click.command(context_settings={"help_option_names": ["-h", "--help"]})
@click.argument("parts", nargs=-1, metavar="[PART]...")
@click.option("--levels", default="0,1,2,3", show_default=True,
              help="Refinements of the meshes: 1, 2, 3 are those of the paper, 0 is for the "
                   "V-shaped body.")  # fmt: skip
@click.option(
    "--results", type=click.Path(path_type=Path), help="For tables and figures. [results/]"
)
def main(parts: tuple[str, ...], levels: str, results: Path | None) -> None:
    """Continuation through folds, as in the paper of 2014.

    PART is example1 … example5, example5-model, figure2, first-order, vee, vee-curves,
    friction, friction-curves, stress, block, block-paper, block-friction or time-steps; all of
    them by default.  Numbers of other parts stay as they are stored.
    """
    check_parts(parts, tuple(WORK))
    chosen = levels_of(levels, min(vee.LEVELS), max(vee.LEVELS))
    out = results or HERE / "results"
    chosen_parts = parts or tuple(WORK)
    text = regenerate(out, chosen_parts, lambda p: (p, WORK[p](chosen, out)), page)
    found = stored(out)
    for part, (name, draw) in DRAWN.items():
        if part in found and any(one.startswith(part) for one in chosen_parts):
            draw(_with_theirs(found) if part == "block" else found[part], out / name)
    click.echo(text)


def page(record: dict[str, Any]) -> str:
    """All tables of what is stored."""
    lines = heading("ligursky2014", record)
    held = claims.collected(record)
    lines[2:2] = [claims.line(held), ""]
    for part, make in PAGES.items():
        if part in record:
            lines += make(_with_theirs(record) if part == "block" else record[part])
            lines += [f"![Figure {name}](figure{name}.png)\n" for name in FIGURES.get(part, ())]
    lines += ["## All statements", "", *tables.table(held)]
    return "\n".join(lines)


def _with_theirs(record: dict[str, Any]) -> dict[str, Any]:
    """The runs on the block with those by the algorithms of the paper among them."""
    out, by_theirs = {}, record.get("block-paper", {})
    for squares, found in record["block"].items():
        one = dict(found)
        if squares in by_theirs:
            theirs = by_theirs[squares]
            one["runs"] = {**one.get("runs", {}), block.THEIRS: theirs}
            one["curve"] = theirs["curve"]
        out[squares] = one
    return out


if __name__ == "__main__":
    main()
