"""`python -m verify`: the command line; see `README.md` for the cases and what they gave."""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import fnmatch
import json
import time
from pathlib import Path

import click

from amontons.core.errors import AmontonsError
from amontons.core.files import replacing
from amontons.core.words import near
from benchmarks.machine import describe

from . import blocks, cylinders, half_spaces, indenters, joints, masonry, parts, rigid, spheres
from .case import Outcome, run
from .page import figure, page, recorded, text_of

HERE = Path(__file__).parent
ROOMS = (half_spaces, spheres, indenters, cylinders, blocks, joints, parts, masonry, rigid)
CASES = {case.name: case for room in ROOMS for case in room.CASES}


@click.command(context_settings={"help_option_names": ["-h", "--help"]})
@click.argument("names", nargs=-1, metavar="[CASE]...")
@click.option(
    "--only",
    multiple=True,
    metavar="NAME",
    help="Another case; * and ? stand for anything, as in 'press-fit*'.",
)
@click.option("--quick", is_flag=True, help="The smallest size alone, with its tolerance.")
@click.option("--fine", is_flag=True, help="Also the larger sizes.")
@click.option("--list", "listed", is_flag=True, help="Name the cases, and compute nothing.")
@click.option(
    "--results", type=click.Path(path_type=Path),
    help="Keep numbers, figures and README.md in this folder.",
)  # fmt: skip
def main(names: tuple[str, ...], only: tuple[str, ...], quick: bool, fine: bool,  # noqa: FBT001
         listed: bool, results: Path | None) -> None:  # noqa: FBT001  # fmt: skip
    """Cases with a known answer, computed again; all of them by default.

    Exits with 0 where all pass, with 1 where a case fails, with 2 for a wrong option.
    --results verify makes the page of the repository again; numbers of other cases stay as they
    are stored.
    """
    if quick and (fine or results is not None):
        raise click.UsageError("--quick: the smallest size alone; it goes with neither --fine "
                               "nor --results, whose page has all sizes")  # fmt: skip
    chosen = _chosen((*names, *only))
    if listed:
        for name in chosen:
            click.echo(f"{name:26}{CASES[name].title}")
        return
    failed, begun = [], time.process_time()
    for name in chosen:
        try:
            outcome = run(CASES[name], fine=fine, quick=quick)
        except (AmontonsError, ArithmeticError, AssertionError) as reason:
            click.echo(f"FAIL  {name}: {type(reason).__name__}: {reason}")
            failed.append(name)
            continue
        click.echo(text_of(outcome))
        if not outcome.passed:
            failed.append(name)
        if results is not None:
            _keep(results, outcome)
    click.echo(f"{len(chosen) - len(failed)} passed, {len(failed)} failed"
               + (f": {', '.join(failed)}" if failed else "")
               + f" ({time.process_time() - begun:.1f} CPU s)")  # fmt: skip
    raise SystemExit(1 if failed else 0)


def _chosen(patterns: tuple[str, ...]) -> list[str]:
    """Names of the cases that match; all of them without a pattern."""
    for pattern in patterns:
        if not fnmatch.filter(CASES, pattern):
            meant = near(pattern, CASES)
            hint = f"did you mean {meant!r}? " if meant else ""
            raise click.UsageError(f"CASE: {pattern!r} is none; {hint}--list names them")
    return [name for name in CASES
            if not patterns or any(fnmatch.fnmatchcase(name, p) for p in patterns)]  # fmt: skip


def _keep(folder: Path, outcome: Outcome) -> None:
    """Store the numbers and the figure of a case, and write the page of all that are stored."""
    pictures = folder / "results"
    pictures.mkdir(parents=True, exist_ok=True)
    target = pictures / "results.json"
    record = json.loads(target.read_text()) if target.exists() else {}
    record["machine"] = describe()
    record[outcome.case.name] = recorded(outcome)
    with replacing(target) as path:
        path.write_text(json.dumps(record) + "\n")
    figure(outcome, pictures / f"{outcome.case.name}.png")
    with replacing(folder / "README.md") as path:
        path.write_text(page(CASES, record))


if __name__ == "__main__":
    main()
