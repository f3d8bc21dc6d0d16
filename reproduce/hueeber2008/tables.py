"""Ours, the paper's, the difference: every table as Markdown."""

from __future__ import annotations

from collections.abc import Mapping

from .verdicts import rate

Record = Mapping[str, dict]


def history(run: dict) -> str:
    """|A_n| / |A_tau| for k = 2, 3, … as Table 4.1 prints them."""
    pairs = zip(run["normal"][1:], run["tangential"][1:], strict=True)
    return " ".join(f"{a}/{b}" for a, b in pairs)


def table41(runs: Record, paper: Mapping[str, str]) -> list[str]:
    """Every entry of Table 4.1."""
    lines = ["## Table 4.1: active nodes |A_n| / |A_tau|, Tresca, exact", "",
             "| level | ours, k = 2, 3, … | paper | same |", "|---|---|---|---|"]  # fmt: skip
    for level, run in runs.items():
        ours, theirs = history(run), paper[level]
        verdict = "yes" if ours == theirs else _first_difference(ours, theirs)
        lines.append(f"| {level} | {ours} | {theirs} | {verdict} |")
    return [*lines, ""]


def _first_difference(ours: str, theirs: str) -> str:
    one, two = ours.split(), theirs.split()
    for k, (a, b) in enumerate(zip(one, two, strict=False)):
        if a != b:
            return f"**no**, first at k = {k + 2}"
    return f"sets yes, {len(one)} steps against {len(two)}"


def table42(runs: Mapping[str, Record], paper: Mapping[str, Mapping[str, list]]) -> list[str]:
    """K_l and multigrid steps of the three strategies."""
    lines = ["## Table 4.2: K_l and multigrid steps, ours (paper)", "",
             "| level | " + " | ".join(f"K_l {n} | steps {n}" for n in runs) + " |",
             "|---" * (1 + 2 * len(runs)) + "|"]  # fmt: skip
    for level in next(iter(runs.values())):
        cells = []
        for name, rows in runs.items():
            K, steps = paper[name][level]
            run = rows[level]
            cells += [f"{run['K']} ({K})", f"{run['cycles']} ({steps})"]
        lines.append(f"| {level} | " + " | ".join(cells) + " |")
    return [*lines, ""]


def table43(runs: Mapping[str, Record], paper: Mapping[str, Mapping[str, list]]) -> list[str]:
    """K_l and multigrid steps for values of c_tau."""
    lines = ["## Table 4.3: K_l and multigrid steps for c_tau, inexact, ours (paper)", "",
             "| level | " + " | ".join(f"c = {c}" for c in runs) + " |",
             "|---" * (1 + len(runs)) + "|"]  # fmt: skip
    for level in next(iter(runs.values())):
        cells = []
        for c, rows in runs.items():
            run, theirs = rows[level], paper[c][level]
            ours = f"{run['K']}, {run['cycles']}" if run["finished"] else "none in 120"
            cells.append(f"{ours} ({_pair(theirs)})")
        lines.append(f"| {level} | " + " | ".join(cells) + " |")
    return [*lines, ""]


def _pair(theirs: list | None) -> str:
    return "none" if theirs is None else f"{theirs[0]}, {theirs[1]}"


def table51(runs: Mapping[str, Record], paper: Mapping[str, Mapping[str, list]]) -> list[str]:
    """K_l and k_max of Algorithm 2."""
    heads = "K_l zero | k_max zero | K_l nested | k_max nested | in contact / slipping"
    lines = ["## Table 5.1: K_l and k_max, Coulomb, m = k_f = 1, ours (paper)", "",
             f"| level | {heads} |", "|---|---|---|---|---|---|"]  # fmt: skip
    for level, zero in runs["zero"].items():
        cells = []
        for name in ("zero", "nested"):
            run, (K, steps) = runs[name][level], paper[name][level]
            cells += [f"{run['K']} ({K})", f"{run['steps']} ({steps})"]
        counts = zero["counts"]
        cells.append(f"{counts['slip'] + counts['stick']} / {counts['slip']}")
        lines.append(f"| {level} | " + " | ".join(cells) + " |")
    return [*lines, ""]


