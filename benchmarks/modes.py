r"""Modes, flutter and divergence of sliding states against closed forms.

    python benchmarks/modes.py [--sets 100] [--seed 0]

**Mode coupling** ([HFAG], two degrees of freedom): a mass on a belt, held by springs that give
K11, K12, K22, its contact by a spring k3; the friction of a sliding belt makes K12 - mu k3 of
one of the two.  With C = diag(c1, c2) and k = K22 + k3

    s^4 + (c1 + c2) s^3 + (K11 + k + c1 c2) s^2 + (c1 k + c2 K11) s
        + K11 k - K12 (K12 - mu k3) = 0,                                                    (1)

without damping -2 s^2 = K11 + k +- sqrt((K11 - k)^2 + 4 K12 (K12 - mu k3)), so that flutter
begins where the root is zero, at s^2 = -(K11 + k) / 2, and divergence where the last term of
(1) is.  With damping it begins where a3 a2 a1 = a1^2 + a3^2 a0 (Routh and Hurwitz), a linear
equation for mu.  Roots of (1) are those of its companion matrix, with steps of Newton's method.

**Beams** of length, stiffness E I and mass 1 (Euler and Bernoulli), by polynomials of degree
21; omega = b^2, and (k pi)^2 on two sliding supports; tan b = tanh b clamped and supported; on
a support of stiffness k, clamped elsewhere,

    b^3 (1 + cos b cosh b) = k (cos b sinh b - sin b cosh b)              ([B], chapter 8).

With C = p M + q K and rigid supports, s^2 + (p + q omega^2) s + omega^2 = 0.

**Inclined support**: a clamped beam with E A = e, whose end slides on a plane with the normal
n = (a, b), a along the deflection w, b along the beam (u), t = (b, -a).  A force at the end
moves it by G_w = (sin b cosh b - cos b sinh b) / (b^3 (1 + cos b cosh b)) and G_u = tan(g) /
(g e), g = omega / sqrt(e).  The end may not move along n, and the force is along n - mu t, so

    mu = (a^2 G_w + b^2 G_u) / (a b (G_w - G_u)),                                           (2)

all frequencies for a friction; flutter begins where mu of (2) is largest, divergence is its
limit for omega = 0, G_w = 1/3, G_u = 1 / e.  (From the receptances of [B]; ours.)

**Sparse**: many models of (1) side by side, of more unknowns than are taken at once: modes near
a frequency by shift and invert, and flutter up to the frequency that `flutter` tells.
**Elements**: beams of cubic elements, whose sines at the nodes are modes of the discrete beam
too, a problem of two by two for each: what a mesh adds is told from what rounding does to it.

**Disc and two pads** of docs/gallery/questions/plot_squeal.py, coarse and fine; nothing of it
is known in closed form: what modes leave of their equations is shown, and which grow.

[HFAG] N. Hoffmann, M. Fischer, R. Allgaier, L. Gaul, "A minimal model for studying properties
of the mode-coupling type instability in friction induced oscillations", Mech. Res. Commun. 29
(2002) 197-205.  [B] R. D. Blevins, "Formulas for natural frequency and mode shape" (1979).

Writes results/modes.md beside this file.
"""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np
from machine import describe
from modes_beams import beam_rows, element_rows, inclined_rows
from modes_disc import disc_rows
from scipy import sparse

import amontons as am

Array = np.ndarray
RESULTS = Path(__file__).parent / "results"


