"""A bolted lap joint: clamped by a bolt, then pulled, against hand calculation.

Two plates lie on one another and a bolt goes through both: its head sits on the upper one, its
nut under the lower one.  The bolt is pulled by F, then keeps its length, then the plates are
pulled apart sideways.  They hold by friction up to mu F at the faying surface, as long as the
shank in its wide hole touches nothing.
"""

import numpy as np
import pytest

import amontons as am

MU, CLAMP = 0.25, 200.0
STEEL = am.LinearElastic(2000.0, 0.3)


def brick(low, size, cells, name):
    mesh = am.box(size, cells)
    return am.Body(am.Mesh(mesh.points + low, mesh.cells, mesh.surfaces), STEEL, name)


def bolt_mesh():
    """In the plane: a shank 2 wide and 4 high between a head and a nut, 6 wide and 1 high."""
    x, y = np.arange(7.0), np.arange(7.0)
    number = {}
    points, cells = [], []
    inside = {(i, j) for j in range(6) for i in range(6) if j in (0, 5) or i in (2, 3)}
    for i, j in sorted(inside):
        corners = []
        for a, b in ((0, 0), (1, 0), (1, 1), (0, 1)):
            key = (i + a, j + b)
            if key not in number:
                number[key] = len(points)
                points.append((x[key[0]] - 3, y[key[1]] - 3))
            corners.append(number[key])
        cells.append(corners)
    table = np.array(points)
    under = [[number[i, 5], number[i + 1, 5]] for i in (0, 1, 4, 5)]
    over = [[number[i, 1], number[i + 1, 1]] for i in (0, 1, 4, 5)]
    surfaces = {"head": (am.Facets("line", np.array(under)),),
                "nut": (am.Facets("line", np.array(over)),)}  # fmt: skip
    return am.Mesh(table, (am.Cells("quad", np.array(cells)),), surfaces)


def joint(pull, *, locked=None, mu=MU):
    """Plates left and right of the shank are one body each, joined by a clamp: two halves.

    In the plane the hole cuts a plate in two, so each plate is two pieces that an equation
    holds together, as the metal around a round hole would.
    """
    plates, ties, contacts = [], [], []
    for level, low in (("lower", -2.0), ("upper", 0.0)):
        for side, start in (("left", -6.0), ("right", 2.0)):
            plates.append(brick((start, low), (4.0, 2.0), (4, 2), f"{level} {side}"))
        ties += [
            am.Equation([(f"{level} right.left", c, 1.0), (f"{level} left.right", c, -1.0)])
            for c in (0, 1)
        ]
    for side in ("left", "right"):
        contacts += [
            am.Contact(f"upper {side}.bottom", master=f"lower {side}.top", mu=mu,
                       name=f"faying {side}"),
            am.Contact("bolt.head", master=f"upper {side}.top", mu=0.0,
                       where=_near(side), name=f"head {side}"),
            am.Contact("bolt.nut", master=f"lower {side}.bottom", mu=0.0,
                       where=_near(side), name=f"nut {side}"),
        ]  # fmt: skip
    mesh = am.opened(bolt_mesh(), "cut", (0, 0), (0, 1))
    bolt = am.Body(mesh, STEEL, "bolt")
    middle = int(np.flatnonzero((mesh.points == (0, 3)).all(axis=1))[0])
    bolt = am.Body(am.Mesh(mesh.points, mesh.cells, mesh.surfaces,
                           node_sets={"middle": [middle]}), STEEL, "bolt")  # fmt: skip
    grip = [am.Fix("lower left.left", 0), am.Fix("middle", (0, None))]
    drawn = am.Traction("upper right.right", (lambda x, t: pull * max(0.0, t - 1.0) / 2.0, 0.0))
    loads = [am.NodalForce("F", [lambda x, t: CLAMP * min(t, 1.0)]), drawn]
    return am.Model([*plates, bolt], grip, contacts, loads, constraints=[
        *ties, am.Pretension("F", ("cut-below", "cut-above"), locked=locked),
    ])  # fmt: skip


def _near(side):
    sign = -1.0 if side == "left" else 1.0
    return lambda x: sign * x[:, 0] > 1.5


def sums(step, word):
    return sum(pair.force for name, pair in step.pairs.items() if name.startswith(word))


@pytest.mark.parametrize("share", [0.5, 0.8])
def test_it_holds_by_friction_up_to_mu_times_the_bolt_force(share):
    model = joint(share * MU * CLAMP, locked=1.0)
    # friction on a body that nothing else holds: the last digits come slowly
    steps = am.evolve(model, am.QuasiStatic(step=1.0), until=2.0, tolerance=1e-6)
    clamped, pulled = list(steps)
    assert clamped.references["F"].force == pytest.approx(CLAMP)
    for step in (clamped, pulled):
        force = float(step.references["F"].force[0])
        assert sums(step, "faying")[1] == pytest.approx(force, rel=1e-4)
        assert sums(step, "head")[1] == pytest.approx(force, rel=1e-4)
        assert sums(step, "nut")[1] == pytest.approx(-force, rel=1e-4)
    # the bolt keeps nearly all of its force: plates press on one another, and it is long
    assert pulled.references["F"].force == pytest.approx(CLAMP, rel=0.05)
    assert sums(pulled, "faying")[0] == pytest.approx(-share * MU * CLAMP, rel=1e-4)
    grip = pulled.supports["lower left.left"].force
    assert grip[0] == pytest.approx(-share * MU * CLAMP, rel=1e-4)
    lengths = [step.references["F"].displacement[0] for step in (clamped, pulled)]
    assert lengths[0] == pytest.approx(lengths[1], rel=1e-12)


def test_it_slips_above():
    steps = am.evolve(joint(1.2 * MU * CLAMP, locked=1.0), am.QuasiStatic(step=1.0), until=2.0,
                      tolerance=1e-6)  # fmt: skip
    assert next(steps).solution.converged
    with pytest.raises(am.NotConverged):
        next(steps)