def newton(runs: Record, fixed: Record) -> list[str]:
    """Full Newton beside the fixed point, on the cube."""
    lines = ["## Full Newton (7.1)-(7.3) on the Coulomb cube, to a change of 1e-10", "",
             "| level | steps, Newton | steps, fixed point | last changes of Newton |",
             "|---|---|---|---|"]  # fmt: skip
    for level, run in runs.items():
        last = ", ".join(f"{x:.1e}" for x in run["changes"][-5:])
        lines.append(f"| {level} | {run['steps']} | {fixed[level]['steps']} | {last} |")
    return [*lines, ""]


def resultants(runs: Record, reference: Mapping[str, dict]) -> list[str]:
    """Final counts and resultants against an independent computation."""
    lines = ["## Coulomb cube: resultants against an independent computation", "",
             "| level | in contact / slipping | force on the plane | largest difference |",
             "|---|---|---|---|"]  # fmt: skip
    for level, run in runs.items():
        ours = run["resultant"]
        given = reference.get(f"level{level}")
        off = "-"
        if given:
            size = max(abs(x) for x in given["resultant"])
            apart = max(abs(a - b) for a, b in zip(ours, given["resultant"], strict=True))
            off = f"{apart / size:.1e}"
        counts = run["counts"]
        lines.append(
            f"| {level} | {counts['slip'] + counts['stick']} / {counts['slip']} | "
            f"{', '.join(f'{x:.6f}' for x in ours)} | {off} |"
        )
    return [*lines, ""]


def sentence41(runs: Record, readings: Mapping[str, Record]) -> list[str]:
    """Other modifications, and the bound as section 2 has it."""
    nodal = readings["nodal bound"]
    level = max(nodal, key=int)
    other = ", ".join(
        f"{kind} {max(abs(run['steps'] - runs[k]['steps']) for k, run in rows.items())}"
        for kind, rows in readings.items() if kind != "nodal bound"
    )  # fmt: skip
    return [
        "With the bound as section 2 prints it, the integral of g phi_p, level "
        f"{level} ends with {nodal[level]['normal'][-1]}/{nodal[level]['tangential'][-1]} "
        f"instead of {runs[level]['normal'][-1]}/{runs[level]['tangential'][-1]}: the table "
        "has the dual basis functions. The other modifications end with the same sets; their "
        f"numbers of steps differ at most by: {other}.", "",
    ]  # fmt: skip


def section3(runs: Mapping[str, Mapping[str, Record]]) -> list[str]:
    """Steps of the methods that are not modified, beside the first modification."""
    first = next(iter(runs.values()))["zero"]
    lines = ["## Sections 3.2 and 3.4: why the Robin conditions are modified", "",
             "Steps to a change of 1e-9 (Tresca, exact, c_n = c_tau = c), at most 60.", "",
             "| method | start | " + " | ".join(f"level {case}" for case in first) + " |",
             "|---" * (2 + len(first)) + "|"]  # fmt: skip
    for method, starts in runs.items():
        for start, cases in starts.items():
            cells = [_ended(run) for run in cases.values()]
            lines.append(f"| {method} | {start} | " + " | ".join(cells) + " |")
    return [
        *lines, "",
        "From zero lambda grows beyond its bound in the first steps, and Id - M of (3.5b) is "
        "no longer positive definite. (3.14) divides by |lambda + c u|, so from far away, "
        "u = (1, 1, 0), its conditions hardly depend on u. Near a solution all are the same.",
        "",
    ]  # fmt: skip


def _ended(run: dict) -> str:
    if run["finished"]:
        return str(run["steps"])
    return "none in 60" if run["steps"] >= 60 else f"none, the same again after {run['steps']}"


