"""What the paper says, held against what was computed: the line with which the page opens.

Every row is generated from the stored numbers.  "agrees": the paper's statement holds within
the bar of its row; "paper": it differs, or can not be compared, for what is printed is wrong or
missing; "ours": it differs by our doing.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from . import convergence, disc

Row = dict[str, Any]
AGREES, PAPER, OURS = "agrees", "paper", "ours"
THEIRS = "algorithms 1 and 2, their settings"


def of_rows(where: str) -> Callable[[list[Row]], list[Row]]:
    """One row per row of a table that says what agrees, and whose fault the rest is."""
    return lambda rows: [
        {"where": where, "claim": ": ".join(dict.fromkeys(
            [str(next(iter(row.values()))), row["paper"]])),
         "verdict": AGREES if row["agrees"] else PAPER if row.get("fault") else OURS}
        for row in rows
    ]  # fmt: skip


def of_meshes(where: str, held: Callable[[Any], list[Row]]) -> Callable[[Any], list[Row]]:
    """The sentences on curves from mesh to mesh.

    What does not hold on all meshes is the paper's: the curves are those of other programs,
    too, and what they tend to is a matter of three meshes.
    """
    return lambda found: [
        {"where": where, "claim": row["claim"],
         "verdict": AGREES if row["verdict"] == "holds" else PAPER}
        for row in held(found)
    ]  # fmt: skip


def of_vee(found: dict[str, Any]) -> list[Row]:
    """The V-shaped body on the paper's meshes."""
    rows = []
    for triangles, methods in found.items():
        run = methods[THEIRS]
        whole = len(run["folds"]) == 2 and set(run["stops"]) == {"interval"}
        rows.append({
            "where": f"section 3.2.1, {triangles} triangles",
            "claim": "algorithms 1 and 2 follow the whole curve, over two folds",
            "verdict": AGREES if whole else OURS,
        })  # fmt: skip
        states = [one["status"] for one in run["corner at 0.38"]]
        rows.append({
            "where": f"figure 10, {triangles} triangles",
            "claim": "three solutions at 0.38: separated, left slip, stick",
            "verdict": AGREES if states == ["f", "+", "s"] else OURS,
        })  # fmt: skip
    return rows


def of_friction(figure: str) -> Callable[[dict[str, Any]], list[Row]]:
    """Figures 11 and 14 show curves for values of friction that the text does not have."""

    def rows(found: dict[str, Any]) -> list[Row]:
        folds = [x["folds"] if isinstance(x, dict) else x for x in found.values()]
        counts = [len(x) for x in folds]
        grows = counts == sorted(counts) and set(counts) == {0, 2}
        return [
            {"where": figure, "claim": "no folds for small friction, two for large",
             "verdict": AGREES if grows else OURS},
            {"where": figure, "claim": "one curve per coefficient (values not in the text)",
             "verdict": PAPER},
        ]  # fmt: skip

    return lambda found: rows(_first_mesh(found))


def _first_mesh(found: dict[str, Any]) -> dict[str, Any]:
    """The values of friction of the first mesh, where there are several."""
    first = next(iter(found.values()))
    return found if isinstance(first, list) or "folds" in first else first


def of_block(found: dict[str, Any]) -> list[Row]:
    """The three solutions of figure 13, on every mesh."""
    rows = []
    for squares, run in found.items():
        known = next(iter(run["runs"].values())) if "runs" in run else run
        states = [one["corner"] for one in known["at 0.495"]]
        rows.append({
            "where": f"figure 13, {squares} squares",
            "claim": "three solutions at 0.495: separated, right slip, stick",
            "verdict": AGREES if states == ["f", "-", "s"] else OURS,
        })  # fmt: skip
    return rows


def of_block_by_theirs(found: dict[str, Any]) -> list[Row]:
    """The block by the paper's algorithms and settings."""
    return [
        {"where": f"section 3.2.2, {squares} squares",
         "claim": "algorithms 1 and 2 follow the whole curve, over two folds",
         "verdict": AGREES if len(run["folds"]) == 2 and set(run["ends"]) == {"interval"}
         else OURS}
        for squares, run in found.items()
    ]  # fmt: skip


SOURCES: dict[str, Callable[[Any], list[Row]]] = {
    **{f"example{k}": of_rows(f"example {k}") for k in range(1, 6)},
    "example5-model": disc.statements,
    "first-order": of_rows("section 3.1.1"),
    "vee": of_vee,
    "vee-curves": of_meshes("figure 9", convergence.vee_claims),
    "friction": of_friction("figure 11"),
    "stress": of_rows("section 3.2.2, stress"),
    "block": lambda found: [
        *of_block(found), *of_meshes("figure 12", convergence.block_claims)(found)
    ],
    "block-paper": of_block_by_theirs,
    "block-friction": of_friction("figure 14"),
}


def collected(record: dict[str, Any]) -> list[Row]:
    """All claims of what is stored."""
    return [row for part, of in SOURCES.items() if part in record for row in of(record[part])]


def line(rows: list[Row]) -> str:
    """The counts, in one sentence."""
    counts = {word: sum(row["verdict"] == word for row in rows)
              for word in (AGREES, PAPER, OURS)}  # fmt: skip
    return (
        f"Of {len(rows)} statements of the paper **{counts[AGREES]} agree / "
        f"{counts[PAPER]} differ by the paper's fault / {counts[OURS]} differ by ours**."
    )
