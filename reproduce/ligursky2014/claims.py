"""What the paper says, held against what was computed: the line with which the page opens.

Every row is generated from the stored numbers.  "agrees": the paper's statement holds within
the bar of its row; "paper": it differs, or can not be compared, for what is printed is wrong or
missing; "ours": it differs by our doing.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

Row = dict[str, Any]
AGREES, PAPER, OURS = "agrees", "paper", "ours"
NEAR = 1e-9  # distance of folds and solutions to other programs that is none
THEIRS = "algorithms 1 and 2, their settings"


def of_example(name: str) -> Callable[[list[Row]], list[Row]]:
    """One row per row of an example's table."""
    title = name.replace("example", "example ")
    return lambda rows: [
        {"where": title, "claim": f"{next(iter(row.values()))}: {row['paper']}",
         "verdict": AGREES if row["agrees"] else OURS}
        for row in rows
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


def of_friction(found: dict[str, list[float]]) -> list[Row]:
    """Figure 11 prints curves, and no values of friction in what the text has."""
    counts = [len(folds) for folds in found.values()]
    grows = counts == sorted(counts) and set(counts) == {0, 2}
    return [
        {"where": "figure 11", "claim": "no folds for small friction, two for large",
         "verdict": AGREES if grows else OURS},
        {"where": "figure 11", "claim": "curves for six coefficients, whose values are missing",
         "verdict": PAPER},
    ]  # fmt: skip


SOURCES: dict[str, Callable[[Any], list[Row]]] = {
    **{f"example{k}": of_example(f"example{k}") for k in range(1, 6)},
    "vee": of_vee,
    "friction": of_friction,
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