def parameters(runs: Mapping) -> list[str]:
    """Table 4.3 beyond its range."""
    level = runs["level"]
    told = [
        f"{name}: {run['K']}, {run['cycles']}" if run["finished"]
        else f"{name}: none, the same again after {run['steps']}"
        for name, run in runs.items() if name != "level"
    ]  # fmt: skip
    return [
        f"Beyond the table, level {level}, K_l and steps: {'; '.join(told)}. c = 100 D_p is "
        "what 100 would be for tractions instead of forces; the last one is what `ActiveSet` "
        "takes unless told. Too small a c does fail, as printed, but it is c_n that must not "
        "be small.", "",
    ]  # fmt: skip


def strategies(runs: Mapping[str, Record]) -> list[str]:
    """m and k_f."""
    levels = list(next(iter(runs.values())))
    lines = ["## Algorithm 2 with other m and k_f: K_l, steps, multigrid steps, to 1e-10", "",
             "| strategy | " + " | ".join(f"level {k}" for k in levels) + " | largest error |",
             "|---" * (2 + len(levels)) + "|"]  # fmt: skip
    for name, rows in runs.items():
        cells = [f"{r['K']}, {r['steps']}, {r['cycles']}" for r in rows.values()]
        worst = max(run["errors"][-1] for run in rows.values())
        lines.append(f"| {name} | " + " | ".join(cells) + f" | {worst:.0e} |")
    return [
        *lines, "",
        "The rule asks for k > k_f and compares with the last friction bound; the last column "
        "is our independent error there. The bound alone decides the number of its updates, so "
        "anything but m = k_f = 1 only adds cycles.", "",
    ]  # fmt: skip


def figure43(runs: Record) -> list[str]:
    """alpha and beta at the node, with numbers."""
    lines = ["## Figure 4.3: alpha at (0.0625, 1, 0), steps to 1e-14", "",
             "| modification | alpha, k = 1, 2, … | beta, k = 1, 2, … | steps |",
             "|---|---|---|---|"]  # fmt: skip
    for name, run in runs.items():
        alpha, beta = (
            " ".join(f"{x:.3f}" for x in run[key][:6]) for key in ("alpha", "beta")
        )
        lines.append(f"| {name} | {alpha} | {beta} | {run['steps']} |")
    return [
        *lines, "",
        "lambda^0 = (-1, -1, 0) is a traction, as all lambda_h of the paper: the force at a "
        "node is D_p times as large.", "",
    ]  # fmt: skip


def table61(runs: Mapping[str, Mapping[str, Record]], paper: Mapping[str, dict]) -> list[str]:
    """K_l and k_max of the shell for three coefficients of friction."""
    friction = list(runs["zero"])
    lines = []
    for name in ("zero", "nested"):
        heads = [f"{what}, F = {mu}" for what in ("K_l", "k_max") for mu in friction]
        lines += [f"## Table 6.1, {name}: K_l and k_max, ours (paper)", ""]
        lines += ["| level | " + " | ".join(heads) + " |", "|---" * (1 + len(heads)) + "|"]
        for level in runs[name][friction[0]]:
            found = [runs[name][mu][level] for mu in friction]
            ours = [run["K"] for run in found] + [run["steps"] for run in found]
            pairs = zip(ours, paper[name][level], strict=True)
            lines.append(f"| {level} | " + " | ".join(f"{a} ({b})" for a, b in pairs) + " |")
        lines.append("")
    return lines


def section7(runs: Mapping[str, Record]) -> list[str]:
    """Steps of full Newton and of the fixed point with two bodies."""
    title = "## Section 7: full Newton against the fixed point, to a change of 1e-9"
    lines = [title, "",
             "| example | steps, Newton | steps, fixed point | last changes of Newton | rate "
             "of the fixed point |", "|---|---|---|---|---|"]  # fmt: skip
    for name, both in runs.items():
        newton, fixed = both["newton"], both["fixed-point"]
        last = ", ".join(f"{x:.1e}" for x in newton["changes"][-4:])
        lines.append(
            f"| {name} | {newton['steps']} | {fixed['steps']} | {last} | {rate(both):.2f} |"
        )
    return [*lines, ""]
