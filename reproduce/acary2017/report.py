"""The stored runs, and the page of tables and figures made from them."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path

import click
import numpy as np

import amontons as am
from amontons.case import read_case
from amontons.files import replacing
from amontons.plots import SI, Frame, draw_film, energy_figure, series_figure

from . import profiles, step, tables
from .methods import HYBRID, LONGER, PRINTED
from .race import NOBODY, load, race, store
from .wall import CASE, Series, newton_iterations, write_problems

FINE_METHODS = (
    "NSN-AC",
    "NSGS-AC",
    HYBRID,
    "NSN-AC global",
    "NSN-AC inexact",
    "Auto",
    "Auto global",
)
OURS = (
    "NSN-AC",
    HYBRID,
    "NSGS-AC",
    "NSN-AC inexact",
    "NSN-AC global",
    "Auto",
    "Auto global",
)
SETS = {
    "wall": "the wall",
    "fine": "the finer wall",
    "fclib": "the FCLib files",
}
COLD = (1e-4, 1e-6)  # tolerances at which Siconos runs from r = 0
PROFILES = ("wall", "fclib")
PICTURE_EVERY = 25  # steps between two pictures
SHOWN = 4  # pictures of the series
COMMAND = "python -m reproduce.acary2017"


def measure(
    out: Path, name: str, paths: Sequence[Path], methods: Sequence[str], limit: float,
    machine: dict[str, str], longer: Mapping[str, float] = NOBODY,
) -> None:  # fmt: skip
    """Run the methods on the files and store after every file; other columns stay.

    limit: seconds for a solve; longer: factors on it by method.
    """
    target = out / f"{name}.json"
    record = load(target)
    record |= {"limit": limit, "machine": machine}
    record["runs"] = {stem: run for stem, run in record["runs"].items()
                      if stem in {path.stem for path in paths}}  # fmt: skip
    for path in paths if methods else ():
        race([path], methods, limit, record["runs"], click.echo, longer)
        store(target, record)


def against_siconos(
    out: Path, series: Series, fine: Series | None, problems: Path, python: str, cap: float,
    machine: dict[str, str], methods: Sequence[str] | None,
) -> None:  # fmt: skip
    """The easiest and the hardest problem of each wall, against Siconos.

    methods: those of ours to measure again, None for all and every solver of Siconos.
    """
    stored = load(out / "step.json").get("walls", {})
    record = {"machine": machine, "cap": cap, "walls": dict(stored)}
    for chosen in (series, fine):
        if chosen is None:
            continue
        paths = sorted(write_problems(chosen, problems, click.echo), key=newton_iterations)
        for path in dict.fromkeys((paths[0], paths[-1])):
            click.echo(f"{path.stem} against Siconos")
            record["walls"][path.stem] = step.compare(
                path, python, cap, click.echo, methods, stored.get(path.stem)
            )
            store(out / "step.json", record)


def ratio_of_siconos(
    out: Path, paths: Sequence[Path], python: str, cap: float, machine: dict[str, str]
) -> None:
    """NSGS and NSN_AC of Siconos from r = 0 on some problems of the wall."""
    record = {"machine": machine, "cap": cap, "runs": {}}
    for path in paths:
        record["runs"][path.stem] = step.cold(path, python, cap, COLD, click.echo)
        store(out / "siconos.json", record)


def pictures(out: Path, folder: Path, *, quick: bool) -> None:
    """Frames into the working folder; a series, the film and the energies into `out`."""
    small = ["wall.cells=[2,1,1]", "evolution.until=0.2"] if quick else []
    case = read_case(CASE, small)
    assert case.evolution is not None
    frames, times, energies = [], [], []
    for done in am.evolve(case.model, case.evolution.method, until=case.evolution.until,
                          tolerance=case.settings.tolerance):  # fmt: skip
        times.append(done.time)
        energies.append(done.energies)
        if done.state.index % PICTURE_EVERY == 0:
            frames.append(Frame.of(done))
    *_, film = draw_film(case.model, frames, folder, units=SI)
    out.mkdir(parents=True, exist_ok=True)
    (out / "cracking.gif").write_bytes(film.read_bytes())
    shown = [frames[k] for k in np.linspace(1, len(frames) - 1, SHOWN).round().astype(int)]
    for name, figure in (
        ("cracking", series_figure(case.model, shown, units=SI)),
        ("energy", energy_figure(times, energies, units=SI)),
    ):
        with replacing(out / f"{name}.png") as temporary:
            figure.savefig(temporary, format="png")


# ----------------------------------------------------------------------------- the page
def write(out: Path, *, quick: bool) -> None:
    """results.md and results.json with the figures, from what is stored."""
    stored = {name: load(out / f"{name}.json") for name in SETS}
    stored = {name: record for name, record in stored.items() if record["runs"]}
    out.mkdir(parents=True, exist_ok=True)
    page, data = [_head(stored, quick=quick)], {}
    for name, record in stored.items():
        runs = record["runs"]
        part, data[name] = _part(name, record, out)
        page.append(part)
        if name == "wall" and all(set(PRINTED) <= set(r["methods"]) for r in runs.values()):
            found = tables.claims(runs, record["limit"])
            if "fclib" in stored:
                found.append(tables.most_robust(stored["fclib"]["runs"], SETS["fclib"]))
            data["claims"] = [vars(claim) for claim in found]
            page.insert(1, f"## The paper's claims\n\n{tables.claims_table(found)}")
            if (out / "siconos.json").is_file():
                theirs = json.loads((out / "siconos.json").read_text())
                page[1] += f"\n\n{WITHIN.format(medians=step.cold_medians(theirs))}"
    if (out / "siconos.json").is_file():
        record = json.loads((out / "siconos.json").read_text())
        page.append(f"## The same ratio within Siconos\n\n{COLD_TEXT}\n\n"
                    + step.cold_table(record)
                    + f"\n\nMedians: {step.cold_medians(record)}.")  # fmt: skip
    if (out / "step.json").is_file():
        record = json.loads((out / "step.json").read_text())
        page.append(f"## One time step against Siconos\n\n{STEP_TEXT}\n\n"
                    + step.table(record["walls"]))  # fmt: skip
    if (out / "energy.png").is_file():
        page.append(PICTURES)
    with replacing(out / "results.md") as temporary:
        temporary.write_text("\n\n".join(page) + "\n", encoding="utf-8")
    store(out / "results.json", data)


def _head(stored: dict, *, quick: bool) -> str:
    where = next(iter(stored.values()), {}).get("machine", {})
    described = "; ".join(f"{k} {v}" for k, v in where.items())
    limits = ", ".join(f"{r['limit']:g} s for {SETS[n]}" for n, r in stored.items())
    limits += "".join(
        f"; {name} has {k:g} times as long on the wall" for name, k in LONGER.items()
    )
    return HEAD.format(command=COMMAND + (" --quick" if quick else ""), machine=described,
                       limits=limits, methods=tables.legend())  # fmt: skip


def _part(name: str, record: dict, out: Path) -> tuple[str, dict]:
    """One set of problems: profiles, table of methods; for the wall the table of steps."""
    runs, limit = record["runs"], record["limit"]
    lines = [f"## On {SETS[name]}: {len(runs)} problems", tables.methods_table(runs)]
    if name in PROFILES:
        profiles.draw(runs, PRINTED, out / f"profiles-{name}.png")
        profiles.draw(runs, OURS, out / f"profiles-{name}-ours.png")
        lines += [f"![The methods of the paper](profiles-{name}.png)",
                  f"![Ours beside them](profiles-{name}-ours.png)"]  # fmt: skip
    data = {"costs": {}, "ratios": {}}
    if all({"NSGS-AC", "NSN-AC"} <= set(r["methods"]) for r in runs.values()):
        data = tables.record_of(runs, limit)
        if name != "fclib":
            lines += [f"### By time step\n\n{tables.steps_table(runs, limit)}"]
        lines += [tables.measures_text(runs)]
    formed = [r["condensing"] for r in runs.values() if "condensing" in r]
    if formed:
        lines.append(f"Forming W, not counted above: median {tables.middle(formed):.2g} s.")
    return "\n\n".join(lines), data


HEAD = """# The wall of acary2017: measured

Regenerate: `{command}`.  {machine}; one thread.

Times are processor seconds of one thread from the problem as read (with W for the Delassus
form) to an iterate that our judge accepts, from r = 0, limits {limits};
a method that misses the limit has not solved the problem.  A ratio is the median over the
problems of the ratio of two times; where one of the two methods failed it counts with the
limit, and `≥` or `≤` says so.

{methods}"""
STEP_TEXT = """Warm start from the impulses of the step before, tolerance 1e-6 by our judge,
processor seconds of one thread.  *Given W*: the solver alone.  *Given M and H*: from the file
to the answer; solvers of the Delassus form are charged the time that we need to form W.  A
problem has the contacts that are closed or about to close, of 685 and 2032."""
COLD_TEXT = """NSGS and NSN_AC of Siconos at one instant of the wall from r = 0, given W, judged
by us: what the ratio is where neither method is ours."""
WITHIN = """Within Siconos, by whose authors the paper is, NSN_AC is ahead of NSGS by
{medians} on problems of the same wall: see below."""
PICTURES = """## The cracking joints

![Status of the joints](cracking.png)

![Film](cracking.gif)

![Energy balance](energy.png)"""
