"""Problems made here: time steps of masonry walls, packings of spheres; any size, any seed."""

import numpy as np

import amontons as am
from amontons.mechanics.ready.packings import SpherePacking
from amontons.mechanics.steps.moreau_jean import MovingModel

STONE = am.LinearElastic(young=2.2e9, poisson=0.2, density=2000)
STEEL = am.LinearElastic(young=2.1e11, poisson=0.3, density=7800)


def wall_step(  # noqa: PLR0913
    rows, blocks, cells=(8, 4, 4), mu=0.83, mu_support=0.53, pressure=1e5, shear=0.0, step=1e-3
):
    """The first time step from rest of a wall under its weight and a loaded plate, global form.

    pressure, shear: tractions on the plate, Pa; step: seconds.
    """
    made = am.Wall(
        rows, blocks, size=(0.4, 0.2, 0.2), cells=cells, material=STONE,
        mu=mu, mu_support=mu_support, plate=0.05, plate_material=STEEL,
    )  # fmt: skip
    held = None if shear else 0  # a sheared plate is free to slide
    model = made.model(
        [am.Fix("plate.top", (held, 0, None))],
        [am.Traction("plate.top", (shear, 0, -pressure)), am.BodyForce((0, 0, -2000 * 9.81))],
    )
    model = MovingModel(am.MoreauJean(step=step, theta=1), model, 1e-6)
    state = am.at_rest(model.motion.model)
    try:
        model.advance(state, step, _take)
    except _Taken as found:
        return found.args[0]
    raise AssertionError("a step asks for a solution")


class _Taken(Exception):
    """Carries the problem of a step that is not to be solved here."""


def _take(problem, start, local):
    raise _Taken(problem)


def walls(count, seed):
    """(name, problem) of random walls: bond, mesh, friction, load and time step."""
    random = np.random.default_rng([seed, 1])
    for k in range(count):
        rows, blocks = int(random.integers(2, 6)), int(random.integers(1, 4))
        cells = (2 * int(random.integers(2, 5)), *(int(c) for c in random.integers(2, 5, 2)))
        mu, mu_support = random.uniform(0.2, 1.0, 2)
        pressure, step = 10 ** random.uniform(4, 6), 10 ** random.uniform(-3.3, -1.7)
        shear = pressure * random.uniform(0, 1.2) * mu if random.random() < 0.6 else 0.0
        problem = wall_step(rows, blocks, cells, mu, mu_support, pressure, shear, step)
        yield f"wall {rows}x{blocks} {k}", problem


def packings(count, seed):
    """(name, problem) of random packings: number, radii and friction of the spheres."""
    random = np.random.default_rng([seed, 2])
    for k in range(count):
        spheres = int(10 ** random.uniform(1.0, 2.8))
        low, high = np.sort(random.uniform(0.1, 1.0, 2))
        mu = (float(low), float(high)) if random.random() < 0.5 else float(high)
        packing = SpherePacking(
            spheres, spread=float(random.uniform(0, 0.3)), mu=mu,
            mu_wall=float(random.choice([0.0, high])), seed=int(random.integers(10**6)),
        )  # fmt: skip
        yield f"spheres {spheres} {k}", packing.problem()
