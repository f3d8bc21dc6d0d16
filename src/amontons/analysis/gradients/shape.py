"""The gradient in node positions, one by one, of linear elastic bodies in nodal contact.

With a(L, U; x) = L^T K(x) U, the sum over points of integration of volume times strain of L
times stress of U, nodes that move by y with the gradient G = grad y change, at each of them,

    d grad U = -(grad U) G,    d volume = volume tr G,

so that the derivative of the sum itself, with its rule of integration, is

    da = sum volume [ (s(U):e(L)) tr G - s(U):(grad L G) - s(L):(grad U G) ].

A nodal contact with an obstacle changes its gap by n . y and turns its frame; that is taken by
differences of the frames, contact by contact.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ...core.errors import UnsupportedForm
from ...mechanics.contact.geometry import frames
from ...mechanics.elements.cell_matrices import rule_of
from ...mechanics.elements.elasticity import materials_by_region
from ...mechanics.elements.hybrid import element_formulation
from ...mechanics.elements.rigid import Rigid
from ...mechanics.meshes.cells import CELLS
from ...mechanics.meshes.check import determinant
from ...mechanics.model import Body, NodalForce
from ...mechanics.model.placing import is_mortar

if TYPE_CHECKING:
    from .model_gradient import ModelGradient

Array = NDArray[np.float64]
STENCIL = ((-2, 1 / 12), (-1, -2 / 3), (1, 2 / 3), (2, -1 / 12))
STEP = 1e-3  # of the size of a facet, by which frames are taken beside a node


def points_gradient(gradient: ModelGradient) -> tuple[Array, ...]:
    """(nodes, dim) per body; raises UnsupportedForm where it would not be exact."""
    model, parts = gradient.model, gradient.parts
    _refuse(model)
    solution = gradient.problem.solution
    assert solution.v is not None
    U = parts.spread(solution.v, model.load_factor * parts.prescribed)
    out = []
    for k, body in enumerate(model.bodies):
        a, b = int(parts.offsets[k]), int(parts.offsets[k + 1])
        shape = body.mesh.points.shape
        own = gradient.of_load[a:b].reshape(shape)
        out.append(-_of_stiffness(body, own, U[a:b].reshape(shape)))
    _add_contacts(gradient, U, out)
    return tuple(out)


def _refuse(model: Any) -> None:
    """Raise UnsupportedForm where loads, friction or other contacts depend on positions."""
    why = ""
    for load in model.loads:
        if not isinstance(load, NodalForce) or callable(load.value):
            why = f"the load on {getattr(load, 'on', 'a body')!r} depends on where nodes are"
    for support in model.supports:
        values = support.value if isinstance(support.value, list | tuple) else [support.value]
        if any(callable(value) for value in values):
            why = f"the support on {support.on!r} is a function of x"
    for body in model.bodies:
        laws = materials_by_region(body.mesh, body.material)
        if any(isinstance(law, Rigid) or not hasattr(law, "moduli") for law in laws.values()):
            why = f"body {body.name!r} has no elastic law"
        for cells in body.mesh.cells:
            law = laws.get(cells.region)
            if body.mesh.axisymmetric or element_formulation(body.mesh, cells, law) not in (
                "full", "reduced",
            ):  # fmt: skip
                why = f"cells of body {body.name!r} have no plain rule of integration"
    for contact in model.contacts:
        k = next(i for i, b in enumerate(model.bodies) if _has(b, contact.slave))
        mesh, name = model.bodies[k].mesh, contact.slave.split(".")[-1]
        others = [n for n in contact.numbers if n != "mu" or callable(contact.numbers[n])]
        if contact.master is not None or is_mortar(mesh, name, contact) or others or (
            contact.follows is not None or callable(contact.clearance)
        ):  # fmt: skip
            why = f"contact on {contact.slave!r} is no nodal one with a rigid obstacle and mu"
    if why:
        raise UnsupportedForm(
            f"points: {why}; use along(make, at) with a family of models that move the nodes, "
            "or jvp(points=…)"
        )


def _has(body: Body, surface: str) -> bool:
    return surface in body.mesh.surfaces or surface.removeprefix(f"{body.name}.") in (
        body.mesh.surfaces
    )


def _of_stiffness(body: Body, L: Array, U: Array) -> Array:
    """d(L^T K U)/dx, (nodes, dim)."""
    mesh: Any = body.mesh
    law_of: Mapping[str, Any] = materials_by_region(mesh, body.material)
    out = np.zeros(mesh.points.shape)
    for cells in mesh.cells:
        kind, C = CELLS[cells.kind], law_of[cells.region].moduli(mesh.dim)
        x, nodes = mesh.points[cells.nodes], cells.nodes
        for at, weight in zip(*rule_of(mesh, cells), strict=True):
            G = kind.gradients(x, at)
            volume = weight * determinant(kind.jacobians(x, at))
            of_U, of_L = (np.einsum("kai,kaj->kij", y[nodes], G) for y in (U, L))
            stress_U = np.einsum("ijkl,njl->nik", C, of_U)
            stress_L = np.einsum("jilk,njl->nik", C, of_L)  # C has this symmetry for all laws
            energy = np.einsum("nij,nij->n", stress_U, of_L)
            pull = np.einsum("nkl,nkm->nml", stress_U, of_L)
            pull += np.einsum("nkl,nkm->nml", stress_L, of_U)
            part = energy[:, None, None] * G - np.einsum("nml,nal->nam", pull, G)
            np.add.at(out, nodes, volume[:, None, None] * part)
    return out


def _add_contacts(gradient: ModelGradient, U: Array, out: list[Array]) -> None:
    """What gaps and frames of contacts do, added to out."""
    model, parts, g = gradient.model, gradient.parts, gradient.problem
    r, w, d, first = g.solution.r, g.w, model.dimension, 0
    for contact, placed in zip(model.contacts, parts.placed, strict=True):
        rows, k = placed.rows, placed.body
        count = len(rows.nodes)
        own = slice(first, first + count)
        first += count
        dofs = int(parts.offsets[k]) + rows.nodes[:, None] * d + np.arange(d)
        here = gradient.of_load[dofs], U[dofs]
        vector = r[own][:, :, None] * here[0][:, None] + w[own][:, :, None] * here[1][:, None]
        slope = np.zeros((count, d))
        obstacle: Any = contact.obstacle
        if contact.clearance is None and not contact.tied:
            slope += w[own, :1] * rows.frames[:, 0]
        size = rows.weights ** (1 / (d - 1))
        for axis in range(d):
            for step, share in STENCIL:
                points = rows.points.copy()
                points[:, axis] += step * STEP * size
                turned = frames(obstacle.normals(points))
                change = np.einsum("cka,cka->c", turned, vector)
                slope[:, axis] += share * change / (STEP * size)
        np.add.at(out[k], rows.nodes, slope)
