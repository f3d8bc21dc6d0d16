"""The matrices of a model that moves: mass, damping, stiffness, contact, loads in time."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ..errors import InvalidInput
from ..fem.mass import lumped, mass
from ..model import Fix, Model
from ..model.assembly import Discretisation, external_load, prescribed_values
from .timed import depends_on_time, is_timed, part_at, steady

Array = NDArray[np.float64]
BENT = 1e-9  # departure from a straight line in time, relative, that a load may have


@dataclass(frozen=True, eq=False)
class Motion:
    """Loads and prescribed displacements of a model as functions of time.

    model: as the user gave it; only its steady form, `body`, is assembled.
    """

    model: Model

    @cached_property
    def body(self) -> Model:
        """The model at time 0."""
        return steady(self.model)

    @cached_property
    def parts(self) -> Discretisation:
        """The arrays of the model."""
        return self.body.discretisation

    @cached_property
    def is_timed(self) -> bool:
        """True when a load or a support depends on time."""
        return depends_on_time(self.model)

    @cached_property
    def _steady_load(self) -> Array:
        steady = tuple(p for p in self.model.loads if not is_timed(p.value))
        return external_load(self.model.bodies, steady, self.parts.offsets)

    @cached_property
    def _supports_move(self) -> bool:
        return any(is_timed(support.value) for support in self.model.supports)

    def load(self, t: float) -> Array:
        """Nodal forces at time t, (dofs,)."""
        moving = tuple(part_at(p, t) for p in self.model.loads if is_timed(p.value))
        if not moving:
            return self._steady_load
        forces = external_load(self.model.bodies, moving, self.parts.offsets)  # type: ignore[arg-type]
        return self._steady_load + forces

    def prescribed(self, t: float) -> Array:
        """Prescribed displacement at time t, (dofs,), zero on the free dofs."""
        if not self._supports_move:
            return self._steady_displacement
        return self._prescribed(t)

    def applied(self, t: float) -> tuple[Array, Array]:
        """(nodal forces, prescribed displacement) at time t, (dofs,) each.

        Where nothing depends on time all grow with it as load factor.
        """
        factor = 1.0 if self.is_timed else t
        return factor * self.load(t), factor * self.prescribed(t)

    def straight(
        self, interval: tuple[float, float], otherwise: str
    ) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
        """What is applied at both ends of an interval of time.

        Raises InvalidInput, which says what to do `otherwise`, unless it changes along a
        straight line in between.
        """
        a, b = interval
        ends = [self.applied(t) for t in (a, b, (a + b) / 2)]
        for first, last, middle in zip(*ends, strict=True):
            size = max(float(np.abs(first).max(initial=0)), float(np.abs(last).max(initial=0)))
            if np.abs((first + last) / 2 - middle).max(initial=0) > BENT * size:
                raise InvalidInput(
                    f"interval: the loads are no straight line in time between {a:g} and "
                    f"{b:g}; {otherwise}"
                )
        return ends[0], ends[1]

    @cached_property
    def _steady_displacement(self) -> Array:
        return self._prescribed(0.0)

    def _prescribed(self, t: float) -> Array:
        supports: tuple[Fix, ...] = tuple(part_at(s, t) for s in self.model.supports)  # type: ignore[misc]
        values = prescribed_values(self.model.bodies, supports, self.parts.offsets)
        out = np.zeros(self.parts.dofs)
        out[self.parts.fixed] = values[self.parts.fixed]
        return out


@dataclass(frozen=True, eq=False)
class Inertia:
    """Mass matrix M and Rayleigh damping C = mass_damping M + stiffness_damping K."""

    model: Model
    mass_damping: float
    stiffness_damping: float
    is_lumped: bool
    M: sparse.csr_array = field(init=False)
    C: sparse.csr_array = field(init=False)

    def __post_init__(self) -> None:
        blocks = [mass(body.mesh, body.material) for body in self.model.bodies]
        M = sparse.csr_array(sparse.block_diag(blocks, format="csr"))
        M = lumped(M) if self.is_lumped else M
        K = self.model.discretisation.stored_stiffness
        C = self.mass_damping * M + self.stiffness_damping * K
        object.__setattr__(self, "M", M)
        object.__setattr__(self, "C", sparse.csr_array(C))
