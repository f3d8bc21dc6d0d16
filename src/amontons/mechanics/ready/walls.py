"""Masonry: walls of blocks in dry contact, on a floor or a support and under a plate.

The columns of H are independent by construction where the blocks are elastic.  Blocks are
numbered upwards, rows from left to right, the plate last; every node is the slave of one
contact at most, and its master lies on a block with a smaller number, on the lower support, or
on a rigid plate.  So the contacts, in this order, form a triangular matrix with ones at the
slave nodes.  Where faces meet at an edge, the bed joint takes the node, and a bed node over the
joint of two blocks goes to the left one.  Nodes of an elastic plate are slaves of the blocks
below; a rigid plate has none to give, so the blocks of the last row are its slaves.

A wall of rigid blocks has the same contacts with 6 unknowns per block, and H of that rank.

Blocks that turn (`corotational`) meet by averages where they are: a bed joint is one contact
with all blocks of the row below, so that a block may slide from one to the next, and takes the
edges of its face; head joints have what is above.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from ...core.errors import InvalidInput
from ..contact import Plane
from ..meshes import box
from ..model import Body, BodyForce, Contact, Fix, LinearElastic, Model, Rigid, Traction
from ..model.values import VectorValue

Array = NDArray[np.float64]
SAME = 1e-9  # lengths that differ by less, relative to a block's length, are the same


class Bond(Enum):
    """How the rows lie on each other."""

    STACK = "joints one above the other"
    RUNNING = "every second row shifted by half a block, half blocks at its ends"
    TOOTHED = "every second row shifted by half a block, no half blocks"
    ALTERNATING = "a half block more in every row, at its left end and at its right end in turn"


@dataclass(frozen=True)
class Wall:
    """A wall of equal blocks: `rows` rows of `blocks` blocks each, in bond.

    size: length, thickness and height of a block (length and height in 2D); cells: of a block
    per direction, an even number along its length where half blocks occur.  A row of half
    blocks holds one block more.  mu between blocks, mu_support at the floor and at the plate.
    plate: height of the plate that lies on top, 0 for none; base: height of the support below,
    0 for a floor that is no body.  Both have the material plate_material, by default that of
    the blocks.  rigid: no block deforms, nor do plate and base without a material of their own;
    they keep the density of the material.  corotational: blocks turn, by whatever angle, each
    in a frame of its own, and joints open, close and slide where they are now.  What falls so
    far that other faces would meet passes through.
    """

    rows: int
    blocks: int
    size: Sequence[float]
    cells: Sequence[int]
    material: LinearElastic
    bond: Bond = Bond.RUNNING
    mu: float = 0.83
    mu_support: float = 0.53
    plate: float = 0.0
    plate_material: LinearElastic | Rigid | None = None
    base: float = 0.0
    rigid: bool = False
    corotational: bool = False

    def __post_init__(self) -> None:
        plate_is_rigid = isinstance(self.plate_material, Rigid)
        if self.corotational and (self.rigid or plate_is_rigid):
            raise InvalidInput(
                "corotational: blocks that turn are elastic, as plate and base are; expected "
                "no rigid ones"
            )
        for name in ("rows", "blocks"):
            value = getattr(self, name)
            if not (isinstance(value, int) and value >= 1):
                raise InvalidInput(f"{name}: expected a whole number >= 1, got {value!r}")
        if not isinstance(self.bond, Bond):
            raise InvalidInput(f"bond: expected a Bond, got {self.bond!r}")
        if len(self.size) not in (2, 3) or len(self.cells) != len(self.size):
            raise InvalidInput(
                f"size, cells: expected 2 or 3 numbers each, got {self.size!r}, {self.cells!r}"
            )
        for name in ("plate", "base"):
            height = getattr(self, name)
            if not height >= 0:
                raise InvalidInput(f"{name}: expected a height >= 0, got {height!r}")
        halved = self.bond is Bond.ALTERNATING or (self.bond is Bond.RUNNING and self.rows > 1)
        if halved and self.cells[0] % 2:
            raise InvalidInput(
                "cells: expected an even number along the length, for half blocks, "
                f"got {self.cells[0]}"
            )

    # ------------------------------------------------------------------ geometry
    @property
    def height(self) -> float:
        """Height of the wall, without plate and base."""
        return self.rows * self.size[-1]

    @property
    def spans(self) -> list[list[tuple[float, float]]]:
        """(left, right) of every block, row by row."""
        rows = [self._edges(bool(row % 2)) for row in range(self.rows)]
        return [list(zip(edges[:-1], edges[1:], strict=True)) for edges in rows]

    def _edges(self, is_second: bool) -> list[float]:
        """Ends of the blocks of the first row, or of the second one, as of all others."""
        length = self.size[0]
        whole = [k * length for k in range(self.blocks + 1)]
        if self.bond is Bond.STACK or (not is_second and self.bond is not Bond.ALTERNATING):
            return whole
        shifted = [edge + length / 2 for edge in whole]
        if self.bond is Bond.TOOTHED:
            return shifted
        if self.bond is Bond.RUNNING:
            return [0.0, *shifted[:-1], whole[-1]]
        return [*whole, shifted[-1]] if is_second else [0.0, *shifted]

    @property
    def bodies(self) -> list[Body]:
        """The base, the blocks, "row 1 block 1" and so on from below, and the plate."""
        out = [self._slab("base", 0, -self.base, self.base)] if self.base else []
        for row, spans in enumerate(self.spans):
            for k, span in enumerate(spans):
                out.append(self._block(f"row {row + 1} block {k + 1}", span, row))
        if self.plate:
            out.append(self._slab("plate", -1, self.height, self.plate))
        return out

    def _block(self, name: str, span: tuple[float, float], row: int) -> Body:
        along = round(self.cells[0] * (span[1] - span[0]) / self.size[0])
        mesh = box(
            (span[1] - span[0], *self.size[1:]), (along, *self.cells[1:]),
            origin=(span[0], *self._thickness_zero, row * self.size[-1]),
        )  # fmt: skip
        return Body(mesh, self._block_material, name=name, corotational=self.corotational)

    def _slab(self, name: str, row: int, bottom: float, height: float) -> Body:
        """A plate as long as a row, from a height on."""
        left, right = self.spans[row][0][0], self.spans[row][-1][1]
        along = round(self.cells[0] * (right - left) / self.size[0])
        mesh = box(
            (right - left, *self.size[1:-1], height), (along, *self.cells[1:-1], 1),
            origin=(left, *self._thickness_zero, bottom),
        )  # fmt: skip
        return Body(mesh, self.plate_material or self._block_material, name=name,
                    corotational=self.corotational)  # fmt: skip

    @property
    def _block_material(self) -> LinearElastic | Rigid:
        return Rigid(self.material.density) if self.rigid else self.material

    @property
    def _thickness_zero(self) -> tuple[float, ...]:
        return (0.0,) * (len(self.size) - 2)

    # ------------------------------------------------------------------ contacts
    @property
    def contacts(self) -> list[Contact]:
        """All contacts: floor or base, bed joints, head joints, plate."""
        up = (*self._thickness_zero, 0.0, 1.0)
        out = []
        for row, spans in enumerate(self.spans):
            for k, span in enumerate(spans):
                name = f"row {row + 1} block {k + 1}"
                if row == 0 and self.base:
                    out.append(Contact(f"{name}.bottom", master="base.top",
                                       mu=self.mu_support, method=self._method))  # fmt: skip
                elif row == 0:
                    out.append(Contact(f"{name}.bottom", Plane(up), mu=self.mu_support))
                else:
                    out += self._beds(f"{name}.bottom", span, row - 1, self.mu, own=row)
                if k:
                    left = f"row {row + 1} block {k}.right"
                    head = self._head(span[0], row)
                    joint = Contact(f"{name}.left", master=left, mu=self.mu, where=head,
                                    method=self._method)  # fmt: skip
                    out.append(joint)
        if self._plate_is_rigid:
            out += [Contact(f"row {self.rows} block {k + 1}.top", master="plate.bottom",
                            mu=self.mu_support, method="nodal")
                    for k in range(len(self.spans[-1]))]  # fmt: skip
        elif self.plate:
            ends = (self.spans[-1][0][0], self.spans[-1][-1][1])
            out += self._beds("plate.bottom", ends, self.rows - 1, self.mu_support)
        return out

    @property
    def _method(self) -> str:
        return "mortar" if self.corotational else "nodal"

    def _beds(
        self, slave: str, span: tuple[float, float], below: int, mu: float,
        own: int | None = None,
    ) -> list[Contact]:  # fmt: skip
        """Contacts of a lower face with all blocks of the row below it; own: row of a block."""
        if self.corotational:
            first, *more = (
                f"row {below + 1} block {k + 1}.top" for k in range(len(self.spans[below]))
            )
            given = None  # but for an edge that its head joint has
            if own is not None and self._overhangs(span[0], own):
                given = _Between(span[0] + self._tolerance, np.inf)
            return [Contact(slave, master=first, more_masters=more, mu=mu, where=given)]
        out, taken = [], -np.inf
        for k, (left, right) in enumerate(self.spans[below]):
            if min(right, span[1]) - max(left, span[0]) > self._tolerance:
                part = _Between(max(left - self._tolerance, taken), right + self._tolerance)
                master = f"row {below + 1} block {k + 1}.top"
                bed = Contact(slave, master=master, mu=mu, where=part, method="nodal")
                out.append(bed)
                taken = right + self._tolerance
        return out

    @property
    def _plate_is_rigid(self) -> bool:
        kind = self.plate_material or self._block_material
        return self.plate > 0 and isinstance(kind, Rigid)

    def _head(self, x: float, row: int) -> _Inside | None:
        """The nodes of a head joint that no bed joint and no plate takes; None: all."""
        bottom, top = row * self.size[-1], (row + 1) * self.size[-1]
        low = -np.inf if self._overhangs(x, row) else bottom + self._tolerance
        takes = row == self.rows - 1 and self._plate_is_rigid
        high = top - self._tolerance if takes else np.inf
        return None if low == -np.inf and high == np.inf else _Inside(low, high)

    def _overhangs(self, x: float, row: int) -> bool:
        """True where nothing lies below x."""
        if row == 0:
            return False
        below = self.spans[row - 1]
        return not below[0][0] - self._tolerance <= x <= below[-1][1] + self._tolerance

    @property
    def _tolerance(self) -> float:
        return SAME * self.size[0]

    # ------------------------------------------------------------------ the whole
    def model(
        self,
        supports: Sequence[Fix] = (),
        loads: Sequence[Traction | BodyForce] = (),
        name: str = "wall",
    ) -> Model:
        """The wall as a model; surfaces: "base.bottom", "row 1 block 1.top", …, "plate.top"."""
        return Model(self.bodies, supports, self.contacts, loads, name=name)

    def sheared(self, pressure: VectorValue, displacement: VectorValue) -> Model:
        """The wall under its plate: a traction on the plate's top, the base held.

        displacement: of the plate's top; its vertical component is None (free).
        """
        if not self.plate:
            raise InvalidInput("plate: expected a height > 0, got 0: nothing to load")
        below = [Fix("base.bottom", 0)] if self.base else []
        supports = [*below, Fix("plate.top", displacement)]
        return self.model(supports, [Traction("plate.top", pressure)], "sheared wall")


@dataclass(frozen=True)
class _Between:
    """Points with low < x <= high."""

    low: float
    high: float

    def __call__(self, points: Array) -> NDArray[np.bool_]:
        return (points[:, 0] > self.low) & (points[:, 0] <= self.high)


@dataclass(frozen=True)
class _Inside:
    """Points above a height and below another one."""

    low: float
    high: float

    def __call__(self, points: Array) -> NDArray[np.bool_]:
        return (points[:, -1] > self.low) & (points[:, -1] < self.high)
