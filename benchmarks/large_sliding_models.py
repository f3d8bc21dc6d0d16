"""Two bodies that slide far on each other: the cases of `large_sliding`.

A die with a round underside is pressed into a slab, then dragged over it; a round end is
pressed flat against another.  All energies are neo-Hookean.
"""

from dataclasses import dataclass, replace

import numpy as np

import amontons as am
from amontons.mechanics.meshes import Facets
from amontons.mechanics.meshes.order import second_order

POISSON = 0.32


@dataclass(frozen=True)
class Case:
    """lower, upper: meshes; moduli of both; depth and way of the upper one's top.

    The depth is reached in `presses` load steps, the way in `drags` more; the lower one's
    bottom is held, and `upper.bottom` meets `lower.top`.
    """

    lower: am.Mesh
    upper: am.Mesh
    moduli: tuple[float, float]
    depth: float
    way: float
    mu: float
    presses: int
    drags: int
    poisson: float = POISSON

    def top(self, step):
        """Displacement (d,) of the top of the upper body after a (part of a) step."""
        along = self.way * max(step - self.presses, 0) / max(self.drags, 1)
        down = -self.depth * min(step / self.presses, 1)
        d = self.lower.points.shape[1]
        return np.array([along, *[0.0] * (d - 2), down])

    @property
    def steps(self):
        """Load steps."""
        return self.presses + self.drags

    def model(self, swap=False, law=am.NeoHookean):
        """The model; with swap the lower body's side is the slave; law(young, poisson)."""
        bodies = [am.Body(mesh, law(young, POISSON), name=name)
                  for mesh, young, name in zip((self.lower, self.upper), self.moduli,
                                               ("lower", "upper"), strict=True)]  # fmt: skip
        d = self.lower.points.shape[1]

        def component(c):
            return lambda x, t: self.top(t)[c]

        sides = ("upper.bottom", "lower.top")[:: -1 if swap else 1]
        return am.Model(bodies, [am.Fix("lower.bottom", 0),
                                 am.Fix("upper.top", tuple(component(c) for c in range(d)))],
                        [am.Contact(sides[0], master=sides[1], mu=self.mu)])  # fmt: skip


def rounded(mesh, radius):
    """A box around x = 0 with its underside bent to a circle (a cylinder) that touches 0."""
    points = mesh.points.copy()
    points[:, 0] -= np.ptp(points[:, 0]) / 2
    x, y = points[:, 0], points[:, -1]
    height = np.ptp(y)
    points[:, -1] = y + (radius - np.sqrt(radius**2 - x**2)) * (1 - y / height)
    return points


def die(size, cells, at, radius=1.0):
    """A die of a size whose lowest point (or line) is at x = at[0], height at[1]."""
    mesh = am.box(size, cells)
    points = rounded(mesh, radius)
    points[:, 0] += at[0]
    points[:, -1] += at[1]
    if len(size) == 3:
        points[:, 1] += at[2]
    return replace(mesh, points=points)


def split_off_volume(young, poisson):
    """CalculiX' neo-Hookean law, G/2 (J^-2/3 tr C - 3) + K/2 (J - 1)^2."""
    shear = young / (2 * (1 + poisson))
    return am.MooneyRivlin(shear / 2, 0.0, young / (3 * (1 - 2 * poisson)))


def shallow(fine=1):
    """A die of width 1.2 on a slab of 6 x 2, ten times as soft; fine: times as many cells."""
    slab = am.box((6, 2), (32 * fine, 10 * fine))
    upper = die((1.2, 0.75), (9 * fine, 5 * fine), (1.5, 2.0))
    return Case(slab, upper, (1.0, 10.0), 0.4, 2.0, 0.3, 20, 40)


def of_second_order():
    """As `shallow`, with half the cells in both directions and a die that is curved."""
    slab = second_order(am.box((6, 2), (16, 5)))
    upper = second_order(am.box((1.2, 0.75), (5, 3)))
    points = rounded(upper, 1.0) + [1.5, 2.0]
    return Case(slab, replace(upper, points=points), (1.0, 10.0), 0.4, 2.0, 0.3, 20, 40)


def deep(fine=1):
    """The same with a die of a smaller radius, as deep as its half width."""
    slab = am.box((6, 2), (40 * fine, 13 * fine))
    upper = die((1.2, 1.0), (12 * fine, 6 * fine), (1.5, 2.0), radius=0.75)
    return Case(slab, upper, (1.0, 10.0), 0.6, 2.0, 0.3, 20, 50)


def beyond_the_rim():
    """A die pressed in beyond its rim: its sides are in the contact, too."""
    slab = am.box((6, 2), (40, 13))
    upper = die((1.2, 1.0), (12, 6), (1.5, 2.0))
    round_it = [f.nodes for side in ("bottom", "left", "right") for f in upper.surface(side)]
    outline = {"bottom": (Facets("line", np.concatenate(round_it)),)}
    upper = replace(upper, surfaces=dict(upper.surfaces) | outline)
    return Case(slab, upper, (1.0, 10.0), 1.0, 2.0, 0.3, 20, 50)


def hertz(fine=1):
    """Two like round ends, pressed together by half of what both are high."""
    upper = die((1.6, 1.0), (20 * fine, 10 * fine), (0.0, 0.0))
    lower = die((1.6, 1.0), (17 * fine, 9 * fine), (0.0, 0.0))
    return Case(replace(lower, points=-lower.points, surfaces=_upside_down(lower)), upper,
                (1.0, 1.0), 0.6, 0.0, 0.3, 20, 0)  # fmt: skip


def _upside_down(mesh):
    """Surfaces after half a turn: top and bottom, left and right change places."""
    other = {"bottom": "top", "top": "bottom", "left": "right", "right": "left"}
    return {other[name]: mesh.surfaces[name] for name in mesh.surfaces}


def ironing_in_space(fine=1):
    """A die of 0.8 x 1 on a slab of 3 x 1.6 x 1, which is wider; fine: times as many cells."""
    slab = am.box((3, 1.6, 1), (15 * fine, 8 * fine, 4 * fine))
    upper = die((0.8, 1.0, 0.5), (5 * fine, 6 * fine, 3 * fine), (0.9, 1.0, 0.3))
    return Case(slab, upper, (1.0, 10.0), 0.2, 1.0, 0.3, 8, 20)


CASES = {
    "ironing, shallow": shallow,
    "ironing, second order": of_second_order,
    "ironing, deep": deep,
    "ironing, beyond the rim": beyond_the_rim,
    "Hertz, large": hertz,
    "ironing in 3D": ironing_in_space,
}


def corners(mesh, name):
    """Facets (f, a) of first order of a surface, in one table (all of one kind)."""
    (facets,) = mesh.surface(name)
    return facets.nodes
