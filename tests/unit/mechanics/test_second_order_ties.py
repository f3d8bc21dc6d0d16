"""Patch tests of ties and contact between sides of second order whose meshes do not match."""

from dataclasses import replace

import numpy as np
import pytest

import amontons as am
from amontons.mechanics.meshes import second_order
from amontons.mechanics.meshes.facets import turned

LAW = am.LinearElastic(1000.0, 0.3)
SLOPES = 1e-3 * np.array([[1.0, 2.0, -1.0], [-0.5, 3.0, 2.0], [1.5, -2.0, -4.0]])
MESHES = {  # facets of the sides, in 2D and 3D
    "line3 of quad8": ("quad", True), "line3 of quad9": ("quad", False),
    "line3 of tri6": ("tri", False), "quad8": ("hex", True), "quad9": ("hex", False),
    "tri6": ("tet", False), "line": ("quad", None), "quad": ("hex", None),
}  # fmt: skip


def two_blocks(low, high):
    """A unit block on another, 3 cells on 2 along each side, bodies "low" and "high"."""
    bodies = []
    for k, (name, which) in enumerate((("low", low), ("high", high))):
        kind, serendipity = MESHES[which]
        dim = 2 if kind in ("quad", "tri") else 3
        mesh = am.box((1,) * dim, (2 + k,) * (dim - 1) + (2,), kind)
        if serendipity is not None:
            mesh = second_order(mesh, serendipity=serendipity)
        shift = np.eye(dim)[-1] * k
        bodies.append(am.Body(replace(mesh, points=mesh.points + shift), LAW, name))
    return bodies


def planes(dim):
    return ("left", "right", "bottom", "top") + (("front", "back") if dim == 3 else ())


@pytest.mark.parametrize("slave", ["high", "low"])
@pytest.mark.parametrize(
    ("low", "high"),
    [("quad8", "quad8"), ("quad9", "quad8"), ("quad8", "tri6"), ("tri6", "quad8"),
     ("tri6", "tri6"), ("quad", "quad8"), ("line3 of quad8", "line3 of quad8"),
     ("line3 of tri6", "line3 of quad8"), ("line", "line3 of quad9")],
)  # fmt: skip
def test_a_linear_field_goes_through_a_tie(low, high, slave):
    """Held at all outer sides but the tie; both orders of slave and master."""
    bodies = two_blocks(low, high)
    dim = bodies[0].mesh.dim
    A = SLOPES[:dim, :dim]
    inner = {"low": "top", "high": "bottom"}
    supports = [am.Fix(f"{b.name}.{s}", lambda x: A @ x) for b in bodies
                for s in planes(dim) if s != inner[b.name]]  # fmt: skip
    master = "low" if slave == "high" else "high"
    tie = am.Contact(f"{slave}.{inner[slave]}", master=f"{master}.{inner[master]}", tied=True)
    found = am.solve(am.Model(bodies, supports, [tie]), tolerance=1e-12)
    for body, u in zip(bodies, found.displacement, strict=True):
        exact = body.mesh.points @ A.T
        assert np.abs(u - exact).max() < 1e-10 * np.abs(exact).max()


@pytest.mark.parametrize("tied", [True, False])
@pytest.mark.parametrize("kind", ["quad8", "tri6", "quad9", "line3 of quad8"])
def test_a_uniform_pressure_goes_through(kind, tied):
    """Free sides: stress across alone, u = (nu x, nu y, -z) p / E."""
    bodies = two_blocks(kind, kind)
    dim = bodies[0].mesh.dim
    low = ("left", "bottom", "front") if dim == 3 else ("left", "bottom")
    axis = {"left": 0, "front": 1, "bottom": dim - 1}
    supports = [
        am.Fix(f"{b.name}.{s}", [0 if k == axis[s] else None for k in range(dim)])
        for b in bodies for s in low if not (b.name == "high" and s == "bottom")
    ]  # fmt: skip
    law = {"tied": True} if tied else {"mu": 0.2}
    contact = am.Contact("high.bottom", master="low.top", **law)
    model = am.Model(bodies, supports, [contact], [am.Pressure("high.top", 2.0)])
    found = am.solve(model, tolerance=1e-12)
    nu, E = 0.3, 1000.0
    across = nu if dim == 3 else nu * (1 + nu)  # plane strain
    along = 1.0 if dim == 3 else 1 - nu**2
    factors = 2.0 / E * np.array([across] * (dim - 1) + [-along])
    for body, u in zip(bodies, found.displacement, strict=True):
        assert np.abs(u - factors * body.mesh.points).max() < 1e-10 * np.abs(u).max()


def test_sides_that_look_the_same_way_are_tied():
    """A block inside of another one's outline, both tops at one height."""
    one = am.Body(second_order(am.box((1, 1), 2), serendipity=True), LAW, "one")
    mesh = second_order(am.box((1, 1), 3), serendipity=True)
    other = am.Body(mesh, LAW, "other")
    supports = [am.Fix("one.bottom", lambda x: SLOPES[:2, :2] @ x),
                am.Fix("other.bottom", lambda x: SLOPES[:2, :2] @ x)]  # fmt: skip
    tie = am.Contact("other.top", master="one.top", tied=True)
    found = am.solve(am.Model([one, other], supports, [tie]), tolerance=1e-12)
    tops = []
    for body, u in zip((one, other), found.displacement, strict=True):
        on = body.mesh.surface_nodes("top")
        x, at = body.mesh.points[on, 0], u[on]
        order = np.argsort(x)
        assert len(order) == 2 * (2 if body.name == "one" else 3) + 1
        pieces = (at[order][1:] + at[order][:-1]) / 2 * np.diff(x[order])[:, None]
        tops.append(pieces.sum(axis=0))
    assert np.allclose(*tops, rtol=0.05, atol=1e-4)  # the means, by the trapezoidal rule
    loose = am.Model([one, other], supports, [replace(tie, tied=False, mu=0.1)])
    with pytest.raises(am.InvalidInput, match="no part of the slave has a master facet"):
        am.solve(loose)


@pytest.mark.parametrize("kind", ["hex", "tet"])
@pytest.mark.parametrize("order", [1, 2])
def test_turned_facets_have_opposite_normals(kind, order):
    from amontons.mechanics.meshes.surfaces import facet_normals

    mesh = am.box((1, 2, 3), 1, kind)
    for way in (False, True) if order == 2 and kind == "hex" else (False,):
        own = second_order(mesh, serendipity=way) if order == 2 else mesh
        for block, back in zip(own.boundary, turned(own.boundary), strict=True):
            for at in ([0.2, 0.3], [0.3, 0.2]):
                here = facet_normals(own.points, block, np.array(at))
                there = facet_normals(own.points, back, np.array(at[::-1]))
                assert np.allclose(here, -there, atol=1e-12)
