"""Hostile cases of two bodies that slide far, for `hostile_sliding`.

Every case takes (dim, kind of cells, order, swap) and returns a Case: a model and how far to
go.  A block of 1 (x 1) x 1 stands on a slab of 2 (x 1.4) x 1, whose top is at height 0.
"""

from dataclasses import dataclass, replace

import numpy as np

import amontons as am
from amontons.mechanics.meshes import Facets

NEO = am.NeoHookean(1.0, 0.3)
MU = 0.3
BEYOND = 2.0  # square of the stretch beyond which `brittle` is not a number
CELLS = {2: (4, 3), 3: (2, 2, 2)}  # of the block


@dataclass(frozen=True)
class Case:
    """model: makes one anew; until: time; ends: words it has to end with, "" where none.

    presses: whether a force has to be left at the end.  told: warning that has to be given.
    """

    model: object
    until: float
    ends: str = ""
    presses: bool = True
    told: str = ""


@dataclass(frozen=True)
class Kind:
    """Dimension, cells, order, and whether the slab's side is the slave."""

    dim: int
    cells: str
    order: int
    swap: bool

    def __str__(self):
        return f"{self.cells}, order {self.order}{', exchanged' if self.swap else ''}"

    def box(self, size, cells, at):
        """A mesh of boxes with extents (width, depth, height) at a corner (x, height)."""
        (width, depth, height), (x, z) = size, at
        if self.dim == 2:
            return am.box((width, height), (cells[0], cells[-1]), origin=(x, z),
                          kind=self.cells)  # fmt: skip
        return am.box((width, depth, height), cells, origin=(x, (1 - depth) / 2, z),
                      kind=self.cells)  # fmt: skip

    def block(self, at=(0.0, 0.0)):
        """The block."""
        return self.box((1, 1, 1), CELLS[self.dim], at)

    def slab(self, width=2.0, at=-0.5):
        """The slab, from `at` on."""
        cells = (round(5 * width), 3) if self.dim == 2 else (round(2 * width), 3, 1)
        return self.box((width, 1.4, 1), cells, (at, -1))

    def body(self, mesh, name, law=NEO):
        """A body of the order asked for."""
        return am.Body(mesh, law, name=name, order=self.order)

    def moved(self, along, up):
        """Components of a support, from functions or numbers."""
        return (along, *[0] * (self.dim - 2), up)

    def pairs(self, sides=(("upper.bottom", "lower.top"),), **more):
        """Contacts of these sides, slave first where not exchanged."""
        turn = -1 if self.swap else 1
        return [am.Contact(one, master=other, mu=MU, **more)
                for one, other in (side[::turn] for side in sides)]  # fmt: skip

    def two(self, block, slab, *supports, loads=(), law=NEO):
        """Block on slab, the slab's bottom held."""
        bodies = [self.body(slab, "lower"), self.body(block, "upper", law)]
        held = [am.Fix("lower.bottom", 0), *supports]
        return am.Model(bodies, held, self.pairs(), list(loads))


def ramp(size, first=0.0):
    """From 0 at time `first` to `size` one later, and there on."""
    return lambda x, t: size * min(max(t - first, 0.0), 1.0)


def driven(kind, along=0.3, down=-0.05):
    """The block's top goes down in the time to 1, then along."""
    return am.Fix("upper.top", kind.moved(ramp(along, 1.0), ramp(down)))


def overlap(kind):
    """Bodies that overlap by half a facet as they are given."""
    depth = 0.5 / CELLS[kind.dim][0]
    return Case(lambda: kind.two(kind.block((0.0, -depth)), kind.slab(), driven(kind)), 2.0,
                told="overlap-at-start")  # fmt: skip


def fold(kind):
    """The block's underside has waves that lean over until facets look away."""
    mesh = kind.box((1, 1, 1), (12, 6) if kind.dim == 2 else (12, 1, 6), (0.0, 0.0))
    points = mesh.points.copy()
    x, z = mesh.points[:, 0], mesh.points[:, -1]
    raised = z + 0.15 * (1 - np.cos(4 * np.pi * x)) / 2 * (1 - z)
    points[:, 0], points[:, -1] = x + 1.5 * raised, raised
    leaning = replace(mesh, points=points)
    return Case(lambda: kind.two(leaning, kind.slab(), driven(kind)), 2.0)


