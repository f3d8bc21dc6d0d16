"""More of `large_sliding`: bodies that roll, turn, fold and are pressed into each other.

Models of neo-Hookean bodies with the displacement of a driven side over the load step.
"""

from dataclasses import dataclass, replace

import numpy as np

import amontons as am
from amontons.mechanics.meshes import Facets
from amontons.mechanics.meshes.order import second_order

POISSON = 0.3


@dataclass(frozen=True)
class Driven:
    """bodies: (mesh, modulus) by name; fixed: supports at rest; driven: surface that is moved.

    way(points (n, d), step) -> displacements (n, d) there; sides: slave and master.
    """

    bodies: dict
    fixed: tuple
    driven: str
    way: object
    steps: int
    sides: tuple[str, str]
    mu: float
    poisson: float = POISSON

    def model(self, swap=False, law=am.NeoHookean):
        """The model; with swap the other side is the slave; law(young, poisson)."""
        bodies = [am.Body(mesh, law(young, POISSON), name=name)
                  for name, (mesh, young) in self.bodies.items()]  # fmt: skip
        dim = bodies[0].mesh.dim

        def component(c):
            return lambda x, t: float(self.way(np.reshape(x, (1, dim)), t)[0, c])

        moved = am.Fix(self.driven, tuple(component(c) for c in range(dim)))
        slave, master = self.sides[:: -1 if swap else 1]
        return am.Model(bodies, [*self.fixed, moved],
                        [am.Contact(slave, master=master, mu=self.mu)])  # fmt: skip


def about(points, angle, centre):
    """Displacements of points (n, d) turned in the plane of their first two coordinates."""
    c, s = np.cos(angle), np.sin(angle)
    out = np.zeros_like(points)
    arm = points[:, :2] - centre
    out[:, :2] = arm @ np.array([[c, s], [-s, c]]) - arm
    return out


# ------------------------------------------------------------------------------- rolling
def rolling(fine=1):
    """A tyre on a hub is pressed on a slab and rolls on it by a quarter of its outline."""
    ring = am.box((2 * np.pi, 0.5), (72 * fine, 4 * fine))
    angle, height = ring.points.T
    radius = 0.5 + height
    points = np.stack([radius * np.sin(angle), 1 - radius * np.cos(angle)], axis=1)
    ring = joined_ends(replace(ring, points=points), "left", "right")
    slab = am.box((3.5, 0.8), (44 * fine, 6 * fine), origin=(-0.8, -0.8))

    def way(x, step):
        down, turn = -0.06 * min(step / 5, 1), np.pi / 2 * max(step - 5, 0) / 40
        return about(x, -turn, (0, 1)) + [0.98 * turn, down]

    bodies = {"slab": (slab, 1.0), "tyre": (ring, 1.0)}
    return Driven(bodies, (am.Fix("slab.bottom", 0),), "tyre.bottom", way, 45,
                  ("tyre.top", "slab.top"), 0.4)  # fmt: skip


def joined_ends(mesh, one, other):
    """A strip bent to a ring: the nodes of both ends are one."""
    first, second = mesh.surface_nodes(one), mesh.surface_nodes(other)
    gap = np.linalg.norm(mesh.points[second][:, None] - mesh.points[first], axis=2)
    new = np.arange(len(mesh.points))
    new[second] = first[gap.argmin(axis=1)]
    kept, number = np.unique(new, return_inverse=True)
    cells = [replace(block, nodes=number[block.nodes]) for block in mesh.cells]
    surfaces = {name: tuple(Facets(f.kind, number[f.nodes]) for f in mesh.surface(name))
                for name in ("bottom", "top")}  # fmt: skip
    return am.Mesh(mesh.points[kept], tuple(cells), surfaces)


# ------------------------------------------------------------------------------- turning
def turned(order=1, fine=1):
    """A block pressed on another is turned about their axis once."""
    below = am.box((1, 1, 0.5), (5 * fine, 5 * fine, 2 * fine), origin=(-0.5, -0.5, -0.5))
    above = am.box((0.8, 0.8, 0.5), (3 * fine, 3 * fine, 2 * fine), origin=(-0.4, -0.4, 0))

    def way(x, step):
        out = about(x, 2 * np.pi * max(step - 4, 0) / 72, (0, 0))
        out[:, 2] = -0.05 * min(step / 4, 1)
        return out

    if order == 2:
        below, above = second_order(below), second_order(above)
    bodies = {"below": (below, 1.0), "above": (above, 4.0)}
    return Driven(bodies, (am.Fix("below.bottom", 0),), "above.top", way, 76,
                  ("above.bottom", "below.top"), 0.2)  # fmt: skip


