"""A model solved by several processes of MPI: each assembles the cells of its own part.

    mpirun -n 4 python script.py

Every process makes the model (its arrays, not its matrices) and calls `distributed`.  METIS
cuts the cells of all bodies into one part per process; each assembles its part,
PETSc solves with the sum.  Contact is found and solved on the first process.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...core.errors import UnsupportedForm
from ...linear.distributed import DistributedMatrix, Share
from ...linear.petsc import Petsc, mpi, petsc
from ..elements.elasticity import stiffness
from ..elements.given import GivenMatrices
from ..elements.rigid import Rigid
from ..meshes.partition import extract, partition
from .assembly import Discretisation, discretise
from .model import Model
from .parts import Body
from .rigid import loose_modes

Array = NDArray[np.float64]
Index = NDArray[np.int64]
T = TypeVar("T")


def distributed(
    model: Model, work: Callable[[Model], T], *, linear: Petsc | None = None, comm: Any = None
) -> T | None:
    """What `work` returns for the model whose stiffness is spread over all processes of `comm`.

    All processes call it with equal models.  work(model) runs on the first one only, and there
    `model.assemble()`, `drive` and `model.recover` do as always; the others take part in
    products and solves with the stiffness and return None.  comm: a communicator of mpi4py, by
    default all processes.  Raises MissingDependency without the extra `distributed`,
    InvalidInput for more processes than cells, UnsupportedForm when contact alone holds a
    body, and on the first process what `work` raises.
    """
    if any(isinstance(body.material, GivenMatrices) for body in model.bodies):
        raise UnsupportedForm(
            "model: several processes assemble their own cells, and a body has a given K"
        )
    if any(isinstance(body.material, Rigid) for body in model.bodies):
        raise UnsupportedForm("model: several processes need bodies that deform, none is Rigid")
    petsc()
    comm = mpi().COMM_WORLD if comm is None else comm
    share = _share(model.bodies, comm)

    def lead() -> T:
        K = DistributedMatrix(share, np.arange(share.size), linear or Petsc())
        twin = replace(model)
        parts = discretise(twin.bodies, twin.supports, twin.loads, twin.contacts, K)
        _check_held(parts)
        twin._shared.put(discretise, (), parts)
        return work(twin)

    return share.lead(lead)


def _check_held(parts: Discretisation) -> None:
    """Conjugate gradients need a stiffness that can be inverted."""
    fixed = np.zeros(parts.dofs, dtype=bool)
    fixed[parts.fixed] = True
    for piece, _ in loose_modes(parts.parts, fixed):
        raise UnsupportedForm(
            f"{piece.name}: supports leave rigid motions free that contact alone can hold; "
            "several processes need bodies held by supports, solve this model on one"
        )


def _share(bodies: Sequence[Body], comm: Any) -> Share:
    """The part of this process, assembled."""
    labels = comm.bcast(partition([body.mesh for body in bodies], comm.size))
    dim = bodies[0].mesh.dim
    points = np.concatenate([body.mesh.points for body in bodies])
    owner = np.full(len(points), comm.size)
    parts, nodes, offset = [], [], 0
    for body, label in zip(bodies, labels, strict=True):
        _lower(owner[offset : offset + len(body.mesh.points)], body, label)
        mine = label == comm.rank
        if mine.any():
            mesh, used = extract(body.mesh, mine)
            material = body.material
            assert not isinstance(material, Rigid | GivenMatrices)
            if isinstance(material, Mapping):
                material = {region: material[region] for region in mesh.regions}
            parts.append(stiffness(mesh, material).tocsr())
            nodes.append(offset + used)
        offset += len(body.mesh.points)
    dofs = (np.concatenate(nodes)[:, None] * dim + np.arange(dim)).ravel()
    part = sparse.csr_array(sparse.block_diag(parts, format="csr"))
    return Share(comm, part, dofs, owner, points)


def _lower(owner: Index, body: Body, label: Index) -> None:
    """Nodes belong to the first part that has a cell with them; owner (nodes,) in place."""
    first = 0
    for block in body.mesh.cells:
        part = label[first : first + len(block.nodes)]
        for column in block.nodes.T:
            np.minimum.at(owner, column, part)
        first += len(block.nodes)
