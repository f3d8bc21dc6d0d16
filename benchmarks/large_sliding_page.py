"""The page of `large_sliding` from its rows."""

from pathlib import Path

import numpy as np
from machine import describe

RESULTS = Path(__file__).parent / "results"
HEAD = ["case", "program", "unknowns", "whole path", "load steps", "Newton steps each", "most",
        "CPU s", "penetration", "first force", "second", "ripple"]  # fmt: skip
# columns of `Setting.row` and their names; where the means begin, in parts of the path
FORCES = {"turned by 360 degrees": ((2, "normal"), (3, "moment")),
          "pressed into a tube": ((2, "axial"),)}  # fmt: skip
USUAL = ((2, "normal"), (1, "horizontal"))
ONE = ("Hertz, large",)  # nothing but a normal force
THIRD = "third method"
LIMITS = {  # runs from which a program's limit is taken: both meshes, load steps on each
    "rolling tyre": (
        ("amontons", "amontons, half steps", "amontons, quarter steps",
         "amontons, fine, half steps", "amontons, fine, quarter steps"),
        ("GetFEM", "GetFEM, x 10", "GetFEM, fine, x 10"),
        (THIRD, f"{THIRD}, half steps", f"{THIRD}, fine, half steps"),
    ),
    "folded strip, round tip": (
        ("amontons", "amontons", "amontons, fine"), ("GetFEM", "GetFEM", "GetFEM, fine"),
        (THIRD, THIRD, f"{THIRD}, fine"),
    ),
}  # fmt: skip
# let go in the second half: the whole path is compared
WHOLE = ("folded strip", "folded strip, round tip")


def columns(case):
    """What is measured in a case: (column, name) each."""
    return USUAL[:1] if case in ONE else FORCES.get(case, USUAL)


def late(row):
    """Forces at load steps of the second half (or all) of the path, (k, 4), without the last.

    Between them where a program has taken steps of its own.
    """
    forces = np.array(row["forces"])
    last = round(forces[-1, 0] / row["reached"])
    first = 1 if row["case"] in WHOLE else int(0.55 * last) + 1
    steps = np.arange(first, last)
    inside = [np.interp(steps, forces[:, 0], column) for column in forces.T[1:]]
    return np.column_stack([steps, *inside])


def curves(row):
    """The measured forces over `late`, (k, m); None of a path that ended."""
    if row is None or row["reached"] < 0.999:
        return None
    return late(row)[:, [c for c, _ in columns(row["case"])]]


def cells(row):
    """A line of the first table."""
    whole = "yes" if row["reached"] > 0.999 else f"to {row['reached']:.0%}"
    whole += ", out of time" if row["why"] == "out of time" else ""
    told = ["", "", ""]
    found = curves(row)
    if found is not None:
        names, means = [name for _, name in columns(row["case"])], np.abs(found.mean(axis=0))
        told = [f"{name} {value:.4g}" for name, value in zip(names, means, strict=True)]
        told = [*told, ""][:2] + [f"{found[:, 0].std() / means[0]:.1%}"]
    newton = f"{row['newton'] / max(row['steps'], 1):.1f}"
    return [row["case"], row["program"], row["unknowns"], whole, row["steps"], newton,
            row.get("most") or "", f"{row['seconds']:.1f}",
            f"{row['penetration'] / row['facet']:.1e}", *told]  # fmt: skip


def limit_of(coarse, fine):
    """Extrapolated from mesh widths h and h / 2 at an error of second order."""
    return None if coarse is None or fine is None else fine + (fine - coarse) / 3


def apart(mine, theirs):
    """Differences in percent of theirs, root mean squares of the curves, whatever the sign."""
    if mine is None or theirs is None:
        return ""
    theirs = theirs * np.where((mine * theirs).sum(axis=0) < 0, -1.0, 1.0)
    size = np.sqrt((theirs**2).mean(axis=0))
    found = 100 * np.sqrt(((mine - theirs) ** 2).mean(axis=0)) / size
    return ", ".join(f"{value:.1f}" for value in found)


def compared(rows, name):
    """Lines of the second table about a case."""
    found = {r["program"]: curves(r) for r in rows if r["case"] == name}
    seconds = {r["program"]: r["seconds"] for r in rows if r["case"] == name}
    out = []
    if found.get("amontons, exchanged") is not None:
        one = found.get("amontons"), found["amontons, exchanged"]
        two = found.get("amontons, fine"), found.get("amontons, fine, exchanged")
        at_limit = [limit_of(*both) for both in zip(one, two, strict=True)]
        out.append([name, "amontons, exchanged", apart(*one), "", "", apart(*two),
                    apart(*at_limit), "", ""])  # fmt: skip
    for peer, law in (("GetFEM", ""), ("CalculiX", ", law of CalculiX")):
        if peer not in found or "amontons" not in found:
            continue
        ours, fine = found.get(f"amontons{law}"), found.get(f"amontons{law}, fine")
        stiffest = [found.get(f"{peer}{text}") for text in ("", ", x 10", ", x 100")]
        theirs = found.get("GetFEM, fine" if peer == "GetFEM" else "CalculiX, x 10, fine")
        at_limit = limit_of(stiffest[0 if peer == "GetFEM" else 1], theirs)
        halves = found.get(f"amontons{law}, half steps"), found.get(f"{peer}, half steps")
        faster = seconds[peer] / seconds["amontons"]
        out.append([name, peer, *(apart(ours, one) for one in stiffest), apart(fine, theirs),
                    apart(limit_of(ours, fine), at_limit), apart(*halves),
                    f"{faster:.1f}"])  # fmt: skip
    return out


