"""What deviations of CalculiX' test decks come from: both run again with the cause smaller.

    python benchmarks/decks.py --explain [--only NAME ...]

Every row changes one thing in a deck (or in the one of the two programs that is said) and gives
the largest difference of displacements at the nodes of the unchanged deck, over the largest
displacement: ours beside ccx, ours hard beside ccx, and ccx beside its own reference.  Needs
ccx.  Writes results/decks_explained.md.
"""

import contextlib
import re
import tempfile
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from deck_refinement import refined

import amontons as am
from amontons.io.readers import read

HERE = Path(__file__).parent / "results"
LONGEST = 1200  # seconds of one run, here or there
NUMBER = r"([^,\s]+)"
HEAD = """# Why answers to CalculiX' test decks differ

Both programs are run again with what is thought to be the cause made smaller or larger.
Regenerate: `python benchmarks/decks.py --explain` (needs CalculiX, 2.20 here).

ours: largest difference of displacements beside CalculiX 2.20 run on the same changed deck, at
the nodes of the unchanged one, over the largest displacement; hard: the same with contact hard
and sticking rigid here; own: CalculiX' answer to the changed deck beside that to the deck as
it is, which tells how much the change matters; K is pressure over overclosure, slope that of
shear over elastic slip; halves: every element cut into halves so often, in all directions.

"""


# ---------------------------------------------------------------------------------- changes
def stiffness(factor):
    """Pressure over overclosure and shear over elastic slip times a factor."""

    def change(text):
        times = lambda m: f"{m.group(1)}{factor * float(m.group(2)):.8e}"  # noqa: E731
        line, word = r"[^\n]*\n(?:\*\*[^\n]*\n)*\s*", r"(\*SURFACE BEHAVIOR[^\n]*OVERCLOSURE="
        text = re.sub(word + rf"(?:LINEAR|TIED){line}){NUMBER}", times, text, flags=re.I)
        second = rf"EXPONENTIAL{line}[^,\s]+\s*,\s*){NUMBER}"
        text = re.sub(word + second, times, text, flags=re.I)
        slope = rf"(\*FRICTION{line}[^,\s]+\s*,\s*){NUMBER}"
        return re.sub(slope, times, text, flags=re.I)

    return change


def loads(factor):
    """Forces, pressures, prescribed displacements and tension far away times a factor."""

    def change(text):
        times = lambda m: f"{m.group(1)}{factor * float(m.group(2)):.9g}"  # noqa: E731
        for line in (r"^(\s*\d+\s*,\s*P\d\s*,\s*)", r"^(\s*\d+\s*,\s*3\s*,\s*)(?=-1\.\s*$)",
                     r"^(15,2,2,)"):  # fmt: skip
            text = re.sub(f"(?m){line}{NUMBER}", times, text)
        tension = rf"(OVERCLOSURE=LINEAR[^\n]*\n\s*[^,\s]+\s*,\s*){NUMBER}"
        return re.sub(tension, times, text, flags=re.I)

    return change


def overlap(factor):
    """Contact6: the upper block starts so much of 0.0001 inside the lower one."""
    depth = 1e-4 * factor

    def change(text):
        text = re.sub(r"\b0\.9999\b", f"{1 - depth:.9g}", text)
        return loads(factor)(re.sub(r"\b1\.1999\b", f"{1.2 - depth:.9g}", text))

    return change


def halves(times):
    """All elements cut into halves so often."""

    def change(text):
        for _ in range(times):
            with tempfile.TemporaryDirectory() as place:
                path = Path(place) / "deck.inp"
                path.write_text(text, encoding="latin-1")
                text = refined(path)
        return text

    return change


def as_pressure(text):
    """Plate: its forces are those of an even pressure on one side."""
    return re.sub(r"(?is)\*CLOAD.*?(?=\*NODE PRINT)", "*DLOAD\n1, P4, 26.1437908496732\n", text)


def flat_alone(text):
    """Punch1: the facets beside those that touch are none of the slave."""
    return re.sub(r"(?m)^(34|35|36|52|53|54), S2.*\n", "", text)


def swapped(text):
    """The other side is the slave."""
    return text.replace("\nSlave,Master\n", "\nMaster,Slave\n")


def same(text):
    """The deck as it is."""
    return text


