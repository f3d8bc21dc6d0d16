"""The tables of the page of results."""

from __future__ import annotations

from typing import Any

Row = dict[str, Any]
LETTERS = {"f": "f", "s": "s", "l": "+", "r": "-"}  # reference: slip to the left pushes right


def table(rows: list[Row]) -> list[str]:
    """A Markdown table of rows with, in part, the same keys."""
    keys = list(dict.fromkeys(key for row in rows for key in row))
    lines = ["| " + " | ".join(keys) + " |", "|" + "---|" * len(keys)]
    lines += [
        "| " + " | ".join(_shown(row.get(key, "")) for key in keys) + " |" for row in rows
    ]
    return [*lines, ""]


def _shown(value: Any) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.4g}" if abs(value) >= 1e-3 or value == 0 else f"{value:.1e}"
    return str(value)


def example(name: str, rows: list[Row]) -> list[str]:
    """One analytic example."""
    return [f"## {name.replace('example', 'Example ')}", "", *table(rows)]


def vee(found: dict[str, Any], reference: dict[str, Any]) -> list[str]:
    """Folds and solutions at gamma = 0.38, by every method, against other programs."""
    lines = ["## V-shaped body (section 3.2.1)", ""]
    folds, solutions = [], []
    for triangles, methods in found.items():
        known = reference.get(triangles)
        for name, run in methods.items():
            upper, lower = run["folds"]
            row: Row = {
                "triangles": triangles, "method": name,
                "upper fold": f"{upper:.10f}", "lower fold": f"{lower:.10f}",
            }  # fmt: skip
            if known:
                row["off reference"] = fold_error(run, known)
                row["solutions at 0.38 off"] = solution_error(run, known)
            row |= {"points": run["points"], "status changes": run["status changes"],
                    "CPU s": f"{run['cpu']:.2f}"}  # fmt: skip
            folds.append(row)
        for one in next(iter(methods.values()))["corner at 0.38"]:
            solutions.append({
                "triangles": triangles, "corner": one["status"],
                **{key: f"{one[key]:.7f}" for key in ("u_n", "u_t", "lam_n", "lam_t")},
                "error by the judge": one["error"],
            })  # fmt: skip
    lines += table(folds)
    lines += ["The most left node at gamma = 0.38 (nodal forces, GN per m; + slips left):", ""]
    lines += table(solutions)
    return lines


def fold_error(run: Row, known: Row) -> float:
    """Largest difference of the folds."""
    return max(abs(a - b) for a, b in zip(run["folds"], known["folds"], strict=True))


def solution_error(run: Row, known: Row) -> float:
    """Largest difference of the solutions at 0.38 at the corner; inf if statuses differ."""
    worst = 0.0
    for ours, other in zip(run["corner at 0.38"], known["corner at 0.38"], strict=True):
        if ours["status"] != LETTERS[other["status"]]:
            return float("inf")
        worst = max(worst, *(abs(ours[k] - other[k]) for k in ("u_n", "u_t", "lam_n", "lam_t")))
    return worst


def friction(found: dict[str, list[float]]) -> list[str]:
    """Folds for several coefficients."""
    rows = [
        {"F": mu, "folds": ", ".join(f"{x:.6f}" for x in folds) or "none"}
        for mu, folds in found.items()
    ]
    return ["## Friction and folds (figure 11)", "", *table(rows)]