def beside_third(rows, name):
    """Lines of the third table about a case: every run beside the finest of a third method."""
    whole = [row for row in rows if row["case"] == name and curves(row) is not None]
    third = [row for row in whole if row["program"].startswith(THIRD)]
    if not third:
        return []
    finest = max(third, key=lambda row: (row["unknowns"], row["steps"]))
    sides = curves(finest)
    out = []
    for row in whole:
        if row["program"].startswith("CalculiX"):
            continue
        mine = curves(row)
        means = np.abs(mine.mean(axis=0))
        away = 100 * (means / np.abs(sides.mean(axis=0)) - 1)
        out.append([name, row["program"], row["unknowns"], row["steps"],
                    ", ".join(f"{value:.4g}" for value in means),
                    ", ".join(f"{value:+.1f}" for value in away),
                    apart(mine, sides) if row is not finest else ""])  # fmt: skip
    return out


def extrapolated(rows, name):
    """Lines of the table of limits about a case, beside that of the third method, its last."""
    found = {row["program"]: curves(row) for row in rows if row["case"] == name}
    limits = []
    for text, *runs in LIMITS.get(name, ()):
        meshes = [found.get(runs[0]), found.get(runs[-1])]
        if len(runs) == 4:  # whole and half load steps on both meshes
            pairs = [[found.get(program) for program in some] for some in (runs[:2], runs[2:])]
            meshes = [limit_of(*pair) for pair in pairs]
        at_limit = limit_of(*meshes)
        if at_limit is not None:
            limits.append((text, runs, at_limit))
    out = []
    for text, runs, curve in limits:
        means = np.abs(curve.mean(axis=0))
        out.append([name, text, "; ".join(runs), ", ".join(f"{value:.4g}" for value in means),
                    apart(curve, limits[-1][2])])  # fmt: skip
    return out


def table(head, lines):
    """Lines of a table."""
    return [f"| {' | '.join(map(str, line))} |" for line in (head, ["---"] * len(head), *lines)]


def written(rows, cases, programs):
    """Write results/large_sliding.md."""
    rows = [row for row in rows if row["case"] in cases and row["program"] in programs]
    rows.sort(key=lambda r: (cases.index(r["case"]), programs.index(r["program"])))
    third = [line for name in cases for line in beside_third(rows, name)]
    limits = [line for name in cases for line in extrapolated(rows, name)]
    both = [line for name in cases for line in compared(rows, name)]
    lines = ["# Two bodies that slide far", "", "`python -m benchmarks.large_sliding`", "",
             "; ".join(f"{k} {v}" for k, v in describe().items()), "",
             *table(HEAD, map(cells, rows)), "",
             "## Beside the peers' own limits", "",
             "Curves of amontons (beside CalculiX with its law) against those of a peer, root "
             "mean square differences in percent of each force: on the same mesh with its "
             "stiffness times 1, 10 and 100, with half the mesh width, both extrapolated to "
             "zero width, and with load steps of half the length. Exchanged: what amontons "
             "itself changes where the other side is the slave. Empty: a path that ended or "
             "was not run. Last column: its CPU time over that of amontons.", "",
             *table(["case", "beside", "x 1", "x 10", "x 100", "half the width", "limit",
                     "half the steps", "time over ours"], both), "",
             "## Beside a third method", "",
             "`large_sliding_reference.py`: a penalty at points of facets with anchors in the "
             "master, bodies of rotation by their meridian. Means of all forces, and how far "
             "they and the curves (root mean squares) are from its finest run, in percent.", "",
             *table(["case", "program", "unknowns", "load steps", "means", "means apart",
                     "curves apart"], third), "",
             "Limits of zero width at an error of second order, with four runs those of zero "
             "load steps before, of second order too, and how far their curves are from that "
             "of the third method.", "",
             *table(["case", "program", "from", "means", "apart"], limits), ""]  # fmt: skip
    notes = RESULTS / "large_sliding_notes.txt"
    text = "\n".join(lines) + ("\n" + notes.read_text() if notes.exists() else "")
    (RESULTS / "large_sliding.md").write_text(text)
