"""What agrees with the paper, what differs and by whose fault: from the stored numbers alone.

An entry of a table agrees when sets are equal, K_l within one step, and numbers of steps within
two.  A claim of the text agrees when its condition holds.  Every other one has somebody's
fault: the paper's, where what decides is not printed or contradicts the rest of it, or ours.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

Record = Mapping[str, Any]
NEAR = {"K": 1, "steps": 2}


@dataclass(frozen=True)
class Verdict:
    """One printed entry or sentence: where it stands, whether it agrees, else whose fault."""

    where: str
    agrees: bool
    fault: str = "paper"
    text: str = ""
    found: str = ""


def verdicts(record: Record, paper: Record) -> list[Verdict]:
    """Of everything that is stored; `paper`: the printed numbers."""
    out: list[Verdict] = []
    for part, entries in ENTRIES.items():
        if part in record:
            out += entries(record[part], paper[part])
    for claim in CLAIMS:
        if all(part in record for part in claim.parts):
            holds, found = claim.check(record)
            out.append(Verdict(claim.where, holds, claim.fault, claim.text, found))
    return out


def counts_line(found: list[Verdict]) -> str:
    """The first line of the page."""
    agree = sum(v.agrees for v in found)
    paper = sum(not v.agrees and v.fault == "paper" for v in found)
    claims = sum(bool(v.text) for v in found)
    return (
        f"Agrees {agree} / differs by the paper's fault {paper} / differs by ours "
        f"{len(found) - agree - paper}: of {len(found) - claims} printed numbers and {claims} "
        "statements."
    )


def summary(found: list[Verdict]) -> list[str]:
    """Counts per table, and every statement with what was found."""
    lines = ["| where | agrees | paper's fault | ours |", "|---|---|---|---|"]
    for where in dict.fromkeys(v.where for v in found if not v.text):
        own = [v for v in found if v.where == where and not v.text]
        paper = sum(not v.agrees and v.fault == "paper" for v in own)
        agree = sum(v.agrees for v in own)
        lines.append(f"| {where} | {agree} | {paper} | {len(own) - agree - paper} |")
    lines += ["", "K_l counts as equal within one step, numbers of steps within two.", ""]
    lines += ["| where | what the paper says | agrees | found |", "|---|---|---|---|"]
    for v in found:
        if v.text:
            verdict = "yes" if v.agrees else f"**no**, fault: {v.fault}"
            lines.append(f"| {v.where} | {v.text} | {verdict} | {v.found} |")
    return [*lines, ""]


# ------------------------------------------------------------------------------- entries
def _pair(where: str, run: Record | None, K: int, steps: int, key: str) -> Iterator[Verdict]:
    """K_l and a number of steps of one run."""
    yield Verdict(where, abs(run["K"] - K) <= NEAR["K"])
    yield Verdict(where, abs(run[key] - steps) <= NEAR["steps"])


def _table41(runs: Record, paper: Record) -> list[Verdict]:
    out = []
    for level, run in runs.items():
        ours = [f"{a}/{b}" for a, b in zip(run["normal"], run["tangential"], strict=True)][1:]
        theirs = paper[level].split()
        for k in range(max(len(ours), len(theirs))):
            out.append(Verdict("Table 4.1", ours[k : k + 1] == theirs[k : k + 1], "ours"))
    return out


def _table42(runs: Record, paper: Record) -> list[Verdict]:
    return [
        v for name, rows in runs.items() for level, run in rows.items()
        for v in _pair("Table 4.2", run, *paper[name][level], "cycles")
    ]  # fmt: skip


def _table43(runs: Record, paper: Record) -> list[Verdict]:
    out: list[Verdict] = []
    for c, rows in runs.items():
        for level, run in rows.items():
            if paper[c][level] is None:
                out += 2 * [Verdict("Table 4.3", not run["finished"])]
            else:
                out += _pair("Table 4.3", run, *paper[c][level], "cycles")
    return out


def _table51(runs: Record, paper: Record) -> list[Verdict]:
    return [
        v for name in ("zero", "nested") for level, run in runs[name].items()
        for v in _pair("Table 5.1", run, *paper[name][level], "steps")
    ]  # fmt: skip


def _table61(runs: Record, paper: Record) -> list[Verdict]:
    return [
        v for name in ("zero", "nested")
        for k, rows in enumerate(runs[name].values()) for level, run in rows.items()
        for v in _pair("Table 6.1", run, paper[name][level][k], paper[name][level][k + 3],
                       "steps")
    ]  # fmt: skip


ENTRIES: dict[str, Callable[[Any, Any], list[Verdict]]] = {
    "table4.1": _table41, "table4.2": _table42, "table4.3": _table43, "table5.1": _table51,
    "table6.1": _table61,
}  # fmt: skip


# ---------------------------------------------------------------------------- statements
@dataclass(frozen=True)
class Claim:
    """A sentence of the paper and what decides it; check: (holds, what was found)."""

    where: str
    text: str
    parts: tuple[str, ...]
    check: Callable[[Record], tuple[bool, str]]
    fault: str = "paper"


def _after_sets(record: Record) -> tuple[bool, str]:
    more = [run["steps"] - run["K"] for k, run in record["table4.1"].items() if k != "0"]
    return 2 <= min(more) and max(more) <= 5, f"{min(more)} to {max(more)} more"


def _other_modifications(record: Record) -> tuple[bool, str]:
    first = record["table4.1"]
    off, same = [], True
    for kind in ("second", "third"):
        for level, run in record["readings"][kind].items():
            off.append(abs(run["steps"] - first[level]["steps"]))
            last = [(r["normal"][-1], r["tangential"][-1]) for r in (run, first[level])]
            same &= last[0] == last[1]
    return same and max(off) <= 1, f"the same sets, at most {max(off)} step apart"


def _nodal(record: Record) -> tuple[bool, str]:
    runs = record["readings"]["nodal bound"]
    level = max(runs, key=int)
    ours = f"{runs[level]['normal'][-1]}/{runs[level]['tangential'][-1]}"
    known = record["table4.1"][level]
    theirs = f"{known['normal'][-1]}/{known['tangential'][-1]}"
    return ours == theirs, f"level {level}: {ours}; the dual basis function gives {theirs}"


def _ended(runs: Record) -> str:
    return f"{sum(run['finished'] for run in runs.values())} of {len(runs)} runs end"


def _unmodified(record: Record) -> tuple[bool, str]:
    runs = record["section3"]["(3.5b) as it stands"]["zero"]
    modified = record["section3"]["(3.11)"]["zero"]
    holds = not any(r["finished"] for r in runs.values())
    holds &= all(r["finished"] for r in modified.values())
    return holds, f"(3.5b) from zero: {_ended(runs)}; (3.11): {_ended(modified)}"


def _quotient(record: Record) -> tuple[bool, str]:
    runs, product = record["section3"]["(3.14)"]["far"], record["section3"]["(3.11)"]["far"]
    holds = sum(r["finished"] for r in runs.values()) < sum(
        r["finished"] for r in product.values()
    )
    return holds, f"from far, (3.14): {_ended(runs)}; (3.1): {_ended(product)}"


def _inexact_sets(record: Record) -> tuple[bool, str]:
    runs = record["table4.2"]
    off = [abs(run["K"] - runs["inexact"][k]["K"]) for k, run in runs["exact"].items()]
    return max(off) <= 1, f"at most {max(off)} apart" if max(off) else "in the same step"


def _nested_cycles(record: Record) -> tuple[bool, str]:
    runs = record["table4.2"]
    both = [(runs["nested"][k]["cycles"], run["cycles"]) for k, run in runs["inexact"].items()]
    return all(a < b for a, b in both), ", ".join(f"{a} for {b}" for a, b in both)


def _any_c(record: Record) -> tuple[bool, str]:
    runs = {c: rows for c, rows in record["table4.3"].items() if float(c) >= 10}
    off = 0
    for level in next(iter(runs.values())):
        counts = [rows[level]["cycles"] for rows in runs.values()]
        off = max(off, max(counts) - min(counts))
    return off <= 2, f"c_tau from 10 to 10 000: at most {off} cycle apart"


def _small_c(record: Record) -> tuple[bool, str]:
    p = record["parameters"]
    told = f"level {p['level']}: c_n = 0.01 " + (
        "ends" if p["c_n = 0.01"]["finished"] else "runs in circles"
    )
    small = p["c_tau = 0.01"]
    return not p["c_n = 0.01"]["finished"], (
        f"{told}; c_tau = 0.01 in {small['cycles']} cycles with K_l {small['K']}"
    )


def _scaling(record: Record) -> tuple[bool, str]:
    p = record["parameters"]
    forces, tractions = p["c_n = 100"]["cycles"], p["c = 100 D_p"]["cycles"]
    told = f"{forces} cycles with c = 100 for forces, {tractions} with it for tractions"
    return forces < tractions, f"level {p['level']}: {told}"


def _superlinear(record: Record) -> tuple[bool, str]:
    worst = 0.0
    for run in record["figure4.3"].values():
        last = [x for x in run["changes"] if x > 1e-13][-3:]
        worst = max(worst, last[-1] / last[-2])
    return worst < 0.1, f"last change at most {worst:.1e} times the one before"


def _alpha(record: Record) -> tuple[bool, str]:
    at = {
        name: next(k for k, a in enumerate(run["alpha"], 1) if a > 0.99)
        for name, run in record["figure4.3"].items()
    }
    steps = {name: run["steps"] for name, run in record["figure4.3"].items()}
    holds = at["third"] < min(at["first"], at["second"])
    holds &= steps["third"] > max(steps["first"], steps["second"])
    told = ", ".join(f"{name} {k} (of {steps[name]})" for name, k in at.items())
    return holds, f"alpha > 0.99 from step: {told}"


def _same_alpha(record: Record) -> tuple[bool, str]:
    one, two = (record["figure4.3"][name]["alpha"] for name in ("first", "second"))
    off = max(abs(a - b) for a, b in zip(one, two, strict=False))
    return off < 0.15, f"at most {off:.2f} apart"


def _beta(record: Record) -> tuple[bool, str]:
    one, two = (record["figure4.3"][name]["beta"] for name in ("first", "second"))
    told = ", ".join(f"{a:.2f}/{b:.2f}" for a, b in zip(one[:4], two[:4], strict=True))
    return all(a >= b - 1e-3 for a, b in zip(one, two, strict=False)), f"first/second: {told}"


def _any_level(record: Record) -> tuple[bool, str]:
    counts = [run["steps"] for run in record["table5.1"]["zero"].values()]
    return max(counts) <= 1.5 * min(counts), f"{min(counts)} to {max(counts)} steps"


def _nested_sets(record: Record) -> tuple[bool, str]:
    both = [
        (record["table5.1"]["nested"][k]["K"], run["K"])
        for k, run in record["table5.1"]["zero"].items() if k != "0"
    ]  # fmt: skip
    return all(a < b for a, b in both), ", ".join(f"{a} for {b}" for a, b in both)


def _singular(record: Record) -> tuple[bool, str]:
    sizes = [run["corner"] for run in record["table5.1"]["zero"].values()][1:]
    told = ", ".join(f"{x:.0f}" for x in sizes)
    grows = all(b > 1.1 * a for a, b in zip(sizes, sizes[1:], strict=False))
    return grows, f"|lambda| there on level 1, 2, …: {told}"


def _costly(record: Record) -> tuple[bool, str]:
    one, whole = (record["strategies"][n] for n in ("m = k_f = 1", "m = k_f = inf"))
    level = max(one, key=int)
    ended = all(run["finished"] for run in whole.values())
    told = f"level {level}: {whole[level]['cycles']} cycles for {one[level]['cycles']}"
    return ended and whole[level]["cycles"] > one[level]["cycles"], told


def _sticking(record: Record) -> tuple[bool, str]:
    runs = record["table6.1"]["zero"]
    counts = [rows[max(rows, key=int)]["counts"]["stick"] for rows in runs.values()]
    told = ", ".join(f"{n} for F = {mu}" for mu, n in zip(runs, counts, strict=True))
    return counts == sorted(counts), told


def _like_the_cube(record: Record) -> tuple[bool, str]:
    steps = [
        run["steps"] for rows in record["table6.1"]["zero"].values() for run in rows.values()
    ]
    return max(steps) <= 50, f"k_max {min(steps)} to {max(steps)} on all levels"


def _shells(record: Record) -> dict[str, dict[str, Record]]:
    """Figure 7.3 as {level: {friction: runs}}, the finest level last."""
    out: dict[str, dict[str, Record]] = {}
    for name, both in sorted(record["figure7.3"].items()):
        _, level, friction = name.split(", ")
        out.setdefault(level, {})[friction] = both
    return out


def _half_of(both: Record) -> tuple[bool, str]:
    newton, fixed = both["newton"]["steps"], both["fixed-point"]["steps"]
    return newton <= fixed / 2 + 1, f"{newton} for {fixed}"


def _half_on_the_shell(friction: str) -> Callable[[Record], tuple[bool, str]]:
    def check(record: Record) -> tuple[bool, str]:
        stored = [(level, runs) for level, runs in _shells(record).items() if friction in runs]
        level, runs = stored[-1]
        holds, told = _half_of(runs[friction])
        return holds, f"{level}: {told}"

    return check


def rate(both: Record) -> float:
    """Of the fixed point, from its last five changes."""
    tail = both["fixed-point"]["changes"][-5:]
    return (tail[-1] / tail[0]) ** (1 / (len(tail) - 1))


def _rate(record: Record) -> tuple[bool, str]:
    found = rate(record["ring"])
    return abs(found - 0.3) < 0.05, f"{found:.2f}"


def _independent(record: Record) -> tuple[bool, str]:
    whole = {level: runs for level, runs in _shells(record).items() if len(runs) == 3}
    counts = {
        level: [both["newton"]["steps"] for both in runs.values()]
        for level, runs in whole.items()
    }
    told = "; ".join(f"{level}: {', '.join(map(str, k))}" for level, k in counts.items())
    holds = all(max(k) - min(k) <= 2 for k in counts.values())
    return holds, f"{told} steps for F = 0.2, 0.4, 0.6"


def _newton_ends(record: Record) -> tuple[bool, str]:
    runs = [both["newton"] for both in (record["ring"], *record["figure7.3"].values())]
    ratios = [run["changes"][-1] / run["changes"][-2] for run in runs]
    return max(ratios) < 0.1, f"last change at most {max(ratios):.1e} times the one before"


CLAIMS = (
    Claim("2.2", "the discrete Tresca bound is the integral of g times phi_p",
          ("table4.1", "readings"), _nodal),
    Claim("2.2", "multipliers times D_p give better rates of the inexact method",
          ("parameters",), _scaling),
    Claim("3.2", "the scaling of the Robin condition is essential", ("section3",), _unmodified,
          "ours"),
    Claim("3.4", "(3.1) is more robust than (3.14)", ("section3",), _quotient, "ours"),
    Claim("4.1", "about 3-4 more steps once the sets are found", ("table4.1",), _after_sets),
    Claim("4.1", "minor differences with the second and third modification",
          ("table4.1", "readings"), _other_modifications, "ours"),
    Claim("4.1", "figure 4.3: superlinear for all modifications", ("figure4.3",), _superlinear,
          "ours"),
    Claim("4.1", "figure 4.3: alpha of the third tends faster to 1, its convergence is slower",
          ("figure4.3",), _alpha, "ours"),
    Claim("4.1", "figure 4.3: alpha of the first and second almost the same", ("figure4.3",),
          _same_alpha, "ours"),
    Claim("4.1", "figure 4.3: beta of the first is better than of the second", ("figure4.3",),
          _beta, "ours"),
    Claim("4.1", "exact and inexact find the sets in almost the same step", ("table4.2",),
          _inexact_sets, "ours"),
    Claim("4.1", "nested needs fewer multigrid steps", ("table4.2",), _nested_cycles, "ours"),
    Claim("4.1", "independent of c_tau where it is large enough", ("table4.3",), _any_c,
          "ours"),
    Claim("4.1", "too small a c does not converge (c_n as c_tau)", ("parameters",), _small_c,
          "ours"),
    Claim("5", "m = k_f = infinity is rather costly", ("strategies",), _costly, "ours"),
    Claim("5.1", "K_l and k_max almost independent of the level", ("table5.1",), _any_level,
          "ours"),
    Claim("5.1", "nested finds the sets earlier", ("table5.1",), _nested_sets, "ours"),
    Claim("5.1", "the solution has a singularity at (1, 1, 0)", ("table5.1",), _singular,
          "ours"),
    Claim("6", "fewer nodes stick with smaller F", ("table6.1",), _sticking, "ours"),
    Claim("6", "the same behaviour as for the cube", ("table6.1",), _like_the_cube, "ours"),
    Claim("7", "full Newton needs half of the steps: ring", ("ring",),
          lambda record: _half_of(record["ring"]), "ours"),
    Claim("7", "the rate of the fixed point tends to 0.3: ring", ("ring",), _rate, "ours"),
    *(
        Claim("7", f"the same behaviour (half of the steps): shell, F = {mu}", ("figure7.3",),
              _half_on_the_shell(f"F = {mu}"))
        for mu in (0.2, 0.4, 0.6)
    ),
    Claim("7", "full Newton is superlinear", ("ring", "figure7.3"), _newton_ends, "ours"),
    Claim("7", "full Newton does not depend on F", ("figure7.3",), _independent, "ours"),
)  # fmt: skip