def inside_out(kind):
    """A node of the block's underside lies beyond its neighbour: facets fold, a cell, too."""
    def model():
        mesh = kind.block()
        points = mesh.points.copy()
        at = np.linalg.norm(points[:, [0, -1]] - (0.5, 0), axis=1).argmin()
        points[at, 0] += 1.2
        return kind.two(replace(mesh, points=points), kind.slab(), driven(kind))

    return Case(model, 2.0,
                "cell .*(inside out|volume|inverted|Jacobian|det)")  # fmt: skip


def needles(kind, aspect):
    """The first column of the block's cells is so many times as high as wide."""
    mesh = kind.block()
    points = mesh.points.copy()
    column = np.unique(points[:, 0].round(9))[1]
    points[np.abs(points[:, 0] - column) < 1e-6, 0] = 1 / (CELLS[kind.dim][-1] * aspect)
    thin = replace(mesh, points=points)
    return Case(lambda: kind.two(thin, kind.slab(), driven(kind)), 2.0)


def nobody(kind):
    """The block stands ten widths beside the slab, held by its top."""
    return Case(lambda: kind.two(kind.block((10.0, 0.0)), kind.slab(), driven(kind)), 2.0,
                presses=False, told="unfaced-slave")  # fmt: skip


def nobody_holds(kind):
    """The same, pressed down by a load alone."""
    load = am.Traction("upper.top", kind.moved(0, -0.05))
    return Case(lambda: kind.two(kind.block((10.0, 0.0)), kind.slab(), loads=[load]), 2.0,
                "(faces .* nowhere|body 'upper' is free to move)")  # fmt: skip


def between(kind):
    """A sheet is pressed by bodies on both sides, then one of them goes along."""
    sheet = kind.box((1.4, 1, 0.4), (5, 2, 2), (-0.2, 0.0))
    names = ("bottom", "top")
    (first,), (second,) = (sheet.surface(name) for name in names)
    around = replace(first, nodes=np.concatenate([first.nodes, second.nodes]))
    sheet = sheet.with_surfaces({"around": (around,)})
    above = kind.block((0.0, 0.4))

    def model():
        bodies = [kind.body(kind.slab(), "lower"), kind.body(sheet, "sheet"),
                  kind.body(above, "upper")]  # fmt: skip
        kept = am.Fix("sheet.left", kind.moved(0, None))
        held = [am.Fix("lower.bottom", 0), kept, driven(kind, along=0.2)]
        if kind.swap:
            sides = [("lower.top", "sheet.around"), ("upper.bottom", "sheet.around")]
            contacts = [am.Contact(one, master=other, mu=MU) for one, other in sides]
        else:
            contacts = [am.Contact("sheet.around", master="lower.top",
                                   more_masters=["upper.bottom"], mu=MU)]  # fmt: skip
        return am.Model(bodies, held, contacts)

    return Case(model, 2.0)


def shared_edge(kind):
    """The slab is of two bodies, and the block goes over the edge that they share."""
    def model():
        bodies = [kind.body(kind.slab(1.2), "lower"), kind.body(kind.slab(1.4, 0.7), "end"),
                  kind.body(kind.block((-0.4, 0.0)), "upper")]  # fmt: skip
        held = [am.Fix("lower.bottom", 0), am.Fix("end.bottom", 0), driven(kind, along=0.9)]
        if kind.swap:
            contacts = kind.pairs([("upper.bottom", "lower.top"), ("upper.bottom", "end.top")])
        else:
            contacts = [am.Contact("upper.bottom", master="lower.top",
                                   more_masters=["end.top"], mu=MU)]  # fmt: skip
        return am.Model(bodies, held, contacts)

    return Case(model, 2.0)


def brittle(beyond=BEYOND, what=("energy", "stress", "moduli"), value=np.nan):
    """Saint Venant and Kirchhoff's energy, not a number where C has an eigenvalue beyond."""
    one = np.eye(3)
    symmetric = (np.einsum("ik,jl->ijkl", one, one) + np.einsum("il,jk->ijkl", one, one)) / 2
    stiff = np.einsum("ij,kl->ijkl", one, one) + symmetric

    def torn(name, C, values):
        values = np.array(values)
        if name in what:
            values[np.linalg.eigvalsh(C)[:, -1] > beyond] = value
        return values

    def strained(C):
        return np.einsum("ijkl,nkl->nij", stiff, (C - one) / 2)

    return am.UserEnergy(
        lambda C: torn("energy", C, np.einsum("nij,nij->n", strained(C), C - one) / 4),
        lambda C: torn("stress", C, strained(C)),
        lambda C: torn("moduli", C, np.broadcast_to(stiff, (len(C), 3, 3, 3, 3))),
        name="glass",
    )