# ------------------------------------------------------------------------ mode coupling
@dataclass(frozen=True)
class Coupled:
    """The model of (1)."""

    K11: float
    K12: float
    K22: float
    k3: float
    c1: float = 0.0
    c2: float = 0.0

    @classmethod
    def random(cls, random: np.random.Generator, sign: int, *, damped: bool) -> Coupled:
        """Any definite stiffness; friction lets modes meet with K12 > 0, else one diverges."""
        A = random.standard_normal((2, 2))
        K = A @ A.T + random.uniform(0.05, 1) * np.eye(2)
        K[0, 1] = abs(K[0, 1]) + 0.05 * np.sqrt(K[0, 0] * K[1, 1])
        K *= 10.0 ** random.uniform(-3, 6) * np.trace(K) ** -1
        size = np.sqrt(K[0, 0])
        c = random.uniform(0.002, 0.1, 2) * size if damped else (0.0, 0.0)
        if K[0, 1] ** 2 >= K[0, 0] * K[1, 1]:
            K[1, 1] = 2 * K[0, 1] ** 2 / K[0, 0]
        return cls(K[0, 0], sign * K[0, 1], K[1, 1], K[1, 1] * random.uniform(0.2, 3), *c)

    @property
    def flutter(self) -> float:
        """Where the two modes without damping meet."""
        return (self.K12 + (self.K11 - self.K22 - self.k3) ** 2 / (4 * self.K12)) / self.k3

    @property
    def meets(self) -> float:
        """Their frequency there."""
        return float(np.sqrt((self.K11 + self.K22 + self.k3) / 2) / (2 * np.pi))

    @property
    def divergence(self) -> float:
        """Where the stiffness is singular; < 0 for never."""
        k = self.K22 + self.k3
        return (self.K12**2 - self.K11 * k) / (self.K12 * self.k3)

    @property
    def onset(self) -> float:
        """Where flutter begins with damping."""
        a3, a2, a1, a0 = self.coefficients(0.0)
        return (a1 * (a3 * a2 - a1) / a3**2 - a0) / (self.K12 * self.k3)

    def coefficients(self, mu: float) -> tuple[float, float, float, float]:
        """a3 to a0 of (1)."""
        c1, c2, k = self.c1, self.c2, self.K22 + self.k3
        return (c1 + c2, self.K11 + k + c1 * c2, c1 * k + c2 * self.K11,
                self.K11 * k - self.K12 * (self.K12 - mu * self.k3))  # fmt: skip

    def roots(self, mu: float) -> Array:
        """s of (1) with Im s >= 0."""
        a3, a2, a1, a0 = (np.longdouble(a) for a in self.coefficients(mu))
        s = np.roots([1, *self.coefficients(mu)]).astype(np.clongdouble)
        for _ in range(8):
            value = (((s + a3) * s + a2) * s + a1) * s + a0
            s = s - value / (((4 * s + 3 * a3) * s + 2 * a2) * s + a1)
        s = np.where(np.abs(s.imag) <= 1e-15 * np.abs(s), s.real + 0j, s)
        return s[s.imag >= 0].astype(complex)

    def matrices(self) -> tuple[Array, Array]:
        """(K, C), the unknowns along the belt and away from it."""
        return (np.array([[self.K11, self.K12], [self.K12, self.K22]]),
                np.diag([self.c1, self.c2]))  # fmt: skip


def side_by_side(models: list[Coupled], mu: float) -> am.FrictionSolution:
    """Each on a belt of its own, pressed by what its contact's spring takes."""
    n = len(models)
    K = sparse.block_diag([m.matrices()[0] for m in models], format="csc")
    H = sparse.block_diag([np.array([[0.0, 1.0], [1.0, 0.0]])] * n, format="csc")
    load = np.array([[0.0, -m.k3] for m in models]).ravel()
    speed = 1e3 * np.abs(load).max() / min(m.k3 for m in models)
    law = am.Compliant(am.Coulomb([mu] * n), [1 / m.k3 for m in models])
    problem = am.FrictionProblem.from_global(K, H, load, [[0.0, speed]] * n, law)
    return am.solve(problem, tolerance=1e-12)


def modes_of(models: list[Coupled], mu: float, **given: Any) -> am.Modes:
    """Of models side by side at a friction."""
    n = 2 * len(models)
    C = sparse.block_diag([m.matrices()[1] for m in models], format="csc")
    return am.modes(side_by_side(models, mu), mass=sparse.eye_array(n, format="csc"),
                    damping=C if abs(C).max() > 0 else None, **given)  # fmt: skip


def apart(found: Array, wanted: Array) -> float:
    """The largest distance of wanted numbers from found ones, relative."""
    near = np.abs(np.asarray(found)[:, None] - wanted).min(axis=0)
    return float((near / np.abs(wanted)).max(initial=0.0))


