"""A model's solution in parts, one on each process of MPI."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np
from numpy.typing import NDArray

from ...core.errors import InvalidInput, NotConverged
from ...core.files import put
from ...linear.petsc import petsc
from ...solvers.active_set.spread import SpreadProblem, SpreadSolution
from ..elements.elasticity import von_mises
from ..elements.nodal_stress import stress_of
from ..meshes.partition import part_of
from ..meshes.write import write_meshes
from .cutting import Share
from .together import ended_together, together

Array = NDArray[np.float64]
Index = NDArray[np.int64]
OPEN, STICK, SLIP = range(3)
FIELDS = {"displacement": 3, "contact_force": 3, "contact_status": 1, "reaction": 3,
          "von_mises": 1}  # fmt: skip


@dataclass(frozen=True, eq=False)
class Gathered:
    """A solution on one process, as on a single one.

    displacement: (nodes, d) per body, unit of length; r, u (nc, d): reactions and local
    displacements, gaps included, of contacts in the order of `Model.assemble()`.
    """

    displacement: tuple[Array, ...]
    r: Array
    u: Array


@dataclass(frozen=True, eq=False)
class DistributedSolution:
    """What a process knows of a solution; numbers without an array are those of all processes.

    nodes (o,): its own nodes, numbered through all bodies of the model; displacement and
    reaction (o, d) there, of supports, in global axes; contacts (k,): its own contacts by
    their number in the model, with r, u (k, d) in the frames of the model; resultant (d,): sum
    of the forces on slaves, of all processes.  counts: open, stick, slip of all; error,
    converged, steps (of Newton), iterations (linear ones), rebuilt (times that coarse matrices
    were made), why: in words how the solve has ended.
    """

    nodes: Index
    displacement: Array
    reaction: Array
    contacts: Index
    r: Array
    u: Array
    status: NDArray[np.int8]
    resultant: Array
    counts: dict[str, int]
    error: float
    converged: bool
    steps: int
    iterations: int
    rebuilt: int
    why: str
    comm: Any
    share: Share

    @classmethod
    def of(
        cls, share: Share, problem: SpreadProblem, found: SpreadSolution, comm: Any
    ) -> DistributedSolution:
        """Back in global axes."""
        K, contacts, d = problem.K, share.contacts, share.fixed.shape[1]
        v = K.from_basis(found.y).reshape(-1, d)
        forces = problem.contacts
        rest = K.times(found.y) - problem.f
        rest[forces.dofs] -= found.r
        rest[~problem.fixed] = 0.0
        support = K.force_from_basis(rest).reshape(-1, d)
        for values in (v, support):
            values[contacts.node] = np.einsum(
                "kab,ka->kb", contacts.frames, values[contacts.node]
            )
        part = contacts.part[:, None]
        r = part * found.r
        status = np.where(found.sliding, SLIP, np.where(found.closed, STICK, OPEN))
        total = comm.allreduce(np.concatenate([
            np.einsum("kab,ka->kb", contacts.frames, r).sum(axis=0),
            np.bincount(status, minlength=3),
        ]))  # fmt: skip
        return cls(
            share.nodes[share.own], v, support, contacts.number,
            np.einsum("kab,kb->ka", contacts.turn, r),
            np.einsum("kab,kb->ka", contacts.turn, found.u) / part, status.astype(np.int8),
            total[:d],
            dict(zip(("open", "stick", "slip"), total[d:].astype(int).tolist(), strict=True)),
            found.error, found.converged, found.steps, K.iterations, K.rebuilt, found.why, comm,
            share,
        )  # fmt: skip

    def check(self) -> None:
        """Raise NotConverged, on all processes, unless the solution has converged."""
        if not self.converged:
            raise NotConverged(f"several processes: error {self.error:.1e}; {self.why}")

    # ------------------------------------------------------------------ whole
    def gather(self) -> Gathered | None:
        """All of it on the first process, None on the others; all have to call it."""
        mine = (self.nodes, self.displacement, self.contacts, self.r, self.u)
        every = self.comm.gather(mine)
        if every is None:
            return None
        nodes, moved, contacts, r, u = (np.concatenate(p) for p in zip(*every, strict=True))
        v, w = np.empty_like(moved), np.empty((2, *r.shape))
        v[nodes] = moved
        w[0, contacts], w[1, contacts] = r, u
        ends = np.cumsum(self.share.counts)[:-1]
        return Gathered(tuple(np.split(v, ends)), w[0], w[1])

    # ------------------------------------------------------------------ files
    def write(self, path: str | Path) -> None:
        """A PVTU file that names one VTU file for each process, beside it; all call it.

        Of nodes: displacement, contact_force (on slaves, global axes), contact_status (0 open
        or no contact, 1 sticks, 2 slips), reaction (force of supports), von_mises, unit of
        stress.  Raises on all InvalidInput for another suffix, and what writing a part raises.
        """
        path = Path(path)
        if path.suffix != ".pvtu":
            raise InvalidInput(f"path: expected a name that ends in .pvtu, got {path.name!r}")
        piece = f"{path.stem}_{self.comm.rank}.vtu"
        meshes, fields, cells = self._part()
        names = self.comm.gather(piece if meshes else None)

        def put_own() -> None:
            if meshes:
                write_meshes(path.with_name(piece), meshes, fields, cells)
            if names is not None:
                put(path, _pvtu([name for name in names if name]).encode())

        with ended_together(self.comm):
            together(self.comm, put_own)

    def _part(self) -> tuple[list[Any], dict[str, Array], dict[str, Array]]:
        """Own cells with the values at their nodes; a cell is of the first who has a node."""
        share = self.share
        moved = self._at_local(self.displacement)
        force = np.zeros_like(self.displacement)
        contacts = share.contacts
        local = np.einsum("kba,kb->ka", contacts.turn, self.r)
        force[contacts.node] = np.einsum("kab,ka->kb", contacts.frames, local)
        status = np.zeros((len(force), 1))
        status[contacts.node, 0] = self.status
        fields = {
            "displacement": _spatial(moved), "contact_force": _spatial(self._at_local(force)),
            "contact_status": self._at_local(status)[:, 0],
            "reaction": _spatial(self._at_local(self.reaction)),
        }  # fmt: skip
        owner = np.searchsorted(share.starts, share.number, side="right") - 1
        meshes, stress, used, first = [], [], [], 0
        for _, mesh, material in share.bodies:
            last = first + len(mesh.points)
            stress.append(von_mises(stress_of(mesh, material, moved[first:last])[1]))
            whose = [owner[first:last][block.nodes].min(axis=1) for block in mesh.cells]
            mine, nodes = part_of(mesh, [np.flatnonzero(w == self.comm.rank) for w in whose])
            if mine is not None:
                meshes.append(mine)
                used.append(first + nodes)
            first = last
        own = np.concatenate(stress)[share.own, None]  # ghosts lack some of their cells
        fields["von_mises"] = self._at_local(own)[:, 0]
        count = sum(mesh.cell_count for mesh in meshes)
        at = np.concatenate([np.zeros(0, dtype=np.int64), *used])
        cells = {"process": np.full(count, self.comm.rank)}
        return meshes, {name: values[at] for name, values in fields.items()}, cells

    def _at_local(self, own: Array) -> Array:
        """Values (l, d) at all local nodes of values (o, d) at own ones."""
        PETSc = petsc()
        d, share = own.shape[1], self.share
        v = PETSc.Vec().createMPI((own.size, None), bsize=d, comm=self.comm)
        v.array = own.ravel()
        out = PETSc.Vec().createSeq(len(share.nodes) * d)
        numbers = (share.number[:, None] * d + np.arange(d)).ravel().astype(PETSc.IntType)
        index = PETSc.IS().createGeneral(numbers, comm=self.comm)
        scatter = PETSc.Scatter().create(v, index, out, None)
        scatter.scatter(v, out, mode=PETSc.ScatterMode.FORWARD)
        found = out.array_r.reshape(-1, d).copy()
        for part in (scatter, index, out, v):
            part.destroy()
        return found


def _spatial(values: Array) -> Array:
    """Vectors with a third component."""
    out = np.zeros((len(values), 3))
    out[:, : values.shape[1]] = values
    return out


def _pvtu(names: list[str]) -> str:
    """The file that names the parts."""
    points = "".join(
        f'<PDataArray type="Float64" Name="{name}" NumberOfComponents="{size}"/>\n'
        for name, size in FIELDS.items()
    )
    pieces = "".join(f"<Piece Source={quoteattr(name)}/>\n" for name in names)
    return (
        '<?xml version="1.0"?>\n<VTKFile type="PUnstructuredGrid" version="0.1" '
        'byte_order="LittleEndian">\n<PUnstructuredGrid GhostLevel="0">\n<PPoints>'
        '<PDataArray type="Float64" Name="Points" NumberOfComponents="3"/></PPoints>\n'
        f'<PPointData>\n{points}</PPointData>\n<PCellData><PDataArray type="Int64" '
        f'Name="process"/></PCellData>\n{pieces}</PUnstructuredGrid>\n</VTKFile>\n'
    )
