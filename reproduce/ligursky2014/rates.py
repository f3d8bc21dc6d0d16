"""Section 3.1.1: propositions 7, 8 and 9 on random first-order systems, and many contacts.

Contacts of all kinds of (25) meet in random problems with little and much friction.  What the
conditions say of existence, uniqueness and rank is held against all tangents, which enumeration
of all pieces finds.
"""

from __future__ import annotations

from typing import Any

import numpy as np

import amontons as am

PROBLEMS = 200
FRICTION = (0.1, 0.5, 1.0, 2.5)
AT_BORDER = ("impending", "grazing", "grazing with slip", "at rest")
INSIDE = ("free", "stick", "slip")
MANY = 20
NO_CHANGE = 1e-9  # of the parameter
Row = dict[str, Any]


def random_problem(
    kinds: list[str], friction: float, rng: np.random.Generator
) -> tuple[am.FrictionProblem, am.FrictionProblem, np.ndarray]:
    """(problem at p = 0, problem at 1, reactions at 0): contacts of given kinds at p = 0."""
    n = len(kinds)
    factor = rng.standard_normal((2 * n, 2 * n + 1))
    W = factor @ factor.T / (2 * n) + 0.05 * np.eye(2 * n)
    mu = friction * rng.uniform(0.5, 1.5, n)
    mu[[kind == "grazing" for kind in kinds]] = 0.0
    r, u = np.zeros((n, 2)), np.zeros((n, 2))
    for i, kind in enumerate(kinds):
        sign = rng.choice([-1.0, 1.0])
        if kind in ("stick", "slip", "impending"):
            r[i, 0] = rng.uniform(0.5, 2)
            share = rng.uniform(0, 0.9) if kind == "stick" else 1.0
            r[i, 1] = sign * share * mu[i] * r[i, 0]
        if kind == "free":
            u[i] = rng.uniform(0.5, 2), rng.standard_normal()
        if kind in ("slip", "grazing with slip"):
            u[i, 1] = -sign * rng.uniform(0.5, 2)
    q = u - (W @ r.ravel()).reshape(n, 2)
    first, last = (am.FrictionProblem.from_delassus(W, x, mu)
                   for x in (q, q + rng.standard_normal((n, 2))))  # fmt: skip
    return first, last, r


def tangents(first: am.FrictionProblem, last: am.FrictionProblem, r: np.ndarray) -> Any:
    """(all one-sided tangents, the complementarity problem of their rates)."""
    system = am.first_order(last, base=first, start=r, at=0.0)
    path = system.problem
    return system, path.contact_rates(path.state(r), 0.0)


def rows() -> list[Row]:
    """What was claimed, and what enumeration says."""
    rng = np.random.default_rng(0)
    counts = {"existence": [0, 0], "uniqueness": [0, 0], "full_rank": [0, 0]}
    missed = unlike = 0
    for k in range(PROBLEMS):
        kinds = [*rng.choice(AT_BORDER, rng.integers(1, 5)),
                 *rng.choice(INSIDE, rng.integers(0, 4))]  # fmt: skip
        system, rates = tangents(*random_problem(kinds, FRICTION[k % 4], rng))
        found = {s: [t for t in system.tangents if s * t.rate > NO_CHANGE] for s in (1, -1)}
        searched = {s: len(rates.solutions(s)) for s in (1, -1)}
        unlike += any(searched[s] != len(found[s]) for s in (1, -1))
        missed += not rates.solutions(1).finished
        wrong = {
            "existence": any(not one for one in found.values()),
            "uniqueness": any(len(one) > 1 for one in found.values()),
            "full_rank": bool(system.sets),
        }
        for claim, (_, _) in counts.items():
            if getattr(rates, claim) is am.Claim.PROVED:
                counts[claim][0] += 1
                counts[claim][1] += wrong[claim]
    words = {"existence": "proposition 7: a tangent for both senses",
             "uniqueness": "proposition 8: one tangent at most for either sense",
             "full_rank": "proposition 9: full rank, no set of tangents"}  # fmt: skip
    out = [
        {"paper": words[claim], "holds in": f"{held} of {PROBLEMS}",
         "enumeration contradicts": wrong, "agrees": not wrong and held > 0}
        for claim, (held, wrong) in counts.items()
    ]  # fmt: skip
    out.append({"paper": "(35) and the first-order system have the same solutions",
                "holds in": f"{PROBLEMS - unlike} of {PROBLEMS}",
                "enumeration contradicts": unlike, "agrees": not unlike + missed})  # fmt: skip
    return [*out, many()]


def many() -> Row:
    """Twenty contacts at rest, where 4^20 pieces meet."""
    system, rates = tangents(
        *random_problem(["at rest"] * MANY, 0.6, np.random.default_rng(7))
    )
    examined = sum(rates.solutions(s).examined for s in (1, -1))
    senses = sorted(int(np.sign(t.rate)) for t in system.tangents)
    return {
        "paper": f"one tangent for either sense at {MANY} contacts at rest (little friction)",
        "holds in": f"{len(system.tangents)} tangents, all: {system.complete}; "
                    f"{examined} of 4^{MANY} patterns looked at",
        "enumeration contradicts": 0,
        "agrees": system.complete and senses == [-1, 1],
    }  # fmt: skip
