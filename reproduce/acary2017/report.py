"""The stored runs, and the page of tables and figures made from them."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import click
import numpy as np

import amontons as am
from amontons.core.files import replacing
from amontons.io.case import read_case
from amontons.io.plots import SI, Frame, draw_film, energy_figure, series_figure

from . import claims, peers, profiles, rigid, step, tables
from .methods import HYBRID, NEWTON, PRINTED
from .race import CLOCK, PAPER, load, race, store
from .ratios import number
from .wall import CASE, Series, newton_iterations, section, series_file, write_problems
from .wall import PAPER as PAPER_SERIES

OURS = ("NSN-AC", HYBRID, "NSGS-AC", "NSN-AC inexact", "Auto")
SETS = {
    "wall": "the wall",
    "fine": "the finer wall",
    "fclib": "the FCLib files",
}
SICONOS_SETS = {"wall": "siconos", "fclib": "siconos-fclib"}  # files of results
PROFILES = ("wall", "fclib")
SOME = 5  # problems for Siconos and for the accuracy of one contact, from easy to hard
PICTURE_EVERY = 25  # steps between two pictures
SHOWN = 4  # pictures of the series
COMMAND = "python -m reproduce.acary2017"


def some(paths: Sequence[Path]) -> list[Path]:
    """A few of the problems, evenly from the easiest to the hardest."""
    order = sorted(paths, key=newton_iterations)
    places = np.linspace(0, len(order) - 1, min(SOME, len(order))).round().astype(int)
    return [order[k] for k in places]


def measure(
    out: Path, name: str, paths: Sequence[Path], methods: Sequence[str], limit: float,
    machine: dict[str, str], missing: bool = False,
) -> None:  # fmt: skip
    """Run the methods on the files and store after every file; other columns stay.

    limit: processor seconds for a solve, the same for all.  missing: what is stored with this
    limit stays, too, so that a measurement goes on where it was stopped.
    """
    target = out / f"{name}.json"
    record = load(target)
    record |= {"limit": limit, "machine": machine}
    record["runs"] = {stem: run for stem, run in record["runs"].items()
                      if stem in {path.stem for path in paths}}  # fmt: skip
    for path in paths:
        known = record["runs"].get(path.stem, {"methods": {}})["methods"]
        stays = [name for name, run in known.items() if missing and run["limit"] == limit]
        asked = [name for name in methods if name not in stays]
        if asked:
            race([path], asked, limit, record["runs"], click.echo)
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


def keep_series(out: Path, series: Series, problems: Path) -> None:
    """Copy the record of how the problems were chosen to the results."""
    store(out / "series.json", json.loads(series_file(series, problems).read_text()))


def within_siconos(
    out: Path, name: str, paths: Sequence[Path], python: str, limit: float,
    machine: dict[str, str], missing: bool = False,
) -> None:  # fmt: skip
    """The methods of the paper in Siconos from r = 0; `missing` as in `measure`."""
    target = out / f"{SICONOS_SETS[name]}.json"
    record: dict = {"machine": machine, "limit": limit, "runs": {}}
    known = load(target)
    if missing and known.get("limit") == limit:
        record = known | {"machine": machine}
    steps = record.setdefault("newton_flops", {})
    for path in paths:
        if path.stem not in record["runs"].get("siconos", {}):
            peers.race([path], python, limit, record["runs"], click.echo)
            store(target, record)
        if name == "wall" and steps.get(path.stem) is None:
            steps[path.stem] = peers.elimination_flops(am.read_fclib(path).condensed())
            store(target, record)


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
    siconos = {name: load(out / f"{file}.json") for name, file in SICONOS_SETS.items()}
    out.mkdir(parents=True, exist_ok=True)
    page, data = [], {}
    for name, record in stored.items():
        part, data[name] = _part(name, record, out)
        page.append(part)
    said, data["claims"] = _claims(stored, siconos)
    problems = _problems(stored, out, quick=quick)
    page = [_head(stored, said, quick=quick), *said[1:], *problems, *page]
    variants = load(out / "variants.json")
    if variants["runs"]:
        page.append(VARIANTS.format(problems=len(variants["runs"]), limit=variants["limit"],
                                    table=tables.variants_table(variants["runs"])))  # fmt: skip
    within = siconos["wall"]["runs"]
    if within:
        page.append(SICONOS.format(
            table=peers.table(within), steps=peers.steps_table(within),
            problems=len(within["siconos"]), limit=siconos["wall"]["limit"],
        ))  # fmt: skip
    within = siconos["fclib"]["runs"]
    if within:
        page.append(SICONOS_FCLIB.format(
            table=peers.table(within), problems=len(within["siconos"]),
            limit=siconos["fclib"]["limit"],
        ))  # fmt: skip
    if (out / "rigid.json").is_file():
        record = json.loads((out / "rigid.json").read_text())
        page.append(f"## Rigid against elastic blocks\n\n{rigid.section(record, out)}")
    if (out / "step.json").is_file():
        record = json.loads((out / "step.json").read_text())
        page.append(f"## One time step against Siconos\n\n{STEP_TEXT}\n\n"
                    + step.table(record["walls"]))  # fmt: skip
    if (out / "energy.png").is_file():
        page.append(PICTURES)
    with replacing(out / "results.md") as temporary:
        temporary.write_text("\n\n".join(page) + "\n", encoding="utf-8")
    store(out / "results.json", data)


def _problems(stored: dict, out: Path, *, quick: bool) -> list[str]:
    """How the problems were chosen, and how many of them are measured."""
    lines = []
    if (out / "series.json").is_file():
        lines.append(section(json.loads((out / "series.json").read_text())))
    done = len(stored.get("wall", {}).get("runs", {}))
    if done < PAPER_SERIES.chosen and not quick:
        lines.append(
            f"Measured on {done} problems so far, of {PAPER_SERIES.chosen} in all: "
            + ", ".join(stored.get("wall", {}).get("runs", {}))
            + f" (step, contacts, iterations of Newton); `{COMMAND} --missing` goes on."
        )
    return ["\n\n".join(["## The problems", *lines])] if lines else []


def _claims(stored: dict, siconos: dict) -> tuple[list[str], list[dict]]:
    """The line in counts and the table of claims; the same for the JSON."""
    runs = stored.get("wall", {}).get("runs", {})
    if not runs or not all(set(PRINTED) <= set(r["methods"]) for r in runs.values()):
        return [""], []
    ours, seconds = claims.claims(runs, PAPER), claims.claims(runs, CLOCK)
    theirs: list[claims.Claim | None] = [None] * len(ours)
    counted = list(theirs)
    within = siconos["wall"]["runs"].get("siconos", {})
    if within:
        theirs = list(claims.claims(within, peers.COST))
        steps = siconos["wall"].get("newton_flops", {})
        operations = peers.with_operations(within, runs, steps)
        counted = list(claims.claims(operations, PAPER)) if operations else list(theirs)
    if "fclib" in stored:
        where, within = SETS["fclib"], siconos["fclib"]["runs"].get("siconos")
        ours = [*ours, claims.most_robust(stored["fclib"]["runs"], where, CLOCK)]
        seconds = [*seconds, None]  # whether a problem is solved is no question of cost
        theirs.append(claims.most_robust(within, where, peers.COST) if within else None)
        counted.append(theirs[-1])
    verdicts = [claims.verdict(c, other) for c, other in zip(ours, counted, strict=True)]
    told = [
        {**vars(c), "verdict": v, "siconos": vars(other) if other else None}
        for c, v, other in zip(ours, verdicts, counted, strict=True)
    ]
    table = claims.table(ours, seconds, counted, theirs)
    left = sum(claim.undecided for claim in ours)
    text = f"## The paper's claims\n\n{CLAIMS}\n\n{table}"
    return [claims.opening(verdicts, left), text], told


def _head(stored: dict, said: list[str], *, quick: bool) -> str:
    where = next(iter(stored.values()), {}).get("machine", {})
    described = "; ".join(f"{k} {v}" for k, v in where.items())
    limits = ", ".join(f"{r['limit']:g} s for {SETS[n]}" for n, r in stored.items())
    return HEAD.format(command=COMMAND + (" --quick" if quick else ""), machine=described,
                       limits=limits, methods=tables.legend(), opening=said[0])  # fmt: skip


def _part(name: str, record: dict, out: Path) -> tuple[str, dict]:
    """One set of problems: profiles, table of methods; for the walls by difficulty."""
    runs = record["runs"]
    lines = [f"## On {SETS[name]}: {len(runs)} problems",
             "Processor seconds, by our judge:", tables.methods_table(runs),
             _early(runs)]  # fmt: skip
    if any(run["flops"] for entry in runs.values() for run in entry["methods"].values()):
        lines += ["Floating point operations, by the paper's (13):",
                  tables.methods_table(runs, PAPER)]  # fmt: skip
    if name in PROFILES:
        lines += _figures(name, runs, out)
    data: dict = {}
    if all({"NSGS-AC", "NSN-AC"} <= set(r["methods"]) for r in runs.values()):
        data = tables.record_of(runs)
        if name != "fclib":
            lines += [f"### By difficulty\n\n{tables.grades_table(runs)}"]
        lines += [tables.measures_text(runs)]
    formed = [r["condensing"] for r in runs.values() if "condensing" in r]
    if formed:
        middle = number(float(np.median(formed)))
        lines.append(f"Forming W, not counted above: median {middle} s.")
    return "\n\n".join(line for line in lines if line), data


def _early(runs: dict) -> str:
    """What is to be said of runs of an earlier measurement, which a rule has ended."""
    ends = [run["outcome"] for entry in runs.values() for run in entry["methods"].values()]
    early = ends.count("stagnated")
    if not early:
        return ""
    return (
        f"Measured while a rule of stagnation still ended runs, {early} of {len(ends)} here: "
        "what is solved is at least what stands in the table."
    )


def _figures(name: str, runs: dict, out: Path) -> list[str]:
    """Profiles as in figure 3 with its zoom, by seconds, and of ours."""
    newton = (*NEWTON, HYBRID)
    drawn = {
        "-operations": ("Operations, the methods of the paper", PRINTED, PAPER),
        "-zoom": ("Operations, the Newton methods among themselves", newton, PAPER),
        "": ("Seconds, the methods of the paper", PRINTED, CLOCK),
        "-ours": ("Seconds, ours beside them", OURS, CLOCK),
    }
    lines = []
    for suffix, (title, names, cost) in drawn.items():
        path = out / f"profiles-{name}{suffix}.png"
        if profiles.draw(runs, names, path, cost):
            lines.append(f"![{title}]({path.name})")
    return lines


HEAD = """# The wall of acary2017: measured

