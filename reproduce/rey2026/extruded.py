"""The triangle extruded: both older criteria in 3D, for one to three contact nodes.

The triangle ABC of one element becomes a prism of `THICKNESS` along z, BC held, AB over the
floor y <= 0, both sides along z free: as many contact nodes as there are copies of A.
One contact node: the tetrahedron of A and the face BC, of which B is there twice.  Nothing of
this is in the paper, which states the criteria for 3D and computes them in 2D.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

import amontons as am
from amontons.analysis.certificates.energy_bound import energy_bound
from amontons.analysis.certificates.older_criteria import CriterionFriction, critical_discs
from amontons.core.clock import Deadline
from amontons.linear.dense import dense
from amontons.mechanics.ready.hild import CORNERS

THICKNESS = 0.5
SIZES = (1, 2, 3)
WORK = 6.0  # seconds of work for each value: bounds of three contacts stay apart


def extruded(contacts: int) -> am.Model:
    """The model with so many contact nodes, without load: the criteria do not depend on it."""
    held, floor, cells = "BC", "AB", []
    if contacts == 1:
        points = np.vstack([np.column_stack([CORNERS, np.zeros(3)]), [[1.0, 0.0, THICKNESS]]])
        cells = [[0, 1, 2, 3]]
        surfaces = {held: [[1, 2, 3]], floor: [[0, 1, 3]]}
    else:
        layers = np.linspace(0, THICKNESS, contacts)
        points = np.vstack([np.column_stack([CORNERS, np.full(3, z)]) for z in layers])
        surfaces = {held: [], floor: []}
        for first in 3 * np.arange(contacts - 1):
            a, b, c, a2, b2, c2 = first + np.arange(6)
            cells += [[a, b, c, a2], [b, c, a2, b2], [c, a2, b2, c2]]
            surfaces[floor] += [[a, b, a2], [b, a2, b2]]
            surfaces[held] += [[b, c, b2], [c, b2, c2]]
    mesh = am.Mesh(points, (am.Cells("tet", np.array(cells)),),
                   {name: (am.Facets("tri", np.array(nodes)),)
                    for name, nodes in surfaces.items()})  # fmt: skip
    return am.Model(
        [am.Body(mesh, am.LinearElastic(young=1.0, poisson=0.2))],
        supports=[am.Fix(held, 0.0)],
        contacts=[am.Contact(floor, am.Plane(normal=(0, 1, 0)), mu=1.0)],
        name=f"triangle, {contacts} contacts in 3D",
    )


def criteria(sizes: tuple[int, ...] = SIZES) -> Iterator[dict[str, dict]]:
    """Bounds [lower, upper] of every criterion, one number of contact nodes after another."""
    for contacts in sizes:
        local = extruded(contacts).assemble().condensed()
        cheap = float(energy_bound(dense(local.W), np.ones(local.contacts))[0])
        yield {str(contacts): {
            "energy": cheap,
            "mu_P": _bounds(am.p_matrix_friction(local, time_limit=_limit())),
            "mu_P given": _bounds(am.p_matrix_friction(local, given_tangents=True)),
            "critical": _bounds(critical_discs(local, time_limit=_limit())),
            "mu_c": _bounds(am.full_contact_friction(local, time_limit=_limit())),
            "mu_c sharp": _bounds(
                am.full_contact_friction(local, sharp=True, time_limit=_limit())
            ),
        }}  # fmt: skip


def _limit() -> Deadline:
    return Deadline.counted(WORK)


def _bounds(found: CriterionFriction) -> list[float]:
    return [float(found.lower), float(found.upper)]