# ------------------------------------------------------------------------------- folding
def folded(fine=1, recede=0.0):
    """A strip bent to a U: its arms are pressed together, one is pulled along the other.

    recede: by how much the inside of the upper arm's end is bent away, on a circle that begins
    0.2 before the end.  Without it a sharp corner slides, which wrinkles on fine meshes.
    """
    arm, gap, thick = 2.0, 0.3, 0.2
    radius = (gap + thick) / 2
    half = np.pi * radius
    mesh = am.box((2 * arm + half, thick), (72 * fine, 4 * fine))
    s, h = mesh.points.T
    angle = np.clip((s - arm) / radius, 0, np.pi) - np.pi / 2
    past = np.maximum(s - arm - half, 0)
    centre = np.stack([np.minimum(s, arm) - past + radius * np.cos(angle),
                       radius * np.sin(angle)], axis=1)  # fmt: skip
    inward = -np.stack([np.cos(angle), np.sin(angle)], axis=1)
    if recede:
        round_ = (recede**2 + 0.2**2) / (2 * recede)
        end = np.maximum(s - (2 * arm + half - 0.2), 0)
        h = h * (1 - (round_ - np.sqrt(round_**2 - end**2)) / thick)
    mesh = replace(mesh, points=centre + (h - thick / 2)[:, None] * inward)
    (inside,), (outside,) = mesh.surface("top"), mesh.surface("bottom")
    first, second = (mesh.points[f.nodes].mean(axis=1) for f in (inside, outside))
    tip = (second[:, 1] > 0) & (second[:, 0] < 0.4)
    mesh = mesh.with_surfaces({
        "low": (Facets("line", inside.nodes[first[:, 1] < 0]),),
        "high": (Facets("line", inside.nodes[first[:, 1] > 0]),),
        "press": (Facets("line", outside.nodes[tip]),),
    })  # fmt: skip

    def way(x, step):
        pull, press = 0.8 * max(step - 10, 0) / 20, 0.45 * min(step / 10, 1)
        return np.broadcast_to([pull, -press], x.shape)

    return Driven({"strip": (mesh, 1.0)}, (am.Fix("strip.left", 0),), "strip.press", way, 30,
                  ("strip.high", "strip.low"), 0.3)  # fmt: skip


# ----------------------------------------------------------------------------- pressed in
def pressed_in(fine=1):
    """A pin with a cone in front is pressed into a tube, 3 % narrower; a quarter of both."""
    tube = round_quarter((1.0, 1.5), (0.0, 1.5), np.multiply((8, 2, 10), fine), lambda z: 1.0)
    pin = round_quarter((0.5, 1.0), (-1.6, -0.1), np.multiply((7, 2, 9), fine), taper)
    fixed = [am.Fix("tube.top", (None, None, 0))]
    for name in ("tube", "pin"):
        fixed.append(am.Fix(f"{name}.left", (None, 0, None)))
        fixed.append(am.Fix(f"{name}.right", (0, None, None)))

    def way(x, step):
        return np.broadcast_to([0, 0, 1.2 * step / 40], x.shape)

    return Driven({"tube": (tube, 1.0), "pin": (pin, 10.0)}, tuple(fixed), "pin.front", way, 40,
                  ("pin.outer", "tube.inner"), 0.1)  # fmt: skip


def taper(z):
    """Radius of the pin over z: wider than the tube behind its cone."""
    return 0.97 + 0.06 * np.clip((-0.1 - z) / 0.5, 0, 1)


def round_quarter(radii, along, cells, outer):
    """A quarter of a tube from z to z; outer(z) scales the outer radius."""
    box = am.box((1, 1, 1), tuple(map(int, cells)))
    turn, out, z = box.points.T
    z = along[0] + (along[1] - along[0]) * z
    radius = radii[0] + (radii[1] * outer(z) - radii[0]) * out
    angle = np.pi / 2 * (1 - turn)  # right-handed with radius and z
    points = np.stack([radius * np.cos(angle), radius * np.sin(angle), z], axis=1)
    names = {"left": "right", "right": "left", "front": "inner", "back": "outer",
             "bottom": "front", "top": "top"}  # fmt: skip
    surfaces = {names[side]: box.surfaces[side] for side in names}
    return replace(box, points=points, surfaces=surfaces)


MORE = {
    "rolling tyre": rolling,
    "turned by 360 degrees": turned,
    "turned, second order": lambda: turned(order=2),
    "folded strip": folded,
    "folded strip, round tip": lambda fine=1: folded(fine, recede=0.1),
    "pressed into a tube": pressed_in,
}
