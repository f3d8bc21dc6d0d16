"""Bodies in contact that lie in each other: depths by hand, and no step that leads there."""

import numpy as np
import pytest

import amontons as am
from amontons.mechanics.contact.in_each_other import Boundary, deepest
from amontons.mechanics.model.after_jumps import led_astray
from amontons.mechanics.model.in_each_other import DEEP, deepest_overlap
from amontons.mechanics.model.large_deformation import large_deformation

KINDS = [(2, "quad", 1), (2, "tri", 2), (3, "hex", 1), (3, "tet", 2)]


def two(first, second):
    """Boundaries of two meshes as those of one model, and all nodes."""
    x = np.concatenate([first.points, second.points])
    return Boundary.of(first, 0), Boundary.of(second, len(first.points)), x


def box(dim, size, cells, at, kind, order, middle=(1.0, 0.03)):
    """A body whose lowest corner is at (x, z); in 3D as deep, and from where, as in middle."""
    deep = [(middle[0], 2, middle[1])][: dim - 2]
    extents = [(size[0], cells[0], at[0]), *deep, (size[1], cells[1], at[1])]
    mesh = am.box(*(tuple(part) for part in list(zip(*extents, strict=True))[:2]),
                  origin=tuple(part[2] for part in extents), kind=kind)  # fmt: skip
    return am.Body(mesh, am.NeoHookean(1.0, 0.3), order=order).mesh


@pytest.mark.parametrize(("dim", "kind", "order"), KINDS)
def test_depths_of_boxes(dim, kind, order):
    """Above, beside, into and through a slab, where its nodes are deepest; all in a box."""
    def deep(size, cells, at, other):
        one = box(dim, size, cells, at, kind, order)
        found, back = (deepest(*two(*pair), 0.0) for pair in ((one, other), (other, one)))
        assert found.depth == back.depth
        assert found.share == back.share
        return found.depth

    slab = box(dim, (2, 0.2), (8, 1), (-1, -0.2), kind, order, (2.0, -0.47))
    assert deep((0.43, 1), (2, 3), (-0.2, 0.01), slab) == 0
    assert deep((0.43, 1), (2, 3), (1.1, -0.5), slab) == 0
    assert deep((0.43, 1), (2, 3), (-0.2, -0.05), slab) == pytest.approx(0.05)
    assert deep((0.43, 2), (1, 1), (-0.2, -1.1), slab) == pytest.approx(0.2)
    thick = box(dim, (2, 1), (3, 2), (-1, -0.6), kind, order, (2.0, -0.47))
    assert deep((0.43, 0.1), (2, 1), (-0.2, -0.15), thick) == pytest.approx(0.4 + 0.05 * order)


def block_on_slab(dim, kind, order=1, *, exchanged=False):
    """A unit block on a wider slab."""
    wide = (3,) * (dim - 1)
    boxes = [("lower", (*wide, 1), (*(2 * k for k in wide), 1), (*(-1 for _ in wide), -1)),
             ("upper", (1,) * dim, (2,) * dim, (0,) * dim)]  # fmt: skip
    law = am.NeoHookean(1.0, 0.3)
    meshes = [am.box(size, cells, origin=origin, kind=kind) for _, size, cells, origin in boxes]
    bodies = [am.Body(mesh, law, name=name, order=order)
              for mesh, (name, *_) in zip(meshes, boxes, strict=True)]  # fmt: skip
    sides = ["upper.bottom", "lower.top"][:: -1 if exchanged else 1]
    held = [am.Fix("lower.bottom", 0), am.Fix("upper.top", 0)]
    return am.Model(bodies, held, [am.Contact(sides[0], master=sides[1], mu=0.3)])


@pytest.mark.parametrize("exchanged", [False, True])
@pytest.mark.parametrize(("dim", "kind", "order"), KINDS)
def test_no_step_leads_deep_into_the_other_body(dim, kind, order, exchanged):
    """A block on end goes into the slab, leans over it, over its end, and sinks in slowly."""
    parts = large_deformation(block_on_slab(dim, kind, order, exchanged=exchanged)).parts
    upper = np.arange(len(parts.X)) >= parts.ends[0]
    start = np.zeros(parts.X.shape)
    x, z = parts.X[upper, 0], parts.X[upper, -1]

    def turned(angle, along, height):
        u, c, s = start.copy(), np.cos(angle), np.sin(angle)
        u[upper, 0] = c * x + s * z - x + along
        u[upper, -1] = -s * x + c * z - z + height
        return u

    into = turned(1.2, 0.3, 0.5)
    told = led_astray(parts, into, start)
    assert "over a jump bodies " in told
    assert "lie in each other at (" in told
    assert not led_astray(parts, into, start, jumped=False).startswith("over")
    assert led_astray(parts, into, into) == ""
    assert led_astray(parts, turned(0.3, 0.0, 0.2), start) == ""  # by less than a quarter
    assert led_astray(parts, turned(0.8, 1.95, 0.05), start) == ""  # at the end of the slab
    assert led_astray(parts, turned(0.0, 0.0, 0.4), start) == ""
    slowly = [turned(1.2, 0.3, height) for height in np.arange(0.9, 0.49, -0.04)]
    assert deepest_overlap(parts, slowly[-1])[0].share > DEEP
    pairs = zip(slowly[1:], slowly, strict=False)
    assert not any(led_astray(parts, now, before, jumped=False) for now, before in pairs)
