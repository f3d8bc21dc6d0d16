"""The matrices of a model that moves: mass, damping, stiffness, contact, loads in time."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...core.errors import InvalidInput
from ..elements.mass import lumped, mass
from ..model import Fix, Model
from ..model.assembly import Discretisation
from ..model.nodal_forces import sampled
from ..model.parts import Load
from ..model.supports import locate, prescribed_values, with_held
from .timed import depends_on_time, is_timed, part_at, steady

if TYPE_CHECKING:
    from .state import State

Array = NDArray[np.float64]
# where a line is compared with what is applied: at no simple shares, which waves may hit
INSIDE = tuple((k * 0.6180339887498949) % 1.0 for k in range(1, 9))
BENT = 1e-9  # departure from a straight line in time, relative, that a load may have


@dataclass(frozen=True, eq=False)
class Motion:
    """Loads and prescribed displacements of a model as functions of time.

    model: as the user gave it; only its steady form, `body`, is assembled.  lengths: of locked
    bolts, which neither time nor load factor changes.
    """

    model: Model
    lengths: dict[str, float] = field(default_factory=dict)
    _loads: dict[float, Any] = field(default_factory=dict, init=False, repr=False)

    @cached_property
    def body(self) -> Model:
        """The model at time 0, for matrices and for what supports hold; not for values."""
        return steady(self.model)

    @cached_property
    def parts(self) -> Discretisation:
        """The arrays of the model."""
        return self.body.discretisation

    @cached_property
    def is_timed(self) -> bool:
        """True when a load or a support depends on time."""
        return depends_on_time(self.model)

    def _of(self, loads: list[Load | None], *, own: bool = True) -> Any:
        """Nodal forces of loads, None: of none, as `Formulation.nodal_load` gives them."""
        return self.model.formulation.nodal_load(self.body, loads, own=own)

    @cached_property
    def _steady_load(self) -> Any:
        return self._of([None if is_timed(p.value) else p for p in self.model.loads])

    @cached_property
    def _supports_move(self) -> bool:
        return any(is_timed(support.value) for support in self.model.supports)

    def load(self, t: float) -> Any:
        """Nodal forces at time t: (dofs,), in large deformations as `NodalForces`."""
        moving = [part_at(p, t) if is_timed(p.value) else None for p in self.model.loads]
        if not any(moving):
            return self._steady_load
        if t not in self._loads:
            forces = self._of(moving, own=False)  # type: ignore[arg-type]
            for old in list(self._loads)[:-1]:
                del self._loads[old]
            self._loads[t] = self._steady_load + forces
        return self._loads[t]

    def load_of(self, state: State) -> Any:
        """Nodal forces, as `load`, that are said to act at the time of a quasi-static state."""
        if state.is_unloaded:
            return 0.0 * self.load(state.time)
        return (1.0 if self.is_timed else state.time) * self.load(state.time)

    def prescribed(self, t: float) -> Array:
        """Prescribed displacement at time t, (dofs,), zero on the free dofs of elastic bodies.

        Raises InvalidInput where it pushes a node that supports hold into what it meets.
        """
        return self._checked(self._displaced(t) + self._kept, t)

    def applied(self, t: float) -> tuple[Any, Array]:
        """(nodal forces as `load`, prescribed displacement (dofs,)) at time t.

        Where nothing depends on time all grow with it as load factor.  Raises as `prescribed`.
        """
        factor = 1.0 if self.is_timed else t
        return factor * self.load(t), self._checked(factor * self._displaced(t) + self._kept, t)

    @cached_property
    def _kept(self) -> Array:
        """What locked bolts prescribe, (dofs,)."""
        out, entries = np.zeros(self.parts.dofs), self.model.beside.entries
        for name, length in self.lengths.items():
            out[entries[name].dofs] = length
        return self.parts.completed(out) if self.lengths else out

    def _checked(self, prescribed: Array, t: float) -> Array:
        self.body.check_outside(prescribed, f" at t = {t:.6g}")
        return prescribed

    def straight(
        self, interval: tuple[float, float], otherwise: str
    ) -> tuple[tuple[Any, Array], tuple[Any, Array]]:
        """What is applied at both ends of an interval of time.

        Raises InvalidInput, which says what to do `otherwise`, unless it changes along a
        straight line in between.
        """
        a, b = interval
        first, last = self.applied(a), self.applied(b)
        for share in INSIDE if self.is_timed else ():
            now = self.applied(a + share * (b - a))
            for three in zip(first, last, now, strict=True):
                start, end, value = (sampled(given, self._points) for given in three)
                size = max(float(np.abs(x).max(initial=0)) for x in (start, end, value))
                line = (1 - share) * start + share * end
                if np.abs(line - value).max(initial=0) > BENT * size:
                    raise InvalidInput(
                        f"interval: the loads are no straight line in time between {a:g} and "
                        f"{b:g}; {otherwise}"
                    )
        return first, last

    @cached_property
    def _points(self) -> Array:
        """Reference positions of all nodes, (nodes, d)."""
        return np.concatenate([body.mesh.points for body in self.model.bodies])

    @cached_property
    def _steady_displacement(self) -> Array:
        return self._prescribed(0.0)

    def _displaced(self, t: float) -> Array:
        """What supports prescribe at time t, (dofs,), without a load factor."""
        return self._prescribed(t) if self._supports_move else self._steady_displacement

    def _prescribed(self, t: float) -> Array:
        supports: tuple[Fix, ...] = tuple(part_at(s, t) for s in self.model.supports)  # type: ignore[misc]
        beside = self.parts.beside
        values = with_held(prescribed_values(self.model.bodies, supports, beside), beside)
        changed = np.flatnonzero(np.isnan(values) == self.parts.is_fixed)
        if changed.size:
            raise InvalidInput(self._comes_or_goes(int(changed[0]), t), ("supports",), "")
        return self.parts.completed(np.where(self.parts.is_fixed, values, 0.0))

    def _comes_or_goes(self, dof: int, t: float) -> str:
        """What to say of a dof that is free at t and was held at time 0, or the other way."""
        bodies, offsets, d = self.model.bodies, self.parts.offsets, self.model.dimension
        beside = self.model.beside
        if dof >= beside.first:
            names = [name for name, entry in beside.entries.items() if dof in entry.dofs]
            place = beside.where(dof)
        else:
            k = int(np.searchsorted(offsets, dof, side="right")) - 1
            node, axis = divmod(dof - int(offsets[k]), d)
            mesh = bodies[k].mesh
            names = [s.on for s in self.model.supports
                     if is_timed(s.value) and beside.named(s.on) is None
                     and (found := locate(bodies, s.on, sets=True))[0] == k
                     and node in mesh.surface_nodes(found[1])]  # fmt: skip
            place = f"component {axis} at {mesh.points[node].tolist()}"
        held = bool(self.parts.is_fixed[dof])
        before, now = ("held", "free") if held else ("free", "held")
        return (
            f"fix on {', '.join(map(repr, names))}: {place} is {before} at t = 0 and {now} at "
            f"t = {t:.6g}; a support holds the same components at all times; for one that "
            "comes or goes begin "
            "another evolution, of a model with other supports, from the state (start=)"
        )


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
        blocks = [mass(b.mesh, b.material) for b in self.model.bodies]  # type: ignore[arg-type]
        if count := self.model.beside.count:
            blocks.append(sparse.csr_array((count, count)))  # references have no mass
        M = sparse.csr_array(sparse.block_diag(blocks, format="csr"))
        M = lumped(M) if self.is_lumped else M
        K = self.model.discretisation.stored_stiffness
        C = self.mass_damping * M + self.stiffness_damping * K
        object.__setattr__(self, "M", M)
        object.__setattr__(self, "C", sparse.csr_array(C))