def plates_from(start):
    """Beamcontact: its plates begin at z = start, not at 7.5, half of a slave facet."""
    line = r"(?m)^(\s*4(?:5[4-9]|6\d),.*,)\s*7\.50*e\+00\s*$"

    def change(text):
        return re.sub(line, lambda m: f"{m.group(1)}{start:.12e}", text)

    return change


def increments(count):
    """Beamnh: so many equal increments, there."""
    return lambda text: text.replace(
        "*STATIC\n", f"*STATIC, DIRECT\n{1 / count:.9g}, 1.\n"
    ).replace("NLGEOM\n", "NLGEOM, INC=1000\n")


def small_increments(text):
    """Beamcontact: CalculiX needs several increments where its facets are halved."""
    return text.replace("0.999,1.", "0.1,1.")


def both(*changes):
    """Changes one after another."""

    def change(text):
        for each in changes:
            text = each(text)
        return text

    return change


# ------------------------------------------------------------------------------------ cases
@dataclass(frozen=True)
class Case:
    """A deck, why it deviates, and rows: what is changed, in their deck and in ours."""

    name: str
    cause: str
    rows: list = field(default_factory=list)


def alike(*rows):
    """Rows that change both decks in the same way."""
    return [(words, change, change) for words, change in rows]


def stiffer(*factors):
    return alike(*((f"K and slope x {factor}", stiffness(factor)) for factor in factors))


AREA = [
    (f"K x {k} there, {3 * k} here", stiffness(k), stiffness(3 * k)) for k in (1, 10, 100)
]  # fmt: skip
CASES = [
    Case("contact1", "area of a slave node without facets: CalculiX adds up its share of all "
         "three outer facets of the corner, here it has that of the facet which faces the "
         "master", [*stiffer(1), *AREA]),
    Case("contact3", "area of a slave node, as in contact1", [*stiffer(1, 10, 100), *AREA]),
    Case("contact6", "area of a slave node, as in contact1; the rest is finite strain, which "
         "falls with overlap and loads", [
             *stiffer(1), *AREA[:1],
             *((f"K x 3 here; loads and overlap x {s}", overlap(s),
                both(overlap(s), stiffness(3))) for s in (0.1, 0.01))]),
    Case("cubespring", "finite strain (NLGEOM): falls with the load; hard: stiffness",
         [*alike(*((f"loads x {s}", loads(s)) for s in (1, 0.1, 0.01))),
          *stiffer(10, 100, 1000)]),
    Case("friction1", "finite strain (NLGEOM): falls with the load; hard: stiffness and slope "
         "of sticking",
         [*alike(*((f"loads x {s}", loads(s)) for s in (1, 0.1, 0.01))),
          *stiffer(10, 100, 1000)]),
    Case("contactenergy", "hard: stiffness", stiffer(1, 10, 100)),
    Case("fricloop", "finite strain and rotation (NLGEOM): falls with loads and "
         "displacements.  Hard: equations keep the four nodes level, so that hard contact does "
         "not tell how they share the load, and friction depends on it: one answer of many, "
         "whatever the stiffness", [
             *alike(*((f"loads x {s}", loads(s)) for s in (1, 0.1, 0.01))),
             *stiffer(100, 10000)]),
    Case("plate", "one facet of second order: contact sits at corners here, at integration "
         "points there; CalculiX' own answer is off by the last column",
         alike(*((f"halves {k}", both(as_pressure, halves(k))) for k in range(4)))),
    Case("contact4", "one facet of second order on one: as plate; then stiffness",
         alike(*((f"halves {k}", halves(k)) for k in range(3)),
               *((f"halves 1, K x {k}", both(halves(1), stiffness(k)))
                 for k in (0.1, 10, 100)))),
    Case("punch1", "three facets of second order under a punch that is flat on the middle one: "
         "as plate.  Hat functions reach over the edge of contact by half a facet, so that the "
         "area is larger, pressure and overlap smaller than CalculiX', which falls with K and "
         "where the flat facets alone are the slave; the punch tilts, and its edges are "
         "singular: both fall slowly with halves",
         [*alike(*((f"halves {k}, K x {s}", both(halves(k), stiffness(s)))
                   for s in (1, 100) for k in range(3))),
          *((f"halves {k}; slave is the flat facets here", halves(k),
             both(flat_alone, halves(k))) for k in range(3))]),
    Case("beamcontact", "one facet of second order, the half of which faces a plate: "
         "multipliers at corners, one of them beyond the plate, hold the facet flush on it, "
         "where CalculiX' points let it turn about the plate's edge.  It falls where facets "
         "end with the plates (one halving, or plates that begin with the facet); without "
         "contact both agree to 2e-6",
         [*alike(*((f"halves {k}", both(small_increments, halves(k))) for k in (0, 1))),
          *alike(*((f"plates from z = 7, halves {k}",
                    both(plates_from(7.0), small_increments, halves(k))) for k in (0, 1)))]),
    Case("beamnh", "CalculiX ends its iterations early: the Cauchy stress that it prints is "
         "2.00397 under a pressure of 2, and by its own law (closed form, a bar that keeps its "
         "ends free) the end moves by 1.41248 as here, not by 1.41544; its own answer goes "
         "there in smaller increments",
         [(f"{n} increments there", increments(n), same) for n in (1, 4, 50)]),
    Case("cubef2f1", "a coarse slave of second order, glued at 16 corners: with the finer side "
         "as slave (cubef2f2) it falls; CalculiX' own tie of the same bodies (cubef2f3) is 2.4 "
         "percent from this",
         [*stiffer(1, 100), ("sides swapped", swapped, swapped),
          ("sides swapped here", same, swapped)]),
]  # fmt: skip


