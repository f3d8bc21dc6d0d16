"""Rigid tools of a deck that are analytic surfaces: profiles, extruded or revolved.

*SURFACE, TYPE=SEGMENTS, CYLINDER or REVOLUTION is the shape, *RIGID BODY, ANALYTICAL SURFACE=
says which node moves it.  Such a tool is a rigid body of the model without any other part; on
which side of the surface its material lies is told by the slave that faces it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ...core.errors import InvalidInput
from ...mechanics.contact import Extrusion, Profile, Revolution
from ...mechanics.meshes import Cells, Mesh
from ...mechanics.meshes.surfaces import facet_normals
from ...mechanics.model import Axes, Equation, Rigid, Spring
from ...mechanics.model.parts import Body
from .cards import Row, number
from .scopes import Analytic

if TYPE_CHECKING:
    from .joints import Joints
    from .meshing import Region

Array = NDArray[np.float64]
Tool = Profile | Extrusion | Revolution
OWN = "deck"  # the body of all elements, where tools are others
SHAPES = {"SEGMENTS": 0, "CYLINDER": 9, "REVOLUTION": 6}  # numbers before START
PLANE = 1e-9  # of its size, by which a profile in the plane may stand out of it


def obstacle_of(surface: Analytic, dim: int) -> Tool:
    """The obstacle of an analytic surface; raises FileFormatError with the line."""
    card = surface.card
    kind = card.label("TYPE") or ""
    if "FILLETRADIUS" in card.options:
        raise card.error("FILLET RADIUS: is not read, write the arcs")
    if (kind == "SEGMENTS") != (dim == 2):
        raise card.error(f"TYPE={kind}: expected SEGMENTS in 2D, CYLINDER or REVOLUTION in 3D")
    rows = [row for row in card.rows() if any(row.fields)]
    begin = next((k for k, r in enumerate(rows) if r.fields[0].upper() == "START"), None)
    if begin is None:
        raise card.error("START: missing, expected a line with the first point of the profile")
    frame = [number(text, row, "axes") for row in rows[:begin] for text in row.fields]
    if len(frame) not in (0, SHAPES[kind]):
        raise card.error(f"expected {SHAPES[kind]} coordinates before START, got {len(frame)}")
    try:
        profile = _profile(rows[begin], rows[begin + 1 :])
        return _placed(kind, profile, frame, surface)
    except InvalidInput as reason:
        raise card.error(str(reason)) from None


def _profile(start: Row, rows: Sequence[Row]) -> Profile:
    steps: list[Any] = []
    for row in rows:
        word = row.fields[0].upper()
        count = {"LINE": 2, "CIRCL": 4}.get(word)
        if count is None:
            raise row.error(f"{row.fields[0]}: expected LINE or CIRCL, a line or an arc")
        at = _numbers(row, count)
        steps.append(at[:2] if count == 2 else (at[:2], at[2:]))
    return Profile(_numbers(start, 2), steps)


def _numbers(row: Row, count: int) -> list[float]:
    values = [number(text, row, row.fields[0]) for text in row.fields[1:]]
    if len(values) != count:
        raise row.error(f"{row.fields[0]}: expected {count} numbers, got {len(values)}")
    return values


def _placed(kind: str, profile: Profile, frame: list[float], surface: Analytic) -> Tool:
    """The profile where it stands; without a frame in the axes of its part."""
    if kind == "SEGMENTS":
        ends = [profile.start, *(end for end, _ in profile.steps)]  # type: ignore[misc]
        abouts = [about for _, about in profile.steps]  # type: ignore[misc]
        moved = [_in_plane(end, surface) for end in ends]
        centers = [None if a is None else _in_plane(a, surface) for a in abouts]
        return Profile(moved[0], list(zip(moved[1:], centers, strict=True)))
    default = [0, 0, 0, 0, 1, 0] if kind == "REVOLUTION" else [0, 0, 0, 1, 0, 0, 0, 0, 1]
    points = surface.move(np.array(frame or default, dtype=float).reshape(-1, 3))
    if kind == "REVOLUTION":
        return Revolution(profile, points[0].tolist(), (points[1] - points[0]).tolist())
    x = points[1] - points[0]
    y = np.cross(points[2] - points[0], x)
    return Extrusion(profile, points[0].tolist(), x.tolist(), y.tolist())


def _in_plane(point: Any, surface: Analytic) -> list[float]:
    at = surface.move(np.array([[*point, 0.0]]))[0]
    if abs(at[2]) > PLANE * max(1.0, float(np.abs(at).max())):
        raise InvalidInput("its instance takes the profile out of the plane z = 0")
    return at[:2].tolist()


def faced(obstacle: Tool, mesh: Mesh, slave: str) -> Tool:
    """The obstacle with its material on the side that a slave surface looks at."""
    toward, near = [], []
    for block in mesh.surface(slave):
        normal = facet_normals(mesh.points, block)
        centre = mesh.points[block.nodes].mean(axis=1)
        toward.append(np.einsum("kc,kc->k", normal, obstacle.normals(centre)))
        near.append(np.abs(obstacle.gap(centre)))
    cosine, distance = np.concatenate(toward), np.concatenate(near)
    size = float(np.abs(cosine).max()) ** (1 / max(mesh.dim - 1, 1))
    closest = distance <= distance.min() + size
    return obstacle.turned if cosine[closest].sum() > 0 else obstacle


def tool_bodies(joints: Joints, region: Region) -> list[Body]:
    """The rigid bodies of analytic surfaces."""
    points = joints.deck.points[:, : region.dim]
    around = region.plane == "axisymmetric"
    return [_tool_body(name, points[node], points, axisymmetric=around)
            for name, node in joints.tools]  # fmt: skip


def own_nodes(parts: Sequence[Any]) -> list[Any]:
    """Constraints and springs whose numbers of nodes say that they are of the deck's body."""

    def own(where: Any) -> Any:
        return where if isinstance(where, str) else (OWN, where)

    out = []
    for part in parts:
        if isinstance(part, Equation | Spring):
            terms = [(own(where), component, factor) for where, component, factor in part.terms]
            out.append(replace(part, terms=terms))
        else:
            out.append(replace(part, on=own(part.on)) if isinstance(part, Axes) else part)
    return out


def _tool_body(name: str, at: Array, deck_points: Array, *, axisymmetric: bool) -> Body:
    """A rigid body around a reference node at (dim,); its mesh only carries the motion."""
    dim = len(at)
    size = float(np.ptp(deck_points, axis=0).max()) / 10 or 1.0
    corners = np.concatenate([np.zeros((1, dim)), size * np.eye(dim)])
    origin = at - size / 4
    if axisymmetric:
        origin[0] = max(float(at[0]), 0.0)
    kind = "tri" if dim == 2 else "tet"
    mesh = Mesh(origin + corners, (Cells(kind, np.arange(dim + 1)[None], name),), name=name)
    return Body(mesh, Rigid(), name, axisymmetric=axisymmetric)