def no_number_at_entry(kind):
    """A user's energy that is not a number at rest."""
    return Case(lambda: kind.two(kind.block(), kind.slab(), driven(kind), law=brittle(0.5)),
                2.0, "glass: .*not a finite number")  # fmt: skip


def no_number_on_the_way(kind, what=("energy", "stress", "moduli"), value=np.nan):
    """A user's energy that is none beyond a stretch of 1.41, to which the block is pulled."""
    def model():
        pulled = [am.Fix("upper.left", kind.moved(0, ramp(-0.02))),
                  am.Fix("upper.right", kind.moved(lambda x, t: 0.5 * t,
                                                   ramp(-0.02)))]  # fmt: skip
        law = brittle(what=what, value=value)
        return kind.two(kind.block(), kind.slab(3.0), *pulled, law=law)

    return Case(model, 2.0, "glass: .*not a finite number .*body 'upper'")


def pressed_flat(kind):
    """The block's top is driven through the slab's bottom."""
    down = am.Fix("upper.top", kind.moved(0, lambda x, t: -1.1 * t))
    return Case(lambda: kind.two(kind.block(), kind.slab(), down), 2.0,
                "(cell|corner) .*(det F|inside out)|lie in each other at")  # fmt: skip


def lifted(kind):
    """Nothing holds the block but contact; a load presses it first, then lifts it."""
    load = am.Traction("upper.top", lambda x, t: kind.moved(0, -0.05 if t < 1 else 0.02))
    return Case(lambda: kind.two(kind.block(), kind.slab(), loads=[load]), 2.0,
                "(loose|no equilibrium|rigid|faces|hold|move)")  # fmt: skip


def dragged_off(kind):
    """Pressed by a load alone the block is dragged over the slab's edge."""
    load = am.Traction("upper.top", lambda x, t: kind.moved(0, -0.02 * min(4 * t, 1)))
    held = am.Fix("upper.top", (ramp(2.4, 0.25), *[0] * (kind.dim - 2), None))
    return Case(lambda: kind.two(kind.block(), kind.slab(), held, loads=[load]), 2.0,
                "faces|edge")  # fmt: skip


def off_and_back(kind):
    """Driven beyond the slab's edge, and back."""
    def along(x, t):
        return 1.7 * (max(t - 1, 0) if t < 2 else max(3 - t, 0))

    top = am.Fix("upper.top", kind.moved(along, ramp(-0.05)))
    return Case(lambda: kind.two(kind.block(), kind.slab(), top), 3.0)


def outlined(kind):
    """A slave of bottom and both sides is dragged off the slab's edge."""
    mesh = kind.block()
    sides = [mesh.surface(name)[0] for name in ("bottom", "left", "right")]
    nodes = np.concatenate([side.nodes for side in sides])
    around = (Facets(sides[0].kind, nodes),)
    mesh = replace(mesh, surfaces=dict(mesh.surfaces) | {"bottom": around})
    return Case(lambda: kind.two(mesh, kind.slab(), driven(kind, along=1.7)), 2.0,
                presses=False)  # fmt: skip


CASES = {
    "overlap of half a facet": overlap,
    "facets that lean over": fold,
    "a facet and a cell inside out": inside_out,
    "needles, 1 000": lambda kind: needles(kind, 1e3),
    "needles, 10 000": lambda kind: needles(kind, 1e4),
    "no master near, held": nobody,
    "no master near, loaded": nobody_holds,
    "between two masters": between,
    "edge shared by two masters": shared_edge,
    "energy no number at rest": no_number_at_entry,
    "energy no number on the way": no_number_on_the_way,
    "stress alone infinite on the way": lambda kind: no_number_on_the_way(
        kind, ("stress",), np.inf),
    "pressed flat": pressed_flat,
    "nothing holds, lifted": lifted,
    "dragged off under a load": dragged_off,
    "off the edge and back": off_and_back,
    "outline as slave, dragged off": outlined,
}  # fmt: skip
KINDS = {2: ("quad", "tri"), 3: ("hex", "tet")}
