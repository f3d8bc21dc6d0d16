"""A tower of boxes, with friction from safe to slippery; saved for others as an FCLib file."""

import amontons as am
from amontons.mechanics.ready.gallery import box_tower


def main(frictions: tuple[float, ...] = (0.6, 0.3, 0.2)) -> list[str]:
    """Solve for some coefficients of friction; returns the status of all contacts for each."""
    problem = box_tower(boxes=4, push=0.25)
    am.write_fclib(problem, "tower.hdf5", title="tower of four boxes")
    patterns = []
    for mu in frictions:
        solution = am.solve(problem.with_mu(mu))
        counts = ", ".join(f"{n} {name}" for name, n in solution.counts.items())
        print(f"mu = {mu}: {counts}")
        patterns.append(solution.pattern)
    return patterns


if __name__ == "__main__":
    main()
