"""The problems of the wall: time steps of its compression and shear, as FCLib files.

The paper gives neither the size of the blocks nor the time step, and the step decides how hard
a problem is (`README.md`).  So a series has the same instants for several step sizes: "graded
difficulty" as in the paper, with a grade that everyone can repeat.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import amontons as am
from amontons.case import read_case
from amontons.files import replacing

CASE = Path(__file__).resolve().parents[2] / "examples" / "wall" / "wall.toml"
COMPRESSED = 0.05  # s, when the compression is complete and the shear starts
SMALL_STEP = 2e-3  # s, up to which Auto from the last step's reactions beats Newton
NEWTON_STEPS = 12  # from the last step's reactions, before Auto takes over
TOLERANCE = 1e-6  # of the steps between the chosen ones


@dataclass(frozen=True)
class Series:
    """Walls of one mesh: cells of a block, step sizes in s, instants in s."""

    name: str
    cells: tuple[int, int, int]
    steps: tuple[float, ...]
    instants: tuple[float, ...]
    rows: int = 5

    def indices(self, step: float) -> list[int]:
        """The steps, counted from 1, that end nearest to the instants."""
        return sorted({max(1, round(instant / step)) for instant in self.instants})

    def names(self, step: float) -> list[str]:
        """File names of the problems of one step size."""
        return [f"{self.name}-{1e3 * step:g}ms-{k:04d}.hdf5" for k in self.indices(step)]

    @property
    def problems(self) -> list[str]:
        """All file names: every step size at the first instant, then at the second, ..."""
        return [
            name for names in zip(*map(self.names, self.steps), strict=True) for name in names
        ]


def evenly(compressed: int, sheared: int, end: float) -> tuple[float, ...]:
    """Instants, s: some while the wall is compressed, the others evenly until `end`."""
    first = COMPRESSED * np.arange(1, compressed + 1) / (compressed + 0.5)
    later = np.linspace(COMPRESSED, end, sheared + 1)[1:]
    return tuple(np.concatenate([first, later]).tolist())


PAPER = Series("wall", (8, 4, 4), (1e-3, 2e-3, 5e-3, 1e-2, 2e-2), evenly(2, 8, 0.5))
FINE = Series("fine", (16, 7, 7), (5e-3,), (0.03, 0.1))
QUICK = Series("quick", (2, 1, 1), (5e-3,), (0.04, 0.1, 0.15), rows=3)


def write_problems(
    series: Series, folder: Path, report: Callable[[str], None] = print
) -> list[Path]:
    """The files of a series; those that are there are kept.

    Beside each file lies its warm start, FILE.npz: impulses r (nc, 3) of the step before at the
    contacts of this one.
    """
    folder.mkdir(parents=True, exist_ok=True)
    for step in series.steps:
        if not all((folder / name).is_file() for name in series.names(step)):
            _follow(series, step, folder, report)
    return [folder / name for name in series.problems]


def _follow(series: Series, step: float, folder: Path, report: Callable[[str], None]) -> None:
    """Run one step size until its last instant and write the chosen steps."""
    last = series.indices(step)[-1]
    names = dict(zip(series.indices(step), series.names(step), strict=True))
    case = read_case(CASE, [f"wall.cells={list(series.cells)}", f"wall.rows={series.rows}",
                            f"evolution.step={step}"])  # fmt: skip
    assert case.evolution is not None
    newton = am.Hybrid(
        first=am.SemismoothNewton(), iterates_of_first=NEWTON_STEPS, main=am.Auto()
    )
    solver = None if step <= SMALL_STEP else newton
    before = None
    for done in am.evolve(case.model, case.evolution.method, until=last * step,
                          solver=solver, tolerance=TOLERANCE):  # fmt: skip
        k = done.state.index
        if k in names:
            path = folder / names[k]
            am.write_fclib(
                done.problem, path, title=f"wall, step {step:g} s, t = {done.time:g}"
            )
            force = np.zeros_like(done.state.force) if before is None else before
            with replacing(path.with_suffix(".npz")) as temporary:
                with temporary.open("wb") as file:
                    np.savez(file, r=step * force[done.active])
            report(f"{path.name}: {done.problem.contacts} contacts")
        before = done.state.force
