"""Contact on several processes: each holds a part of the mesh, PETSc solves.

    mpirun -n 4 python distributed.py blocks --level 4

needs the extra `distributed`, see docs/distributed.md.  "cube": one block dragged over a rigid
plane, of hexahedra, or "tets"; "blocks": two blocks whose meshes do not match.  --save writes
displacements and reactions, gathered, --write parts for ParaView.
"""

import argparse
import json
import time

import numpy as np

import amontons as am


def cube(level, kind="hex"):
    """The cube of Hüeber, Stadler and Wohlmuth (2008), section 5.1: 2^level cells an edge."""
    mesh = am.box((1, 1, 1), cells=2**level, kind=kind)
    block = am.Body(mesh, am.LinearElastic(young=200, poisson=0.3))
    return am.Model(
        [block],
        supports=[am.Fix("top", lambda x: (0, 0.2, 0.06 - 0.15 * x[0]))],
        contacts=[am.Contact("bottom", am.Plane(normal=(0, 0, 1)), mu=1.0)],
    )


def tets(level):
    """The same of tetrahedra."""
    return cube(level, "tet")


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


CASES = {"cube": cube, "tets": tets, "blocks": blocks}


def main():
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("case", choices=CASES)
    parser.add_argument("--level", type=int, default=3)
    parser.add_argument("--tolerance", type=float, default=1e-8)
    parser.add_argument("--save", help="an .npz file for v, r and u")
    parser.add_argument("--write", help="a .pvtu file for ParaView")
    given = parser.parse_args()
    started = time.perf_counter()
    solution = am.distributed(  # all processes call it; the first one makes the mesh
        lambda: CASES[given.case](given.level), tolerance=given.tolerance
    )
    seconds = time.perf_counter() - started
    if given.write:
        solution.write(given.write)
    whole = solution.gather() if given.save else None
    if solution.comm.rank:
        return
    print(json.dumps({
        "converged": solution.converged, "error": solution.error, "counts": solution.counts,
        "resultant": solution.resultant.tolist(), "newton steps": solution.steps,
        "linear iterations": solution.iterations, "seconds": seconds,
    }))  # fmt: skip
    if whole is not None:
        np.savez(given.save, v=np.concatenate(whole.displacement), r=whole.r, u=whole.u)


if __name__ == "__main__":
    main()
