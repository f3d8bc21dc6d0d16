"""`python -m reproduce.acary2017`: the command line; see `README.md` for what it found."""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")  # one thread, as the tables say
os.environ.setdefault("RAYON_NUM_THREADS", "1")

import shutil
from collections.abc import Sequence
from pathlib import Path

import click

from amontons.core.errors import AmontonsError
from benchmarks.machine import describe

from . import report, rigid, wall
from .methods import FCLIB, FINE, NAMES, VARIANTS, WALL

PARTS = ("problems", "wall", "variants", "fine", "fclib", "siconos", "rigid", "step",
         "pictures", "report")  # fmt: skip
HERE = Path(__file__).parent
EPILOG = f"""\b
Parts, in their order (--only A,B takes some of them):
  problems  simulate the walls and write their problems into the working folder
  wall      the methods of the paper and ours on the 50 problems of the wall
  variants  line search, other functions, more accurate contacts, Jacobi, on 5 of them
  fine      some methods on 2 problems of a finer wall
  fclib     the methods on the FCLib files, ours and those of Siconos
  siconos   the methods of the paper in Siconos on 5 problems
  rigid     the wall of rigid and of elastic blocks: rank of H, and the order of Newton
  step      one warm-started time step against every solver of Siconos
  pictures  the cracking joints, a film of them, the energy balance
  report    tables and figures from the stored runs; always done at the end

\b
Examples:
  python -m reproduce.acary2017 --quick              a tiny wall, some minutes
  python -m reproduce.acary2017                      all of it, some five hours on one core
  python -m reproduce.acary2017 --missing            go on where it was stopped
  python -m reproduce.acary2017 --only wall,fclib --methods Auto
                                                     measure one column again
  python -m reproduce.acary2017 --only step --methods "Auto,Auto global"
                                                     the same against the quickest of Siconos
  python -m reproduce.acary2017 --only report        tables and figures only

\b
Methods: {", ".join(NAMES[:6])},
  {", ".join(NAMES[6:10])},
  {", ".join(NAMES[10:])}.
"""


def _words(text: str | None, known: Sequence[str], option: str) -> list[str]:
    """The words of an option, all of them if there is none; refuses unknown ones."""
    if text is None:
        return list(known)
    words = [word.strip() for word in text.split(",") if word.strip()]
    for word in words:
        if word not in known:
            raise click.UsageError(f"{option}: {word!r} is none of {', '.join(known)}")
    return words


@click.command(
    epilog=EPILOG,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 96},
)
@click.option("--quick", is_flag=True, help="A tiny wall with 3 problems, into FOLDER/quick.")
@click.option("--folder", type=click.Path(path_type=Path), default=Path("acary2017-results"),
              show_default=True, help="For problems (120 MB) and pictures.")  # fmt: skip
@click.option(
    "--results", type=click.Path(path_type=Path), help="For tables and figures. [results/]"
)
@click.option("--only", metavar="A,B", help="Parts to do. [all]")
@click.option(
    "--methods", metavar="A,B", help="Methods to run; the others keep their stored runs."
)
@click.option("--limit", type=float, default=60.0, show_default=True, metavar="SECONDS",
              help="Of processor time for one solve of the wall, the same for all methods; "
              "a thirtieth of it for an FCLib file, twice as much on the finer wall."
              )  # fmt: skip
@click.option("--missing", is_flag=True,
              help="Measure only what is not stored yet with this limit.")  # fmt: skip
@click.option("--shared", type=click.Path(path_type=Path), metavar="DIR",
              help="Folder with data/fclib. [$AMONTONS_SHARED or ../shared]")  # fmt: skip
@click.option("--siconos", default="/usr/bin/python3", show_default=True, metavar="PYTHON",
              help="Python that has Siconos; else no parts siconos and step.")  # fmt: skip
def main(
    quick: bool, folder: Path, results: Path | None, only: str | None, methods: str | None,
    limit: float, missing: bool, shared: Path | None, siconos: str,
) -> None:  # fmt: skip
    """Newton against Gauss-Seidel on a wall of elastic blocks, as in the paper of CSMA 2017.

    Simulates the wall, solves 50 of its time steps with every method of the paper and ours,
    draws the performance profiles and puts the paper's claims beside what was measured.
    """
    parts = _words(only, PARTS, "--only")
    names = _words(methods, NAMES, "--methods")
    if not limit > 0:
        raise click.UsageError(f"--limit: expected seconds > 0, got {limit}")
    place = folder / "quick" if quick else folder
    out = results or (place / "results" if quick else HERE / "results")
    data = (shared or Path(os.environ.get("AMONTONS_SHARED", "../shared"))) / "data" / "fclib"
    try:
        _do(parts, names, limit, quick, place, out, data, siconos, missing)
    except AmontonsError as reason:
        raise click.ClickException(str(reason)) from reason


def _do(
    parts: list[str], names: list[str], limit: float, quick: bool, folder: Path, out: Path,
    data: Path, siconos: str, missing: bool,
) -> None:  # fmt: skip
    """The parts in their order; each stores what it found before the next one starts."""
    main_series, fine = (wall.QUICK, None) if quick else (wall.PAPER, wall.FINE)
    problems = folder / "problems"
    machine = describe()
    if {"problems", "wall", "variants", "siconos"} & set(parts):
        paths = wall.write_problems(main_series, problems, click.echo)
        report.keep_series(out, main_series, problems)
        if "wall" in parts:
            chosen = [name for name in names if name in WALL]
            report.measure(out, "wall", paths, chosen, limit, machine, missing)
        if "variants" in parts:
            chosen = [name for name in names if name in VARIANTS]
            report.measure(out, "variants", report.some(paths), chosen, limit, machine, missing)
        if "siconos" in parts and shutil.which(siconos):
            report.within_siconos(
                out, "wall", report.some(paths), siconos, limit, machine, missing
            )
    if fine is not None and {"problems", "fine", "step"} & set(parts):
        paths = wall.write_problems(fine, problems, click.echo)
        if "fine" in parts:
            chosen = [name for name in names if name in FINE]
            report.measure(out, "fine", paths, chosen, 2 * limit, machine, missing)
    if "fclib" in parts and not quick:
        paths = sorted(data.glob("*.hdf5"), key=lambda path: path.stat().st_size)
        if paths:
            chosen = [name for name in names if name in FCLIB]
            report.measure(out, "fclib", paths, chosen, limit / 30, machine, missing)
            if shutil.which(siconos):
                report.within_siconos(
                    out, "fclib", paths, siconos, limit / 30, machine, missing
                )
        else:
            click.echo(f"fclib: no files in {data}; name its folder with --shared")
    if "rigid" in parts:
        rigid.measure(out, machine, rigid.QUICK if quick else rigid.KINDS, click.echo)
    if "step" in parts:
        if shutil.which(siconos):
            again = None if set(names) == set(NAMES) else names
            report.against_siconos(
                out, main_series, fine, problems, siconos, limit, machine, again
            )
        else:
            click.echo(f"step: {siconos} is not there; name a Python with Siconos by --siconos")
    if "pictures" in parts:
        report.pictures(out, folder / "pictures", quick=quick)
    report.write(out, quick=quick)
    click.echo(f"results in {out}/")


if __name__ == "__main__":
    main()
