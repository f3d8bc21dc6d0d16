"""The cube as a script: build, solve, look at the result, write it."""

import amontons as am


def main(cells: int = 16) -> am.ModelSolution:
    """Solve with `cells` elements per edge; returns the solution."""
    block = am.Body(am.box((1, 1, 1), cells=cells), am.LinearElastic(young=200, poisson=0.3))
    model = am.Model(
        [block],
        supports=[am.Fix("top", lambda x: (0, 0.2, 0.06 - 0.15 * x[0]))],
        contacts=[am.Contact("bottom", am.Plane(normal=(0, 0, 1)), mu=1.0)],
    )
    return am.solve(model)


if __name__ == "__main__":
    solution = main()
    print(solution)
    solution.write("cube.vtu")
    solution.plot("cube.png")
