"""Where no equilibrium is found further on: sides that have parted, cells that are flat."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ..contact.current_mortar import MortarMeeting
from ..contact.current_pairs import Meetings
from ..contact.shared import HARDLY
from ..elements.hyperelasticity import HyperelasticBody
from .flat_cells import flat_in_words
from .nonlinear_parts import NonlinearParts
from .worst_cells import flattest, turned_corner

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
COVERED = 0.9  # of a master's facet: seen along the slave's normals it is smaller
FLAT = 0.5  # det F below which a cell is worth a word
FALLEN = 0.75  # of contact forces at the beginning of a step, below which a word is due
LEFT = 0.5  # of what a node bore for itself, `fading`, below which it is worth a word


def places_of_failure(
    parts: NonlinearParts, u: Array, earlier: Meetings, closed: Mask,
    forces: tuple[Array, Array] | None = None,
) -> str:  # fmt: skip
    """What may be wrong at displacements u (nodes, d), in words; "" where nothing is seen.

    earlier: where sides met at the beginning of the step; closed (nc,): who bears; forces
    (nc, d): now and then, None where there were none then.
    """
    now = parts.meet(u)
    told = [*_parted(now, earlier, closed), *_flat(parts, u)]
    if forces is not None:
        told += _fallen(now, *forces)
    return f"at the last state {', '.join(told)}" if told else ""


def _parted(now: Meetings, earlier: Meetings, closed: Mask) -> Iterator[str]:
    """Slaves that face nothing of their masters, are leaving their edges, or hang on them."""
    ends = np.cumsum([len(here.slaves) for here in now.parts])[:-1]
    for here, before, bears in zip(
        now.parts, earlier.parts, np.split(closed, ends), strict=True
    ):
        if not (isinstance(here, MortarMeeting) and isinstance(before, MortarMeeting)):
            continue
        if here.pair.fold is not None:
            continue
        names = "{!r} faces {!r}".format(*here.pair.names)
        faced = before.remembered
        left = np.flatnonzero((faced > HARDLY) & (here.remembered < LEFT * faced))
        if not here.met.any():
            yield f"{names} nowhere: no contact force holds anything there"
        elif len(left):
            less = f"by less than half, or no more, at {len(left)} nodes"
            yield f"{names} {less}, as at ({_place(here, left[0])})"
        elif (edge := _hanging(here, bears)) is not None:
            yield f"{names} along an edge alone, as at ({_place(here, edge)})"


def _fallen(now: Meetings, force: Array, before: Array) -> Iterator[str]:
    """Pairs that press much less than at the beginning of the step, as where a body is lifted.

    force, before (nc, d): of contacts now and then.
    """
    ends = np.cumsum([len(here.slaves) for here in now.parts])[:-1]
    sizes = (np.split(np.linalg.norm(each, axis=1), ends) for each in (force, before))
    for here, size, old in zip(now.parts, *sizes, strict=True):
        part = size.sum() / max(old.sum(), np.finfo(float).tiny)
        if isinstance(here, MortarMeeting) and old.any() and part < FALLEN:
            yield ("contact forces on {!r} with {!r}".format(*here.pair.names)
                   + f" have fallen to {100 * part:.2g} % within the step, the largest of "
                   f"them is at ({_place(here, int(size.argmax()))})")  # fmt: skip


def _place(here: MortarMeeting, row: int) -> str:
    return ", ".join(f"{c:.4g}" for c in here.x[here.slaves[row]])


def _hanging(here: MortarMeeting, bears: Mask) -> int | None:
    """A slave (row) that bears where no facet of either side bears as a whole, else None.

    All that bear lie on the rim of their own side, or where the master ends.
    """
    skin, shared = here.pair.slave, here.shared
    rows = np.flatnonzero(bears & here.met)
    bearing, ending, outer = np.zeros((3, len(here.x)), dtype=bool)
    bearing[here.slaves[rows]] = True
    whole = np.zeros(len(skin.nodes), dtype=bool)
    whole[shared.facets] = shared.covered >= 1
    if (whole & bearing[skin.nodes].all(axis=1)).any() or _bears_whole(here, bearing):
        return None
    ending[skin.rim] = True
    master = here.pair.master
    last = np.isin(master.nodes[shared.master], master.rim).any(axis=1)
    outer[skin.nodes[shared.slave[last]]] = True  # who faces the master's last facets
    ending[np.intersect1d(skin.nodes[~whole], np.flatnonzero(outer))] = True
    return int(rows[0]) if len(rows) and ending[bearing].all() else None


def _bears_whole(here: MortarMeeting, bearing: Mask) -> bool:
    """Whether slave facets all of whose nodes bear face a whole facet of the master.

    bearing (nodes,); nodes that fade do not count: they bear what their neighbours do.
    """
    shared, master = here.shared, here.pair.master
    fades = np.zeros(len(here.x), dtype=bool)
    fades[here.slaves] = here.remembered < 1
    nodes = here.pair.slave.nodes[shared.facets]
    bears = np.asarray((bearing[nodes] | fades[nodes] | ~shared.kept).all(axis=1))
    bears &= (bearing[nodes] & shared.kept).any(axis=1)
    pairs = np.flatnonzero(bears[shared.of])
    faced = shared.cross[pairs, :, : master.nodes.shape[1]].sum(axis=(1, 2))
    size = np.linalg.norm(master.areas(here.x), axis=1)
    met = np.bincount(shared.master[pairs], faced, minlength=len(size))
    return bool((met > COVERED * size).any())


def _flat(parts: NonlinearParts, u: Array) -> Iterator[str]:
    """The flattest cell of each body that has finite strains, and the worst corner.

    A surface that folds turns corners inside out before any integration point.
    """
    each = zip(parts.names, parts.bodies, np.split(u, parts.ends), strict=True)
    for name, body, own in each:
        if isinstance(body, HyperelasticBody):
            least, cell = flattest(body.mesh, own)
            if told := flat_in_words(body.mesh, body.material, name, own):
                yield told
            elif least < FLAT:
                yield f"{cell} of body {name!r} is pressed to det F = {least:.3g}"
            if corner := turned_corner(body.mesh, own):
                yield f"{corner} in body {name!r}"