def coupled_row(name: str, models: list[Coupled], *, damped: bool) -> str:
    """Modes at six frictions, verdicts around the one where flutter begins, points."""
    modes, verdicts, flutter, meets, divergence, diverging, asked = 0.0, 0, 0.0, 0.0, 0.0, 0, 0
    for model in models:
        flutters = model.K12 > 0
        begins = (model.onset if damped else model.flutter) if flutters else model.divergence
        for share in (0.1, 0.5, 0.9, 0.999, 1.001, 1.5):
            mu = begins * share
            if not 0 < mu < 100 or (share > 1 and not flutters):
                continue  # beyond divergence nothing slides in balance
            found, wanted = modes_of([model], mu), model.roots(mu)
            if not found.state.sliding:
                continue  # another solution, which sticks
            modes = max(modes, apart(found.s, wanted), apart(wanted, found.s))
            verdicts += found.stable != (share < 1)
            asked += 1
        at = modes_of([model], 0.5 * min(begins, 2.0))
        points = at.flutter()
        if not flutters:
            flutter = np.inf if points else flutter
        elif len(points) == 1:
            flutter = max(flutter, abs(points[0].mu / model.flutter - 1))
            meets = max(meets, abs(points[0].frequency / model.meets - 1))
        else:
            flutter = np.inf
        root = model.divergence
        wanted = np.array([root] if root > 0 else [])
        diverging += len(wanted)
        if len(wanted) != len(at.divergence):
            divergence = np.inf
        divergence = max(divergence, apart(at.divergence, wanted) if len(wanted) else 0.0)
    last = f"{divergence:.0e}" if diverging or divergence else "none, rightly"
    if not any(m.K12 > 0 for m in models):
        return (f"| {name} | {len(models)} | {asked} | {modes:.0e} | {verdicts} | "
                f"{'told' if flutter else 'none, rightly'} | | {last} |")  # fmt: skip
    return (f"| {name} | {len(models)} | {asked} | {modes:.0e} | {verdicts} | {flutter:.0e} | "
            f"{meets:.0e} | {last} |")  # fmt: skip


def coupling(random: np.random.Generator, sets: int) -> list[str]:
    """Rows of the model of [HFAG]: its own numbers, others at random, with damping."""
    first, second = np.radians(150), np.radians(35)
    K11, K12, K22 = (
        11 * f(first) * g(first) + 20 * f(second) * g(second)
        for f, g in ((np.cos, np.cos), (np.cos, np.sin), (np.sin, np.sin))
    )
    plain, damped, turning = (
        [Coupled.random(random, sign, damped=c) for _ in range(sets)]
        for sign, c in ((1, False), (1, True), (-1, False))
    )
    return [
        coupled_row("of the paper", [Coupled(K11, K12, K22, 11.0)], damped=False),
        coupled_row("the same, damped", [Coupled(K11, K12, K22, 11.0, 0.02, 0.3)], damped=True),
        coupled_row("random", plain, damped=False),
        coupled_row("random, damped", damped, damped=True),
        coupled_row("random, K12 < 0", turning, damped=False),
    ]


# ------------------------------------------------------------------------------ sparse
def spread(random: np.random.Generator, count: int, *, damped: bool) -> list[Coupled]:
    """Models whose frequencies rise like 1, 2, 3 ..., as those of one body do."""
    out = []
    for i in range(1, count + 1):
        K12, K11 = random.uniform(0.05, 0.5), random.uniform(1, 4)
        K22, k3 = random.uniform(0.5, 2, 2)
        c = i * random.uniform(0.002, 0.02, 2) if damped else (0.0, 0.0)
        out.append(Coupled(K11 * i**2, K12 * i**2, K22 * i**2, k3 * i**2, *c))
    return out


