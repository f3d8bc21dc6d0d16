"""Small models for written_examples.py: one of everything that a deck can say."""

import numpy as np

import amontons as am

E, LOAD = 1000.0, 5.0


def block(dim=2, *, order=1, kind=None, cells=4, supports=None, loads=None, material=None,
          obstacle=None, constraints=(), references=(), springs=(), **law):  # fmt: skip
    """A block of height 1 on a plane, pressed from above, held sideways on the left."""
    mesh = am.box((1.0,) * dim, cells=cells, kind=kind)
    up = (0.0,) * (dim - 1) + (1.0,)
    sides = [am.Fix("left", (0.0, *(None,) * (dim - 1)))]
    sides += [am.Fix("front", (None, 0.0, None))] if dim == 3 else []
    return am.Model(
        [am.Body(mesh, material or am.LinearElastic(E, 0.3), "block", order=order)],
        sides if supports is None else supports,
        [am.Contact("bottom", obstacle=obstacle or am.Plane(up), **({"mu": 0.0} | law))],
        loads or [am.Pressure("top", LOAD)],
        constraints=list(constraints), references=list(references), springs=list(springs),
    )  # fmt: skip


def pushed(dim=2, mu=0.3, **more):
    """The same, free sideways but for friction, drawn by a traction of half of mu times p."""
    across = (0.5 * mu * LOAD, *(0.0,) * (dim - 1))
    loads = [am.Pressure("top", LOAD), am.Traction("top", across)]
    none = [am.Fix("back", (None, 0.0, None))] if dim == 3 else []
    return block(dim, supports=none, loads=loads, mu=mu, **more)


def dragged(dim=2, mu=0.3, **more):
    """The top goes down and sideways: bottom sticks here and slips there."""
    down = (0.004, *(0.0,) * (dim - 2), -0.005)
    return block(dim, supports=[am.Fix("top", down)], loads=[am.BodyForce((0.0,) * dim)],
                 mu=mu, **more)  # fmt: skip


def stacked(dim=2, *, order=1, kind=None, fitting=False, loads=None, down=None,
            times=1, **law):  # fmt: skip
    """A block on a wider one, whose meshes do not fit."""
    law = law if "tied" in law else {"mu": 0.0} | law
    size = (2.0, 1.0) if dim == 2 else (2.0, 2.0, 1.0)
    at = (-0.5, -1.0) if dim == 2 else (-0.5, -0.5, -1.0)
    cells, high = (8 if fitting else 5) * times, 3 * times
    lower = am.box(size, cells=(*[cells] * (dim - 1), high), origin=at, kind=kind)
    upper = am.box((1.0,) * dim, cells=(*[4 * times] * (dim - 1), high), kind=kind)
    force = (0.0,) * (dim - 1) + (-LOAD if down is None else 0.0,)
    supports = [am.Fix("lower.bottom", 0), am.Fix("upper.left", (0.0, *(None,) * (dim - 1)))]
    supports += [am.Fix("upper.front", (None, 0.0, None))] if dim == 3 else []
    if down is not None:
        supports += [am.Fix("upper.top", (*(None,) * (dim - 1), -down))]
    return am.Model(
        [am.Body(lower, am.LinearElastic(E, 0.3, expansion=2e-4), "lower", order=order),
         am.Body(upper, am.LinearElastic(3 * E, 0.2, expansion=1e-4), "upper", order=order)],
        supports, [am.Contact("upper.bottom", master="lower.top", **law)],
        loads or [am.Traction("upper.top", force)],
    )  # fmt: skip


def freed(model):
    """The same with nothing held but the bottom."""
    from dataclasses import replace

    return replace(model, supports=model.supports[:1])


def turned_block():
    """A block on a slope, held along the slope by turned supports."""
    from dataclasses import replace

    c, s = np.cos(0.4), np.sin(0.4)
    turn = np.array([[c, s], [-s, c]])  # rows: along the slope, and out of it
    model = block(obstacle=am.Plane(turn[1]), supports=[am.Fix("slope", (0.0, None))],
                  constraints=[am.Axes("slope", "left", turn)])  # fmt: skip
    body = model.bodies[0]
    mesh = replace(body.mesh, points=body.mesh.points @ turn)
    return replace(model, bodies=[replace(body, mesh=mesh)])


def turned_support():
    """A block whose right side slides along a slope."""
    c, s = np.cos(0.4), np.sin(0.4)
    return block(
        supports=[am.Fix("left", (0.0, None)), am.Fix("slope", (0.0, None))],
        constraints=[am.Axes("slope", "right", [[c, s], [-s, c]])],
    )


