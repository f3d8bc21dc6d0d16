"""What a step of rigid bodies costs: seconds of the processor per step and per contact.

    python benchmarks/rigid_steps.py

Each case runs for a second first, in which kernels are compiled, then afresh until its end or
for 10 seconds.  Beside it the same steps with a solver that is asked for, `solver=am.Auto()`,
as all steps were solved before sweeps were tried first.  Ball and wall begin with the hardest
steps: an intact wall of 2200 contacts, four to a joint, more reactions than balances.  Writes
results/rigid_steps.md.
"""

import time
from collections import Counter
from pathlib import Path

import numpy as np
from machine import options

import amontons as am
from amontons.mechanics.multibody.quick import Found

FLOOR = am.Plane((0, 0, 1))
G, LONGEST = 9.81, 10.0
FIRST = 3  # steps at least: the first may meet nothing, and compile nothing


def sliding():
    """A box on a plane that is steeper than friction holds."""
    slope = np.arctan(0.3)
    box = am.RigidBody(am.cuboid((0.4, 0.4, 0.2)), position=(0, 0, 0.1))
    gravity = G * np.sin(slope), 0, -G * np.cos(slope)
    return am.RigidBodies([box], [FLOOR], mu=0.25, gravity=gravity), 1e-3, 2.0, 1e-6


def rocking():
    """A block of 0.2 x 1 that is let go tilted."""
    tilt = 0.1
    turn = np.array([[np.cos(tilt), 0, np.sin(tilt)], [0, 1, 0],
                     [-np.sin(tilt), 0, np.cos(tilt)]])  # fmt: skip
    at = np.array([0.1, 0, 0]) - turn @ [0.1, 0, -0.5]
    turned = np.cos(tilt / 2), 0, np.sin(tilt / 2), 0
    block = am.RigidBody(am.cuboid((0.2, 0.2, 1.0)), 2500, at, turned)
    return am.RigidBodies([block], [FLOOR], mu=2.0), 5e-4, 2.0, 1e-6


def dominoes():
    """Twelve in a row, the first pushed."""
    stones = [am.RigidBody(am.cuboid((0.02, 0.1, 0.2)), position=(0.1 * k, 0, 0.1),
                           spin=(0, 3.0 * (k == 0), 0)) for k in range(12)]  # fmt: skip
    return am.RigidBodies(stones, [FLOOR], mu=0.4), 1e-3, 1.5, 1e-5


def pile():
    """Twenty cubes that fall turned at random."""
    rng = np.random.default_rng(7)
    cubes = [am.RigidBody(am.cuboid((0.1, 0.1, 0.1)), orientation=rng.standard_normal(4),
                          position=(*rng.uniform(-0.08, 0.08, 2), 0.1 + 0.15 * k))
             for k in range(20)]  # fmt: skip
    return am.RigidBodies(cubes, [FLOOR], mu=0.5), 1e-3, 1.5, 1e-5


def wall():
    """Twenty courses of ten blocks, hit by a ball."""
    blocks = [am.RigidBody(am.cuboid((0.2, 0.1, 0.1)), 2000,
                           (0.2 * k + 0.1 * (row % 2), 0, 0.05 + 0.1 * row))
              for row in range(20) for k in range(10)]  # fmt: skip
    ball = am.RigidBody(am.Ball(0.1), 8000, (1.0, -0.17, 1.0), velocity=(0, 5, 0))
    return am.RigidBodies([*blocks, ball], [FLOOR], mu=0.6), 1e-3, 1.0, 1e-3


def arch():
    """Nine stones of a semicircle of 0.08 of its radius, which falls."""
    angles, stones = np.linspace(0, np.pi, 10), []
    for a, b in zip(angles, angles[1:], strict=False):
        ring = [(r * np.cos(t), r * np.sin(t)) for t in (a, b) for r in (0.96, 1.04)]
        points = [(x, y, z) for x, z in ring for y in (-0.2, 0.2)]
        stones.append(am.RigidBody(am.Polyhedron(points), 2000))
    return am.RigidBodies(stones, [FLOOR], mu=1.0), 1e-3, 1.0, 1e-4


def rocked():
    """A dry wall of six courses of six blocks, on ground that shakes with 0.4 g at 2 Hz."""
    blocks = [am.RigidBody(am.cuboid((0.2, 0.1, 0.1)), 2000,
                           (0.2 * k + 0.1 * (row % 2), 0, 0.05 + 0.1 * row))
              for row in range(6) for k in range(6)]  # fmt: skip

    def gravity(t):
        shake = 0.4 * G * np.sin(4 * np.pi * t)
        return 0.6 * shake, 0.8 * shake, -G

    return am.RigidBodies(blocks, [FLOOR], mu=0.6, gravity=gravity), 1e-3, 1.0, 1e-4


def steps_of(made, solver, longest):
    """Steps until the end or a limit of seconds, and seconds of the processor."""
    system, step, until, tolerance = made
    begin, steps, worst = time.process_time(), [], 0.0
    last = begin
    for each in am.evolve_rigid(
        system, step=step, until=until, tolerance=tolerance, solver=solver, check=False
    ):
        steps.append(each)
        now = time.process_time()
        worst, last = max(worst, now - last), now
        if now - begin > longest and len(steps) > FIRST:
            break
    return steps, time.process_time() - begin, worst


def row(make):
    """A line of the table, and what became of the solves."""
    before = []
    for solver in (am.Auto(), None):
        steps_of(make(), solver, 1.0)
        before.append(steps_of(make(), solver, LONGEST / 2 if solver else LONGEST))
    (theirs, general, _), (steps, seconds, worst) = before
    solved = [s for s in steps if s._solved is not None]
    contacts = np.mean([len(s.r) for s in steps])
    quick = sum(isinstance(s._solved, Found) for s in solved) / max(len(solved), 1)
    each = 1e3 * seconds / len(steps)
    ends = Counter(s.solution.convergence.outcome.name.lower() for s in solved)
    told = ", ".join(f"{count} {name.replace('_', ' ')}" for name, count in ends.most_common())
    status = Counter(am.ContactStatus(k).name.lower() for k in steps[-1].status)
    last = ", ".join(f"{count} {name}" for name, count in status.most_common())
    same = theirs[: len(steps)]
    slower = 1e3 * general / len(theirs)
    print(make.__name__, f"{each:.3f} ms, solvers {slower:.3f} ms over {len(same)}", flush=True)
    return (f"| {make.__doc__.rstrip('.')} | {len(steps)} | {contacts:.1f} | {each:.3f} | "
            f"{1e3 * each / max(contacts, 1):.0f} | {1e3 * worst:.1f} | {100 * quick:.0f} % | "
            f"{slower:.2f} ({len(theirs)}) | {told} | {last} |")  # fmt: skip


def main():
    """Run all cases, write the table."""
    options(__doc__).parse_args()
    rows = [row(make) for make in (sliding, rocking, dominoes, pile, arch, rocked, wall)]
    text = "\n".join([
        "# Steps of rigid bodies", "",
        "`python benchmarks/rigid_steps.py`: time of the processor, at most 10 s for each",
        "case; the longest step of all. Swept: steps that compiled sweeps solved alone.",
        "Solvers: the same with `solver=am.Auto()`, over as many steps as fit in five seconds;",
        "later steps of a motion may cost more.", "",
        "| case | steps | contacts | ms a step | us a contact | longest, ms | swept | "
        "solvers, ms (steps) | outcomes | contacts at the end |",
        "|---|---|---|---|---|---|---|---|---|---|", *rows, "",
    ])  # fmt: skip
    (Path(__file__).parent / "results" / "rigid_steps.md").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
