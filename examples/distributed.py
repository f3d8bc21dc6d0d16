"""Contact on several processes: the stiffness is spread over them, PETSc solves.

    mpirun -n 4 python distributed.py blocks --level 4

needs the extra `distributed`, see docs/distributed.md.  "cube": one block dragged over a rigid
plane; "blocks": two blocks whose meshes do not match.  --save writes the displacements and
reactions, --serial solves on one process without PETSc, to compare.
"""

import argparse
import json
import time

import numpy as np

import amontons as am


def cube(level):
    """The cube of Hüeber, Stadler and Wohlmuth (2008), section 5.1: 2^level cells an edge."""
    block = am.Body(am.box((1, 1, 1), cells=2**level), am.LinearElastic(young=200, poisson=0.3))
    return am.Model(
        [block],
        supports=[am.Fix("top", lambda x: (0, 0.2, 0.06 - 0.15 * x[0]))],
        contacts=[am.Contact("bottom", am.Plane(normal=(0, 0, 1)), mu=1.0)],
    )


def blocks(level):
    """A block pressed on a wider and softer one and pushed sideways, dual mortar."""
    lower = am.box((1.5, 1.5, 0.5), cells=(3 * 2 ** (level - 1),) * 2 + (2 ** (level - 1),))
    upper = am.box((1, 1, 0.5), cells=(2**level, 2**level, 2 ** (level - 1)),
                   kind="tet", origin=(0.2, 0.3, 0.5))  # fmt: skip
    return am.Model(
        [
            am.Body(upper, am.LinearElastic(young=300, poisson=0.3), "upper"),
            am.Body(lower, am.LinearElastic(young=100, poisson=0.2), "lower"),
        ],
        supports=[
            am.Fix("upper.top", lambda x: (0.02, 0.005, -0.03 + 0.02 * x[0])),
            am.Fix("lower.bottom", (0, 0, 0)),
        ],
        contacts=[am.Contact("upper.bottom", master="lower.top", mu=0.4, method="mortar")],
    )


def work(model):
    """Solve and return what one wants to know; runs on the first process."""
    started = time.perf_counter()
    problem = model.assemble()
    solution = am.drive(problem, am.CompressedDelassus(), tolerance=1e-9)
    fields = model.recover(solution)
    return {
        "unknowns": problem.unknowns,
        "contacts": problem.contacts,
        "outcome": solution.convergence.outcome.name.lower(),
        "error": solution.convergence.error,
        "counts": solution.counts,
        "resultant": fields.resultant.tolist(),
        "linear iterations": problem.factor().iterations,
        "seconds": time.perf_counter() - started,
    }, solution


def main():
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("case", choices=("cube", "blocks"))
    parser.add_argument("--level", type=int, default=3)
    parser.add_argument("--serial", action="store_true")
    parser.add_argument("--save", help="an .npz file for v and r")
    given = parser.parse_args()
    model = {"cube": cube, "blocks": blocks}[given.case](given.level)
    found = work(model) if given.serial else am.distributed(model, work)
    if found is None:  # not the first process
        return
    record, solution = found
    print(json.dumps(record))
    if given.save:
        np.savez(given.save, v=solution.v, r=solution.r)


if __name__ == "__main__":
    main()