def spring():
    """A block held by springs sideways, drawn at a reference."""
    terms = [am.Spring([(5, 0, 1.0)], 900.0), am.Spring([(9, 0, 1.0), (14, 0, -1.0)], 500.0)]
    return block(springs=terms)


def coupled():
    """A block whose top follows a reference, which is pressed and turned."""
    return block(
        references=[am.Reference("R", (0.5, 1.5))],
        constraints=[am.Coupling("top", "R")],
        supports=[am.Fix("R", (0.001, -0.004)), am.Fix("R.rotation", (0.002,))],
        loads=[am.BodyForce((0.0, -1.0))],
    )


def ring():
    """A ring around an axis pressed on another one."""
    lower = am.box((1.0, 1.0), cells=(5, 3), origin=(1.0, -1.0))
    upper = am.box((0.8, 1.0), cells=(4, 3), origin=(1.1, 0.0))
    from dataclasses import replace

    lower, upper = (replace(m, axisymmetric=True) for m in (lower, upper))
    return am.Model(
        [am.Body(lower, am.LinearElastic(E, 0.3), "lower"),
         am.Body(upper, am.LinearElastic(E, 0.3), "upper")],
        [am.Fix("lower.bottom", 0)], [am.Contact("upper.bottom", master="lower.top", mu=0.2)],
        [am.Pressure("upper.top", LOAD)],
    )  # fmt: skip


ORTHO = am.OrthotropicElastic((900.0, 1100.0, 1000.0), (0.2, 0.1, 0.15), (400.0, 300.0, 350.0))
MODELS = {
    "plane 2D": block,
    "plane 3D": lambda: block(3),
    "plane 2D triangles": lambda: block(kind="tri"),
    "plane 3D tetrahedra": lambda: block(3, kind="tet"),
    "plane second order triangles": lambda: block(kind="tri", order=2),
    "plane second order tetrahedra": lambda: block(3, kind="tet", order=2, cells=2),
    "orthotropic": lambda: block(material=ORTHO),
    "plane stress": lambda: block(material=am.LinearElastic(E, 0.3, "stress")),
    "turned block on a turned plane": turned_block,
    "clearance": lambda: block(clearance=0.002, supports=[am.Fix("top", (0.0, -0.004))]),
    "overlap": lambda: block(clearance=-0.002),
    "nodal": lambda: block(method="nodal"),
    "gravity": lambda: block(loads=[am.BodyForce((0.0, -LOAD))]),
    "points": lambda: block(
        loads=[am.BodyForce((0.0, -LOAD)), am.NodalForce("top", (0.0, -1.0))]),
    "uneven pressure": lambda: block(loads=[am.Pressure("top", lambda x: LOAD * x[0])]),
    "friction, stuck 2D": lambda: pushed(),
    "friction, dragged 2D": lambda: dragged(),
    "friction, dragged 3D": lambda: dragged(3),
    "turned support": turned_support,
    "springs": spring,
    "coupling": coupled,
    "pair 2D": stacked,
    "pair 2D twice as fine": lambda: stacked(times=2),
    "pair 2D four times as fine": lambda: stacked(times=4),
    "pair 3D": lambda: stacked(3),
    "pair 2D fitting": lambda: stacked(fitting=True),
    "pair 3D fitting": lambda: stacked(3, fitting=True),
    "pair 3D tetrahedra": lambda: stacked(3, kind="tet"),
    "pair friction 2D": lambda: stacked(mu=0.3),
    "pair friction 3D": lambda: stacked(3, mu=0.3),
    "pair clearance": lambda: stacked(clearance=-1e-3),
    "pair heated": lambda: stacked(
        loads=[am.Temperature(10.0), am.Traction("upper.top", (0.0, -LOAD))]),
    "pair linear law": lambda: stacked(stiffness=2e4),
    "pair table": lambda: stacked(
        down=0.01, stiffness=am.OverclosureCurve([0.0, 5.0, 30.0], [0.0, 1e-3, 3e-3])),
    "pair exponential": lambda: stacked(stiffness=am.ExponentialOverclosure(1e-3, 2.0)),
    "tied 2D": lambda: stacked(tied=True),
    "tied 3D": lambda: stacked(3, tied=True),
    "tied 3D fitting": lambda: stacked(3, fitting=True, tied=True),
    "tied 3D fitting, slave free": lambda: freed(stacked(3, fitting=True, tied=True)),
    "tied 3D, slave free": lambda: freed(stacked(3, tied=True)),
    "tied fitting": lambda: stacked(fitting=True, tied=True),
    "rings": ring,
}  # fmt: skip