def sparse_row(random: np.random.Generator, count: int, *, damped: bool) -> str:
    """Eight modes near frequencies, against the nearest of all of (1); all points in reach."""
    models, worst, missed, mu = spread(random, count, damped=damped), 0.0, 0, 0.02
    every = np.concatenate([m.roots(mu) for m in models])
    nears = (0.0, 0.5, 5.0, 20.0)
    for near in nears:
        found = modes_of(models, mu, count=8, near=near)
        order = np.argsort(np.abs(every - 2j * np.pi * near))
        wanted = every[order[:8]]
        worst = max(worst, apart(every, found.s), apart(found.s, wanted))
        missed += sum(apart(found.s, one[None]) > 1e-6 for one in wanted)
    points = modes_of(models, mu, count=8).flutter(count)
    begins = np.array([m.flutter for m in models])
    inside = begins[[m.meets <= points.up_to for m in models]]
    told = np.array([p.mu for p in points])
    flutter = max(apart(told, inside), apart(begins, told)) if len(told) else np.inf
    return (f"| {count} | {2 * count} | {'yes' if damped else 'no'} | {8 * len(nears)} | "
            f"{missed} | {worst:.0e} | {points.up_to:.3f} | {len(inside)} | {len(told)} | "
            f"{flutter:.0e} |")  # fmt: skip


# ----------------------------------------------------------------------------- the page
def shown(rows: Iterable[str]) -> Iterator[str]:
    """Rows, printed as soon as they are there."""
    for row in rows:
        print(row, flush=True)
        yield row


def main() -> None:
    """All tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sets", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0)
    asked, began = parser.parse_args(), time.process_time()
    random, where = np.random.default_rng(asked.seed), describe()
    lines = [
        "# Modes of sliding states against closed forms", "",
        f"`python benchmarks/modes.py --sets {asked.sets} --seed {asked.seed}`, "
        f"{where['cpu']}, Python {where['python']}. Formulas and sources: the script. Numbers "
        "are the largest relative errors.", "",
        "## Mode coupling, two degrees of freedom", "",
        "Modes at .1 to 1.5 of the friction at which they begin to grow, .999 and 1.001 among "
        "them; wrong: verdicts on stability.", "",
        "| parameters | sets | frictions | modes | wrong | flutter friction | its frequency | "
        "divergence |", "|---|---|---|---|---|---|---|---|",
        *shown(coupling(random, asked.sets)), "",
        "## Beams on sliding supports, friction .3", "",
        "| beam | modes | frequencies | with damping |", "|---|---|---|---|",
        *shown(beam_rows()), "",
        "## A clamped beam on an inclined sliding support", "",
        "Bending and stretching, coupled by friction alone: the first six frequencies, and "
        "where they meet, of those that the polynomials resolve.", "",
        "| inclination | E A | frictions | frequencies | flutter at, by (2) | flutter friction "
        "| its frequency | divergence |", "|---|---|---|---|---|---|---|---|",
        *shown(inclined_rows()), "",
        "## Sparse systems", "",
        "Eight modes near each of four frequencies of many models side by side; missed: of "
        "those that are nearest.  Flutter is looked for up to a frequency that is told.", "",
        "| models | unknowns | damped | modes | missed | error | looked up to, Hz | points "
        "there | told | flutter friction |", "|---|---|---|---|---|---|---|---|---|---|",
        *shown(sparse_row(random, n, damped=d) for n in (250, 600) for d in (False, True)), "",
        "## Cubic elements", "",
        "A beam on two sliding supports, four modes: against the modes of the discrete beam, "
        "and those of the beam; eps cond: what rounding of the entries of K may do to the "
        "first one. Mode j of n elements is (j pi / n)^4 / 1440 above that of the beam (8e-8 "
        "for mode 2 of 60): what `modes` adds is the distance from the discrete beam.",
        "", "| elements | system | against discrete | against the beam, modes 1 and 2 | "
        "eps cond |",
        "|---|---|---|---|---|", *shown(element_rows()), "",
        "## Disc and two pads", "",
        "Radii 40 and 150 mm, 20 mm thick, held at its inner rim; pads from 95 to 132 mm over "
        "60 degrees, 15 mm thick. E 200 GPa, nu .3, 7850 kg/m3, friction .3 (those of td-1; "
        "its mesh and its geometry are not at hand, so that 6474 Hz can not be compared). "
        "Eight modes near 6474 Hz; left: of their equations, relative to the largest term.", "",
        "| unknowns | speed, rad/s | modes that grow | Hz | damping | left | s |",
        "|---|---|---|---|---|---|---|", *shown(disc_rows()), "",
    ]  # fmt: skip
    lines += [f"{time.process_time() - began:.0f} CPU s, with what was compiled.", ""]
    text = "\n".join(lines)
    (RESULTS / "modes.md").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
