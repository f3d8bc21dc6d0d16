"""Rigid bodies where they are at the end of a step, as surfaces for viewers."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..core.errors import InvalidInput, shown
from ..core.files import make_folder, replacing, write_bytes
from ..mechanics.meshes.write import with_all_kinds
from ..mechanics.multibody import Ball, Polyhedron

if TYPE_CHECKING:
    from ..mechanics.multibody import RigidStep

Array = NDArray[np.float64]
Index = NDArray[np.int64]
AROUND = 24  # points of a ball on its equator
LIST = "steps.pvd"
PVD = """<?xml version="1.0"?>
<VTKFile type="Collection" version="0.1" byte_order="LittleEndian">
  <Collection>
{}
  </Collection>
</VTKFile>
"""


def write_rigid(step: RigidStep, path: str | os.PathLike[str]) -> None:
    """Write the surfaces of all bodies at the end of a step: .vtu, .vtk, .stl, .ply, .obj.

    Cells have the number of their `body`, points the `velocity` of the material there, where
    the format has fields.  Files of many steps with numbers in their names are a film for
    ParaView.  Raises NotWritten where the file can not be, and the error of the writer for a
    suffix that it does not know.
    """
    meshio = with_all_kinds()
    motion, rotation = step.state.motion, step.rotation
    points, triangles, velocity, body = [], [], [], []
    first = 0
    for k, one in enumerate(step.system.bodies):
        own, faces = surface_of(one.shape)
        arms = own @ rotation[k].T
        points.append(motion.position[k] + arms)
        spin = rotation[k] @ motion.spin[k]
        velocity.append(motion.velocity[k] + np.cross(spin, arms))
        triangles.append(faces + first)
        body.append(np.full(len(faces), k))
        first += len(own)
    mesh = meshio.Mesh(
        np.concatenate(points), [("triangle", np.concatenate(triangles))],
        point_data={"velocity": np.concatenate(velocity)},
        cell_data={"body": [np.concatenate(body)]},
    )  # fmt: skip
    if not os.fspath(path).lower().endswith((".vtu", ".vtk")):
        mesh.point_data, mesh.cell_data = {}, {}
    with replacing(path) as place:
        meshio.write(place, mesh)


def export_rigid(
    steps: Iterable[RigidStep], folder: str | os.PathLike[str], every: int = 1
) -> Iterator[RigidStep]:
    """The same steps, every so many of them written; FOLDER/steps.pvd opens as a film.

    The list is complete after every step.  Raises NotWritten where a file can not be.
    """
    if not (isinstance(every, int | np.integer) and every > 0):
        raise InvalidInput(f"expected a whole number > 0, got {shown(every)}", ("every",))
    return _exported(steps, Path(folder), every)


def _exported(steps: Iterable[RigidStep], place: Path, every: int) -> Iterator[RigidStep]:
    make_folder(place)
    lines: list[str] = []
    for step in steps:
        if step.state.index % every == 0:
            name = f"step-{step.state.index:05d}.vtu"
            write_rigid(step, place / name)
            lines.append(f'    <DataSet timestep="{step.time!r}" file="{name}"/>')
            write_bytes(place / LIST, PVD.format("\n".join(lines)).encode())
        yield step


def surface_of(shape: Ball | Polyhedron) -> tuple[Array, Index]:
    """Points from the centre of mass (n, 3), and triangles (k, 3), anticlockwise outside."""
    if isinstance(shape, Polyhedron):
        fans = [
            (loop[0], loop[k], loop[k + 1])
            for loop in shape.facets.loops for k in range(1, len(loop) - 1)
        ]  # fmt: skip
        return np.asarray(shape.points) - shape.centre, np.array(fans, dtype=np.int64)
    half = AROUND // 2
    polar, round_ = np.pi * np.arange(1, half) / half, 2 * np.pi * np.arange(AROUND) / AROUND
    ring = np.stack([
        np.outer(np.sin(polar), np.cos(round_)), np.outer(np.sin(polar), np.sin(round_)),
        np.repeat(np.cos(polar)[:, None], AROUND, axis=1),
    ], axis=-1).reshape(-1, 3)  # fmt: skip
    points = shape.radius * np.vstack([ring, [[0, 0, 1.0]], [[0, 0, -1.0]]])
    at = np.arange((half - 1) * AROUND).reshape(half - 1, AROUND)
    beside = np.roll(at, -1, axis=1)
    top, bottom = len(ring), len(ring) + 1
    faces = [
        np.stack([at[:-1], at[1:], beside[1:]], axis=-1).reshape(-1, 3),
        np.stack([at[:-1], beside[1:], beside[:-1]], axis=-1).reshape(-1, 3),
        np.stack([np.full(AROUND, top), at[0], beside[0]], axis=-1),
        np.stack([np.full(AROUND, bottom), beside[-1], at[-1]], axis=-1),
    ]
    return points, np.concatenate(faces)
