"""What figures 9 and 12 claim of their curves from mesh to mesh, in numbers.

Of values on three meshes, each of half the size of the last, "ratio" is the second step over
the first: 1/2 for an error of first order, 1/4 of second.  Up to 3/4 the steps shrink, up to 1
hardly.  Three meshes prove nothing of the limit: the verdict is one on what they show.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from .tables import table

Row = dict[str, Any]
NAMES = ("u_nu", "u_tau", "T_nu", "T_tau")
SHRINK = 0.75  # ratio of steps up to which they clearly shrink
ALIKE = 0.03  # relative difference of displacements on two meshes that are "almost the same"
NEAR = 0.01  # difference of gamma of two folds that are "approximately the same"
WORDS = {"f": "separated", "-": "right slip", "+": "left slip", "s": "stick"}


def steps(values: Sequence[float]) -> Row:
    """First and second step of values on three meshes, their ratio, and the verdict."""
    first, second = values[1] - values[0], values[2] - values[1]
    ratio = abs(second / first) if first else float(second != 0)
    word = "shrink" if ratio <= SHRINK else "hardly shrink" if ratio <= 1 else "grow"
    return {"step 1": first, "step 2": second, "ratio": ratio, "steps": word}


def rows_of(meshes: dict[str, list[Row]], size: dict[str, float]) -> list[Row]:
    """One row per place and quantity; meshes: their rows, each with the key "place".

    Quantities that are zero on all meshes, relative to `size`, are conditions, not results.
    """
    names = list(meshes)
    out = []
    for k, row in enumerate(meshes[names[-1]]):
        for key in NAMES:
            values = [meshes[name][k][key] for name in names]
            zero = [abs(x) <= 1e-6 * size[key[0]] for x in values]
            if all(zero):
                continue
            values = [0.0 if none else x for x, none in zip(values, zero, strict=True)]
            shown = {name: f"{x:.6g}" for name, x in zip(names, values, strict=True)}
            compared = {"steps": "status differs"} if any(zero) else steps(values)
            out.append({"at": row["place"], "quantity": key, **shown, **compared})
    return out


def finest(found: dict[str, Any]) -> list[str]:
    """The three finest meshes there are."""
    return sorted(found, key=int)[-3:]


# ---------------------------------------------------------------------------- figure 12
def block_rows(found: dict[str, Any]) -> list[Row]:
    """The node at (10, 0): one solution at some loads, three at 0.495, and the folds."""
    names = finest(found)
    runs = {name: next(iter(found[name]["runs"].values())) for name in names}
    meshes = {
        name: [row | {"place": f"gamma = {row['gamma']:g}"} for row in run["along"]]
        + [row | {"place": f"0.495, {WORDS[row['corner']]}"} for row in run["at 0.495"]]
        for name, run in runs.items()
    }  # fmt: skip
    same = len({tuple(row["place"] for row in rows) for rows in meshes.values()}) == 1
    if len(names) < 3 or not same:
        return []
    return rows_of(meshes, {"u": 1.0, "T": 1.0}) + _fold_rows(
        {name: run["folds"] for name, run in runs.items()}
    )


def _fold_rows(folds: dict[str, list[float]]) -> list[Row]:
    out = []
    for k, which in enumerate(("upper", "lower")):
        values = [of[k] for of in folds.values()]
        shown = {name: f"{x:.6f}" for name, x in zip(folds, values, strict=True)}
        out.append({"at": f"{which} fold", "quantity": "gamma", **shown, **steps(values)})
    return out


def _counts(rows: list[Row], letter: str, *places: str) -> tuple[int, int]:
    """(rows whose steps shrink, all) of displacements u or stresses T at some places."""
    own = [row for row in rows if row["quantity"][0] == letter and "ratio" in row
           and (not places or any(place in row["at"] for place in places))]  # fmt: skip
    return sum(row["steps"] == "shrink" for row in own), len(own)


def block_claims(found: dict[str, Any]) -> list[Row]:
    """The sentences on figure 12, each with its verdict."""
    rows = block_rows(found)
    if not rows:
        return []
    single = ("gamma = 0.25", "gamma = 0.45", "gamma = 0.52")
    closed = ("gamma = 0.75", "gamma = 1")
    u, T = _counts(rows, "u"), _counts(rows, "T")
    after = _counts(rows, "T", *closed)
    inside = _counts(rows, "T", "0.495")
    names = finest(found)
    runs = [next(iter(found[name]["runs"].values())) for name in names]
    folds = [run["folds"] for run in runs]
    three = all(len(run["at 0.495"]) == 3 for run in runs)
    lower = [row for row in rows if row["at"] == "lower fold"][0]
    free = _counts(rows, "u", *single)
    return [
        {"claim": "displacements converge", "seen": f"steps shrink in {u[0]} of {u[1]} rows "
         f"({free[0]} of {free[1]} where one solution is free or slips)",
         "verdict": _whole(u)},
        {"claim": "stresses seem to converge",
         "seen": f"steps shrink in {T[0]} of {T[1]} rows: "
         f"{after[0]} of {after[1]} where the node sticks at large gamma, {inside[0]} of "
         f"{inside[1]} in the three solutions at 0.495; those of the lower fold "
         f"{lower['steps']} (ratio {lower['ratio']:.2f})",
         "verdict": _whole(T)},
        {"claim": "two folds", "seen": f"{', '.join(str(len(f)) for f in folds)} on the meshes",
         "verdict": "holds" if all(len(f) == 2 for f in folds) else "does not hold"},
        {"claim": "up to three solutions", "seen": "three at 0.495 on all of them" if three
         else "not three at 0.495 on all", "verdict": "holds" if three else "does not hold"},
    ]  # fmt: skip


def _whole(counts: tuple[int, int]) -> str:
    good, total = counts
    if good == total:
        return "holds"
    return "holds in part" if good else "does not hold"


# ----------------------------------------------------------------------------- figure 9
def vee_rows(found: dict[str, Any]) -> list[Row]:
    """The corner of the V-shaped body at three loads, and the folds."""
    names = finest(found)
    meshes = {
        name: [row | {"place": f"{row['gamma']:g}, {WORDS[row['status']]}"}
               for row in found[name]["rows"]]
        for name in names
    }  # fmt: skip
    if len(names) < 3:
        return []
    folds = {name: found[name]["folds"] for name in names}
    return rows_of(meshes, {"u": 0.01, "T": 1.0}) + _fold_rows(folds)


def vee_claims(found: dict[str, Any]) -> list[Row]:
    """The sentences on figure 9, each with its verdict."""
    rows = vee_rows(found)
    if not rows:
        return []
    names = finest(found)
    gaps = [-found[name]["rows"][0]["u_nu"] for name in names]
    apart = max(
        abs(float(row[a]) - float(row[names[-1]])) / abs(float(row[names[-1]]))
        for row in rows if row["quantity"][0] == "u" for a in names
    )  # fmt: skip
    stress = _counts(rows, "T")
    grown = min(
        abs(float(row[names[-1]]) / float(row[names[0]]))
        for row in rows if row["quantity"][0] == "T"
    )  # fmt: skip
    folds = [found[name]["folds"] for name in names]
    moved = max(abs(a - b) for of in zip(*folds, strict=True) for a in of for b in of)
    return [
        {"claim": "a gap at gamma = 0 on all meshes",
         "seen": ", ".join(f"{gap:.5f} m" for gap in gaps) + " at the corner",
         "verdict": "holds" if min(gaps) > 0 else "does not hold"},
        {"claim": "displacements almost the same", "seen": f"up to {100 * apart:.2g} % apart",
         "verdict": "holds" if apart < ALIKE else "does not hold"},
        {"claim": "stresses do not seem to converge at the corner",
         "seen": f"{grown:.2f} times as large or more on the finest mesh as on the coarsest; "
         f"steps shrink in {stress[0]} of {stress[1]} rows",
         "verdict": "holds" if grown > 1.2 else "does not hold"},
        {"claim": "two folds, approximately at the same gamma", "seen": f"within {moved:.4f}",
         "verdict": "holds" if all(len(f) == 2 for f in folds) and moved < NEAR
         else "does not hold"},
        {"claim": "up to three solutions",
         "seen": "three at 0.38 on all of them",
         "verdict": "holds" if all(_solutions(found[name]) == 3 for name in names)
         else "does not hold"},
    ]  # fmt: skip


def _solutions(one: dict[str, Any]) -> int:
    return sum(row["gamma"] == 0.38 for row in one["rows"])


def page(title: str, rows: list[Row], claims: list[Row]) -> list[str]:
    """The two tables, where there are three meshes."""
    if not rows:
        return []
    return [f"### From mesh to mesh ({title})", "", *table(claims),
            "Values on the three meshes, and the steps between them:", "",
            *table(rows)]  # fmt: skip