{opening}

Regenerate: `{command}`.  {machine}; one thread.

Costs are those from the problem as read (with W for the Delassus form), from r = 0: processor
seconds of one thread until our judge accepts an iterate, and floating point operations, as
the solvers count them (judgements included), until the paper's (13) holds.  Limits: {limits},
the same for every method, and nothing else ends a run that makes no progress.  A ratio is the
median over the problems of the ratio of two costs; where one of the two methods failed its run
counts with what it really took, and `≥` or `≤` says so.

{methods}"""
CLAIMS = """The verdict is that of operations to (13), the paper's own measure.  *Differs by the
paper's fault*: the same methods in Siconos, by whose authors the paper is, differ on these
problems too; *by ours*: they do not, were not asked, or our limit ended the runs too early.
Operations of Siconos: its iterations, a sweep at the cost of ours, a Newton step at what MUMPS
counts for its LU of Newton's matrix on W."""
VARIANTS = """## Variants

{problems} problems of the wall from the easiest to the hardest, by our judge, {limit:g} s for a
solve: other functions and a line search for Newton, and how accurately one contact is solved.

{table}"""
STEP_TEXT = """Warm start from the impulses of the step before, tolerance 1e-6 by our judge,
processor seconds of one thread.  *Given W*: the solver alone.  *Given M and H*: from the file
to the answer; solvers of the Delassus form are charged the time that we need to form W."""
SICONOS = """## Within Siconos

{problems} problems of the wall from the easiest to the hardest, from r = 0, given W, judged by
(13), {limit:g} s for a call.  A call of Siconos includes its own judging.

{table}

What a Newton step takes, given W, ours (NSN-AC) and theirs (NLS_AC, with MUMPS):

{steps}"""
SICONOS_FCLIB = """### On the FCLib files

{problems} files, judged by (13), {limit:g} s for a call.

{table}"""
PICTURES = """## The cracking joints

![Status of the joints](cracking.png)

![Film](cracking.gif)

![Energy balance](energy.png)"""
