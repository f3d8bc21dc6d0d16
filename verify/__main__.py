"""`python -m verify`: the command line; see `README.md` for the cases and what they gave."""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import json
from pathlib import Path

import click

from amontons.core.errors import AmontonsError
from amontons.core.files import replacing
from benchmarks.machine import describe

from . import blocks, cylinders, half_spaces, joints
from .case import Outcome, run
from .page import figure, page, recorded, text_of

HERE = Path(__file__).parent
ROOMS = (half_spaces, cylinders, blocks, joints)
CASES = {case.name: case for room in ROOMS for case in room.CASES}


@click.command(context_settings={"help_option_names": ["-h", "--help"]})
@click.argument("names", nargs=-1, metavar="[CASE]...")
@click.option("--fine", is_flag=True, help="Also the larger sizes.")
@click.option("--list", "listed", is_flag=True, help="Name the cases, and compute nothing.")
@click.option(
    "--results", type=click.Path(path_type=Path),
    help="Keep numbers, figures and README.md in this folder.",
)  # fmt: skip
def main(names: tuple[str, ...], fine: bool, listed: bool, results: Path | None) -> None:  # noqa: FBT001
    """Cases with a known answer, computed again; all of them by default.

    Exits with 1 where a case fails.  --results verify makes the page of the repository again;
    numbers of other cases stay as they are stored.
    """
    for name in names:
        if name not in CASES:
            raise click.UsageError(f"CASE: {name!r} is none of {', '.join(CASES)}")
    if listed:
        for case in CASES.values():
            click.echo(f"{case.name:24}{case.title}")
        return
    failed = []
    for name in names or CASES:
        try:
            outcome = run(CASES[name], fine=fine)
        except AmontonsError as reason:
            click.echo(f"FAIL  {name}: {reason}")
            failed.append(name)
            continue
        click.echo(text_of(outcome))
        if not outcome.passed:
            failed.append(name)
        if results is not None:
            _keep(results, outcome)
    click.echo(f"{len(names or CASES) - len(failed)} passed, {len(failed)} failed"
               + (f": {', '.join(failed)}" if failed else ""))  # fmt: skip
    raise SystemExit(1 if failed else 0)


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
