"""Stones that hold each other: an arch of rigid voussoirs, a key between two blocks."""

from __future__ import annotations

import numpy as np

import amontons as am

from .case import Case, Value

ARCH = 64  # pieces of the arc that the outlines of all voussoirs have together


def _half_arch(voussoirs: int, thickness: float) -> am.Model:
    """Half of a round arch of mean radius 1, from its foot y = 0 to its crown x = 0."""
    bodies = []
    contacts = [am.Contact("0.bottom", am.Plane((0, 1)), mu=10.0)]
    for k in range(voussoirs):
        box = am.box((1, 1), (1, ARCH // voussoirs))
        r = 1 + thickness * (box.points[:, 0] - 0.5)
        angle = np.pi / 2 * (k + box.points[:, 1]) / voussoirs
        points = np.stack([r * np.cos(angle), r * np.sin(angle)], axis=1)
        mesh = am.Mesh(points, box.cells, box.surfaces)
        bodies.append(am.Body(mesh, am.Rigid(density=1.0), str(k)))
        if k:
            contacts.append(am.Contact(f"{k}.bottom", master=f"{k - 1}.top", mu=10.0,
                                       method="nodal"))  # fmt: skip
    crown = f"{voussoirs - 1}.top"
    contacts.append(am.Contact(crown, am.Plane((1, 0)), mu=0.0))  # the other half
    return am.Model(bodies, [], contacts, [am.BodyForce((0, -1.0))])


def _stands(voussoirs: int, thickness: float) -> bool:
    try:
        am.solve(_half_arch(voussoirs, thickness))
    except am.NotConverged:
        return False
    return True


def arch(size: int) -> list[Value]:
    """Bisection for the smallest thickness for which joints without tension find a balance."""
    falls, stands = 0.09, 0.13
    while stands - falls > 2e-5:
        middle = (falls + stands) / 2
        if _stands(size, middle):
            stands = middle
        else:
            falls = middle
    return [Value("smallest thickness over radius", (falls + stands) / 2, 0.1075, known=5e-4)]


def _key(size: int, mu: float) -> am.Model:
    """Half a key of slope 0.1; its block is pressed on it by 1 and moves on rollers.

    The key is driven down by 0.01 until t = 1, and drawn up by as much until t = 2.
    """
    key = am.box((1, 1), (size, 2 * size))
    block = am.box((1, 1), (size + 1, 3 * size), origin=(1, 0))
    lean = 0.1 * (key.points[:, 1] - 0.5)
    key_mesh = am.Mesh(key.points + np.outer(lean * key.points[:, 0], [1, 0]), key.cells,
                       key.surfaces)  # fmt: skip
    x, y = block.points.T
    block_mesh = am.Mesh(np.stack([x + 0.1 * (y - 0.5) * (2 - x), y], axis=1), block.cells,
                         block.surfaces)  # fmt: skip
    steel = am.LinearElastic(1000.0, 0.3)

    def moved(x: np.ndarray, t: float) -> float:
        return -0.01 * (1 - abs(t - 1))

    return am.Model(
        [am.Body(key_mesh, steel, "key"), am.Body(block_mesh, steel, "block")],
        [am.Fix("key.left", (0, None)), am.Fix("key.top", (None, moved)),
         am.Fix("block.bottom", (None, 0))],
        [am.Contact("key.right", master="block.left", mu=mu)],
        [am.Traction("block.right", (-1.0, 0.0))],
    )  # fmt: skip


def keystone(size: int) -> list[Value]:
    """Forces on half of the key when it is driven in and drawn out, H = 1."""
    out = []
    for mu in (0.05, 0.1, 0.3):
        steps = am.evolve(_key(size, mu), am.QuasiStatic(step=0.5), until=2.0, tolerance=1e-10)
        forces = [step.supports["key.top"].force[1] for step in steps]
        lean, angle = np.arctan(0.1), np.arctan(mu)
        out += [
            Value(f"force in, mu = {mu:g}", -forces[1], np.tan(lean + angle)),
            Value(f"force out, mu = {mu:g}", forces[3], np.tan(angle - lean), 1.0),
        ]
    return out


CASES = (
    Case("arch", "Smallest thickness of a round arch",
         "A half circle of voussoirs without tension and slip carries its own weight; its "
         "thickness t is reduced until no thrust line is left, at t = 0.1075 R.",
         "M. Milankovitch (1907), as quoted in the abstract of N. Makris and H. Alexakis, The "
         "effect of stereotomy on the shape of the thrust-line and the minimum thickness of "
         "semicircular masonry arches: t/R = 0.1075, R the mean radius, joints radial",
         arch, (4, 8, 16), (), 2.0,
         "Half of the arch, of 4 to 16 rigid voussoirs: hinges open at joints alone. mu = 10. "
         "Bisection with the verdict of `solve`, which finds no solution below. A linear "
         "program for the thrust line finds 0.10086, 0.10724, 0.10724 for these joints, and "
         "0.107478 for 4000."),
    Case("keystone", "Key that locks itself",
         "A key of slope tan a = 0.1 on both sides is driven in and drawn out between blocks "
         "that are pressed on it by a force H. With mu > tan a it locks itself, with less it "
         "has to be held.",
         "Statics: H tan(phi + a) in, H tan(phi - a) out for each side, mu = tan phi", keystone,
         (2, 3, 4), (8,)),
)  # fmt: skip