# ------------------------------------------------------------------------------------- runs
def explain(place, program, names, tools):
    """Run all cases; tools: the module decks, whose ways to run and read are used."""
    tools.PATIENCE = tools.SECONDS = LONGEST
    lines = ["| deck | changed | ours | hard | own |", "|---|---|---:|---:|---:|"]
    causes = []
    for case in CASES:
        if names and case.name not in names:
            continue
        path = next(p for p in (place / f"{case.name}.inp", place / f"{case.name}.inp.gz")
                    if p.exists())  # fmt: skip
        text, first = tools.text_of(path), None
        for words, there, here in case.rows:
            other = run_theirs(tools, program, there(text), case.name)
            first = other if first is None else first
            found = [
                run_ours(tools, here(text), case.name, *o) for o in ((), ("deck.hard=true",))
            ]
            cells = [gap(each, other, first) for each in found]
            another = any(word in words for word in ("loads", "plates"))  # another model
            cells.append("" if another else gap(first, other, first))
            lines.append(f"| {case.name} | {words} | {' | '.join(cells)} |")
            print(lines[-1], flush=True)
        causes.append(f"- **{case.name}**: {case.cause}.")
    text = HEAD + "\n".join([*causes, "", *lines]) + levels(place, tools)
    if not names:
        (HERE / "decks_explained.md").write_text(text)


def levels(place, tools):
    """How many of the four normal forces of fricloop hard contact tells."""
    model = read(place / "fricloop.inp", ("deck.hard=true",)).model
    H = model.assemble().H.toarray()[:, :: model.dimension]
    values = np.linalg.svd(H, compute_uv=False)
    words = ", ".join(f"{v:.1e}" for v in values)
    return f"\n\nfricloop, singular values of what its four normal forces do: {words}.\n"


def run_theirs(tools, program, text, name):
    """{node: displacement} of ccx at the end, None where it does not get there."""
    with tempfile.TemporaryDirectory() as place:
        found = tools.theirs(program, text, name, Path(place))
    return found[0][max(found[0])] if found and found[0] else None


def run_ours(tools, text, name, *overrides):
    """The same of ours."""
    with tempfile.TemporaryDirectory() as place:
        path = Path(place) / f"{name}.inp"
        path.write_text(text, encoding="latin-1")
        with contextlib.suppress(am.AmontonsError):
            found = tools.ours(path, *overrides)[0]
            u = found[max(found)][0]
            return {n: u[at] for n, at in tools.nodes_of(path).items() if at >= 0}
    return None


def gap(found, wanted, nodes):
    """Largest difference at `nodes` over the largest displacement, in words."""
    if not found or not wanted or not nodes:
        return ""
    own = [n for n in nodes if n in found and n in wanted]
    dim = len(next(iter(found.values())))
    difference = max(np.abs(np.array(found[n])[:dim] - np.array(wanted[n])[:dim]).max()
                     for n in own)  # fmt: skip
    return f"{difference / max(np.linalg.norm(wanted[n]) for n in own):.1e}"
