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
from . import block, examples, tables, vee

HERE = Path(__file__).parent
REFERENCE = json.loads((HERE / "reference.json").read_text())
Work = Callable[[Sequence[int], Path], Any]


def _example(name: str) -> Work:
    return lambda levels, out: examples.EXAMPLES[name]()


WORK: dict[str, Work] = {
    **{name: _example(name) for name in examples.EXAMPLES},
    "vee": vee.run,
    "friction": vee.run_friction,
    "block": block.run,
    "block-friction": block.run_friction,
}
PAGES: dict[str, Callable[[Any], list[str]]] = {
    **{
        name: (lambda rows, name=name: tables.example(name, rows)) for name in examples.EXAMPLES
    },
    "vee": lambda found: tables.vee(found, REFERENCE["vee"]),
    "friction": tables.friction,
    "block": block.page,
    "block-friction": block.page_friction,
}
FIGURES = {"vee": ("9", "10"), "friction": ("11",), "block": ("12", "13"),
           "block-friction": ("14",)}  # fmt: skip


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

    PART is example1 … example5, vee, friction, block or block-friction; all of them by default.
    Numbers of other parts stay as they are stored.
    """
    check_parts(parts, tuple(WORK))
    chosen = levels_of(levels, min(vee.LEVELS), max(vee.LEVELS))
    out = results or HERE / "results"
    chosen_parts = parts or tuple(WORK)
    text = regenerate(out, chosen_parts, lambda p: (p, WORK[p](chosen, out)), page)
    if "block" in chosen_parts:
        block.draw_curves(stored(out)["block"], out / "figure12.png")
    click.echo(text)


def page(record: dict[str, Any]) -> str:
    """All tables of what is stored."""
    lines = heading("ligursky2014", record)
    for part, make in PAGES.items():
        if part in record:
            lines += make(record[part])
            lines += [f"![Figure {name}](figure{name}.png)\n" for name in FIGURES.get(part, ())]
    return "\n".join(lines)


if __name__ == "__main__":
    main()
