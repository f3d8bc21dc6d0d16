"""Bodies that yield at small strains, with contact of the undeformed state: the step problem.

With forces K q - f_p(q) of the bodies (`elements.yielding`), f_p being that of the flow since
the history at the beginning of the step, displacements q and reactions r obey

    K q - f_p(q) = load + H r    and the law of contact.                                    (1)

Its linearisation at a state is a `FrictionProblem` with the stiffness K - K_p and the load
load + f_p - K_p q, and the problem itself at a solution: same reactions, gaps and slips.  The
history is never changed: the same step, asked for again, is the same to the last digit.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...core.errors import UnsupportedForm
from ...core.prepared import Prepared
from ...problem.friction import FrictionProblem
from ...problem.judge.measures import Measure, Weakest
from ...problem.law import Law
from ...problem.protocol import Problem
from ...problem.settling import Accepted
from ...solvers.newton.tangents import TangentProblem
from ..elements.plasticity import is_plastic
from ..elements.yielding import Flown, YieldingBody
from .assembly import Discretisation

if TYPE_CHECKING:
    from .model import Model

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Yielding:
    """The bodies of a model that yield, by their number, and where their histories begin."""

    bodies: dict[int, YieldingBody]
    offsets: NDArray[np.int64]

    @classmethod
    def of(cls, model: Model) -> Yielding:
        """Those of a model."""
        found = {
            k: YieldingBody(body.mesh, body.material)
            for k, body in enumerate(model.bodies)
            if is_plastic(body.material)
        }
        return cls(found, model.discretisation.offsets)

    @property
    def size(self) -> int:
        """Length of the history of all bodies."""
        return sum(body.size for body in self.bodies.values())

    def histories(self, history: Array) -> dict[int, Array]:
        """The history (h,) body by body."""
        out, first = {}, 0
        for k, body in self.bodies.items():
            out[k] = history[first : first + body.size]
            first += body.size
        return out

    def respond(self, q: Array, history: Array, *, tangent: bool = True) -> Flown:
        """What flows at displacements q (dofs,), of all bodies together."""
        forces, new, lost, stored = np.zeros_like(q), [np.zeros(0)], 0.0, 0.0
        whole: Any = None
        for k, own in self.histories(history).items():
            a, b = self.offsets[k], self.offsets[k + 1]
            found = self.bodies[k].respond(q[a:b], own, tangent=tangent)
            forces[a:b] = found.forces
            new.append(found.history)
            lost, stored = lost + found.lost, stored + found.stored
            if found.stiffness is not None:
                part = _placed(found.stiffness, int(a), len(q))
                whole = part if whole is None else whole + part
        return Flown(forces, whole, np.concatenate(new), stored, lost)


def _placed(K: sparse.csr_array, first: int, dofs: int) -> sparse.csr_array:
    """A matrix of one body in one of all dofs."""
    part = K.tocoo()
    at = (part.row + first, part.col + first)
    return sparse.csr_array(sparse.coo_array((part.data, at), shape=(dofs, dofs)))


@dataclass(frozen=True, eq=False)
class YieldingProblem(TangentProblem):
    """One static problem, or one step, of bodies that yield.

    load, prescribed (dofs,): nodal forces, and values on the fixed dofs, else zero; before
    (nc, d-1): tangential displacements since which friction counts; history (h,): of the flow
    before the step; known: load, prescribed and unknowns v (n,) from which load steps begin.
    """

    model: Model
    yielding: Yielding
    load: Array
    prescribed: Array
    before: Array
    history: Array
    known: tuple[Array, Array, Array] | None = None
    _at: dict[bytes, tuple[FrictionProblem, Flown]] = field(default_factory=dict, repr=False)

    measure = Measure.RESIDUAL
    no_inertia = "bodies that yield have quasi-static steps; use QuasiStatic, or LinearElastic"
    no_path = "solutions of bodies that yield are not followed; use plain steps"
    unfit = (
        "bodies that yield are no linear problem with contact: TangentNewton solves them, "
        "which auto takes"
    )

    @property
    def name(self) -> str:  # type: ignore[override]  # read only
        """That of the model."""
        return self.model.name

    @property
    def parts(self) -> Discretisation:
        """The arrays of the model."""
        return self.model.discretisation

    @property
    def law(self) -> Law:  # type: ignore[override]  # read only
        """Friction law of all contacts."""
        return self.model.law

    @property
    def rho(self) -> Array:  # type: ignore[override]  # read only
        """Augmentation parameter, (nc,), force per length, of the elastic bodies."""
        return self._elastic.rho

    @property
    def unknowns(self) -> int:  # type: ignore[override]  # read only
        """Those of the model."""
        return self.parts.unknowns

    @property
    def dimension(self) -> int:  # type: ignore[override]  # read only
        """2 or 3."""
        return self.model.dimension

    # ---------------------------------------------------------------- states
    def displacement(self, v: Array) -> Array:
        """Displacements of all dofs, (dofs,), of the unknowns v (n,)."""
        return self.parts.spread(v, self.prescribed)

    def flown(self, v: Array) -> Flown:
        """The flow at the unknowns v."""
        return self._there(v)[1]

    def tangent(self, v: Array) -> FrictionProblem:
        """The linear problem at v: of the same reactions, gaps and slips if v solves it."""
        return self._there(v)[0]

    def _there(self, v: Array) -> tuple[FrictionProblem, Flown]:
        key = v.tobytes()
        if key not in self._at:
            for old in list(self._at)[:-1]:
                del self._at[old]
            q = self.displacement(v)
            found = self.yielding.respond(q, self.history)
            self._at[key] = self._tangent(q, found), found
        return self._at[key]

    @property
    def _elastic(self) -> FrictionProblem:
        """The problem without flow, whose matrices and sizes all share."""
        return self._with(self.load)

    def _with(self, load: Array) -> FrictionProblem:
        """The elastic problem under a load (dofs,)."""
        return self.model.formulation.elastic(self.model, load, self.prescribed, self.before)  # type: ignore[attr-defined]  # as `Flowing` has it

    def _tangent(self, q: Array, found: Flown) -> FrictionProblem:
        sizes, parts = self._elastic, self.parts
        if sizes.u_scale is None:  # that of tangents grows where the body gives way
            sizes = replace(sizes, u_scale=sizes.scales[1], guess=None)
        sizes = replace(sizes, load_scale=self._load_size(q, found, sizes.load))
        if found.stiffness is None:
            return replace(sizes, f=self._with(self.load + found.forces).f)
        load = self.load + found.forces - found.stiffness @ q
        K = sparse.csr_array(parts.stored_stiffness - found.stiffness)
        M = parts.reduced(K)
        f = parts.gathered(load - K @ self.prescribed)
        if parts.eliminated is not None:
            f = parts.with_driven(f, M, self.prescribed)
        return replace(sizes, M=M, f=f, guess=None, _shared=Prepared())

    def _load_size(self, q: Array, found: Flown, elastic: float) -> float:
        """Size of loads and of forces at supports; at most that of elastic bodies, or before.

        Elastic ones have none where a body that has flown is back at its first place, and what
        it carries there is still of the size that it was.
        """
        size = self._carried(q, found, self.load)
        return min(size, max(elastic, self._known_size)) or elastic

    def _carried(self, q: Array, found: Flown, load: Array) -> float:
        parts = self.parts
        held = (parts.K @ q - found.forces)[parts.fixed]
        return float(np.hypot(np.linalg.norm(held), np.linalg.norm(parts.gathered(load))))

    @cached_property
    def _known_size(self) -> float:
        """Size of loads and of forces at supports at share 0 of the load."""
        if self.known is None:
            return 0.0
        load, prescribed, v = self.known
        q = self.parts.spread(v, prescribed)
        return self._carried(q, self.yielding.respond(q, self.history, tangent=False), load)

    # ---------------------------------------------------------------- what the driver asks
    def error(self, r: Array, v: Array | None = None) -> float:
        """That of the tangent problem at v, which is the problem itself there."""
        if v is None or not np.isfinite(v).all():
            return np.inf
        return self.tangent(v).error(r, v)

    def motion(self, r: Array, v: Array | None = None) -> tuple[Array, Array]:
        """([gap, slip], v) at the state v, without one at the known state."""
        v = self.known_state if v is None else v
        return self._elastic.local_velocity(v), v

    def accepted(
        self, r: Array, v: Array | None, error: float, tolerance: float
    ) -> Accepted:
        """As the tangent problem there has it."""
        assert v is not None
        return self.tangent(v).accepted(r, v, error, tolerance)

    def certain_error(self, r: Array, v: Array | None = None) -> float:
        """The error, or what rounding may hide in it where that is more."""
        return np.inf if v is None else self.tangent(v).certain_error(r, v)

    def weakest(self, r: Array, v: Array | None = None) -> Weakest | None:
        """The contact farthest from its law on its own scale."""
        return None if v is None else self.tangent(v).weakest(r, v)

    def recover(self, r: Array, v: Array | None = None) -> tuple[Problem, Array, Array | None]:
        """A solution is one of the tangent problem at its state."""
        u, v = self.motion(r, v)
        return self.tangent(v), u, v

    # ---------------------------------------------------------------- load steps
    @property
    def known_state(self) -> Array:
        """The unknowns v (n,) at share 0 of the load."""
        return np.zeros(self.unknowns) if self.known is None else self.known[2]

    def towards(self, goal: YieldingProblem, v: Array) -> FrictionProblem:
        """The linear problem at a state v of this problem, under the load of another."""
        q = self.displacement(v)
        return goal._tangent(q, self.yielding.respond(q, self.history))

    def at_share(self, share: float) -> YieldingProblem:
        """The problem at a share of the way from the known load to this one."""
        nothing = np.zeros_like(self.load)
        load, prescribed, _ = (nothing, nothing, None) if self.known is None else self.known
        return replace(
            self, load=load + share * (self.load - load),
            prescribed=prescribed + share * (self.prescribed - prescribed), _at={},
        )  # fmt: skip


def yielding_step(
    model: Model, load: Array, prescribed: Array, before: Array | None = None,
    history: Array | None = None, known: tuple[Array, Array, Array] | None = None,
) -> YieldingProblem:  # fmt: skip
    """One step under nodal forces and prescribed values (dofs,), see `YieldingProblem`.

    before, history: zero by default.  Raises UnsupportedForm for laws that change on the way.
    """
    if model.law.varies:
        raise UnsupportedForm(
            "friction that depends on pressure or speed needs linear bodies: bodies that yield "
            "have one coefficient", ("contacts",),
        )  # fmt: skip
    yielding = yielding_of(model)
    before = np.zeros_like(model.discretisation.carried[:, 1:]) if before is None else before
    history = np.zeros(yielding.size) if history is None or not history.size else history
    return YieldingProblem(model, yielding, load, prescribed, before, history, known)


def yielding_of(model: Model) -> Yielding:
    """The bodies of a model that yield, made once for all its variants."""
    return model._shared.once(Yielding.of, (), model)
