"""Degrees of freedom beside those of nodes: references, their rotations, bolts, turned axes.

They follow those of the nodes in all vectors (dofs,) of a model, and have names as surfaces
have, by which supports, forces and equations speak of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from ...core.errors import InvalidInput, within
from ..elements.rigid import Rigid
from ..meshes.mesh import unknown
from .constraints import ROTATION, Axes, Constraint, Coupling, Pretension, Reference, Where
from .parts import Body
from .supports import locate

Array = NDArray[np.float64]
Index = NDArray[np.int64]
POINT, TURN, LENGTH, AXES = "reference", "rotation of reference", "pretension", "axes"


@dataclass(frozen=True, eq=False)
class Entry:
    """Degrees of freedom under one name: dofs (k, c), and the points (k, dim) they belong to.

    axes (k, dim, dim): directions of the components, None where they are the global ones.
    held: prescribed without a support; still: components that are.
    """

    kind: str
    dofs: Index
    points: Array
    axes: Array | None = None
    held: bool = False
    still: tuple[int, ...] = ()


@dataclass(frozen=True, eq=False)
class Beside:
    """All degrees of freedom of a model by name; those from `first` to `total` are no nodes."""

    bodies: Sequence[Body]
    offsets: Index
    total: int
    entries: dict[str, Entry] = field(default_factory=dict)

    @classmethod
    def of(
        cls, bodies: Sequence[Body], references: Sequence[Reference] = (),
        constraints: Sequence[Constraint] = (),
    ) -> Beside:  # fmt: skip
        """Number what references and constraints need; raises InvalidInput for equal names."""
        offsets = np.cumsum([0, *(body.mesh.points.size for body in bodies)])
        made = cls(bodies, offsets, int(offsets[-1]))
        dim = bodies[0].mesh.dim
        for k, reference in enumerate(references):
            at = np.asarray(reference.point, dtype=float)
            with within("references", k):
                if at.shape != (dim,):
                    raise InvalidInput(
                        f"expected {dim} coordinates, got {len(at)}", ("point",),
                        f"reference {reference.name!r}",
                    )  # fmt: skip
                made = made._with(reference.name, POINT, at[None], dim)
                turns = 1 if dim == 2 else 3
                made = made._with(reference.name + ROTATION, TURN, at[None], turns)
        for k, part in enumerate(constraints):
            with within("constraints", k):
                if isinstance(part, Pretension):
                    body, surface = locate(bodies, part.sides[0])
                    mesh = bodies[body].mesh
                    middle = mesh.points[mesh.surface_nodes(surface)].mean(axis=0)
                    made = made._with(part.name, LENGTH, middle[None], 1)
                    entry = replace(made.entries[part.name], held=part.held)
                    made.entries[part.name] = entry
                elif isinstance(part, Axes):
                    made = made._with_axes(part, dim)
                elif isinstance(part, Coupling):
                    made._hold_off_axis(part)
        return made

    def _hold_off_axis(self, part: Coupling) -> None:
        """Around an axis a rigid body, and the reference that it follows, moves along it."""
        if not self.bodies[0].mesh.axisymmetric or part.reference not in self.entries:
            return
        body = self.bodies[self._numbered(part.on)[0]]
        if isinstance(body.material, Rigid):
            for name, still in ((part.reference, (0,)), (part.reference + ROTATION, (0,))):
                self.entries[name] = replace(self.entries[name], still=still)

    def _with(
        self, name: str, kind: str, points: Array, size: int, axes: Array | None = None
    ) -> Beside:
        """With more degrees of freedom, `size` for each point."""
        known = {s for b in self.bodies for s in (*b.mesh.surfaces, *b.mesh.node_sets, b.name)}
        if name in self.entries or name in known:
            raise InvalidInput(
                f"{kind} {name!r}: a reference, surface, node set or body has this name "
                "already", ("name",), "",
            )  # fmt: skip
        dofs = self.total + np.arange(len(points) * size).reshape(len(points), size)
        entries = self.entries | {name: Entry(kind, dofs, points, axes)}
        return Beside(self.bodies, self.offsets, self.total + dofs.size, entries)

    def _with_axes(self, part: Axes, dim: int) -> Beside:
        dofs, points = self.nodes(part.on)
        axes = np.broadcast_to(part.axes, (len(dofs), *part.axes.shape[-2:]))
        if part.axes.ndim == 3 and len(part.axes) != len(dofs) or axes.shape[1:] != (dim, dim):
            raise InvalidInput(
                f"expected shape ({dim}, {dim}) or ({len(dofs)}, {dim}, {dim}), got "
                f"{part.axes.shape}", ("axes",), f"axes {part.name!r}",
            )  # fmt: skip
        return self._with(part.name, AXES, points, dim, axes)

    @property
    def first(self) -> int:
        """Number of degrees of freedom of nodes."""
        return int(self.offsets[-1])

    @property
    def count(self) -> int:
        """Number of the others."""
        return self.total - self.first

    @property
    def dim(self) -> int:
        """2 or 3."""
        return self.bodies[0].mesh.dim

    def named(self, name: str) -> Entry | None:
        """What is beside the nodes under a name."""
        return self.entries.get(name) if isinstance(name, str) else None

    def nodes(self, where: Where) -> tuple[Index, Array]:
        """Dofs (k, dim) and points (k, dim) of nodes; raises InvalidInput for unknown ones."""
        k, numbers = self._numbered(where)
        mesh = self.bodies[k].mesh
        wrong = (numbers < 0) | (numbers >= len(mesh.points))
        if wrong.any():
            raise InvalidInput(
                f"node {numbers[wrong][0]}: expected a number from 0 to {len(mesh.points) - 1}"
            )
        dofs = self.offsets[k] + numbers[:, None] * mesh.dim + np.arange(mesh.dim)
        return dofs, mesh.points[numbers]

    def _numbered(self, where: Where) -> tuple[int, Index]:
        """(body, numbers of nodes in it)."""
        if isinstance(where, str):
            named = [k for k, body in enumerate(self.bodies) if body.name == where]
            if named and not any(where in b.mesh.surfaces or where in b.mesh.node_sets
                                 for b in self.bodies):  # fmt: skip
                return named[0], np.arange(len(self.bodies[named[0]].mesh.points))
            if not self._knows(where):
                names = [*self.entries, *(b.name for b in self.bodies)]
                for body in self.bodies:
                    names += [*body.mesh.surfaces, *body.mesh.node_sets]
                raise InvalidInput(unknown("node set", where, dict.fromkeys(names)))
            k, surface = locate(self.bodies, where, sets=True)
            return k, self.bodies[k].mesh.surface_nodes(surface)
        body: object = None
        numbers: object = where
        if isinstance(where, tuple):
            body, numbers = where
        elif len(self.bodies) > 1:
            raise InvalidInput(f"node {where}: of which body? write (body, {where})")
        names = [b.name for b in self.bodies]
        if body is not None and body not in names:
            raise InvalidInput(unknown("body", body, names))
        try:
            given = np.atleast_1d(np.asarray(numbers, dtype=np.int64))
        except (TypeError, ValueError):
            raise InvalidInput(f"nodes: expected numbers or a name, got {where!r}") from None
        return 0 if body is None else names.index(str(body)), given

    def _knows(self, name: str) -> bool:
        """True for a name that `locate` finds, in one body or in several, which it says."""
        own = [{*body.mesh.surfaces, *body.mesh.node_sets} for body in self.bodies]
        return any(
            name in known or (name.startswith(f"{body.name}.")
                              and name[len(body.name) + 1 :] in known)
            for body, known in zip(self.bodies, own, strict=True)
        )  # fmt: skip

    def where(self, dof: int) -> str:
        """A degree of freedom in words: node, body and component."""
        for name, entry in self.entries.items():
            k = dof - int(entry.dofs[0, 0])
            if 0 <= k < entry.dofs.size:
                row, component = divmod(k, entry.dofs.shape[1])
                if entry.kind == LENGTH:
                    return f"{LENGTH} {name!r}"
                title = name.removesuffix(ROTATION)
                place = f" at {entry.points[row].tolist()}" if entry.kind == AXES else ""
                return f"component {component} of {entry.kind} {title!r}{place}"
        k = int(np.searchsorted(self.offsets, dof, side="right")) - 1
        node, component = divmod(dof - int(self.offsets[k]), self.dim)
        body = self.bodies[k]
        own = f" of body {body.name!r}" if len(self.bodies) > 1 else ""
        return f"component {component} of node {node}{own} at {body.mesh.points[node].tolist()}"
