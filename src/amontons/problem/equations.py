"""What M, H, f, w or W, q answer: motions of reactions, and how far a state is from a solution.

The judge's measures are in `judge`: the exact one where W is there or cheap to form, else that
of the residual.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from functools import cached_property
from typing import TYPE_CHECKING, Any, Self, TypeVar

import numpy as np
from numpy.typing import NDArray

from ..core.arrays import expect_shape, read_only
from ..core.clock import NEVER, Deadline
from ..core.errors import SingularOperator, UnsupportedForm
from ..core.prepared import Prepared
from ..linear.blocks import (
    BlockRows,
    block_rows,
    kernel_rows,
    spatial,
    velocity_inplace,
)
from ..linear.vectors import norm_of_rest
from . import indefinite, residuals
from .judge import measures as judge
from .judge.contacts import Assessed, assessed
from .judge.measures import Measure, Weakest
from .judge.sharp import sharp_error
from .matrices import entry_sizes
from .plain import of_plain
from .protocol import Form
from .settling import Accepted, Motion, accepted_exactly
from .stored import Matrices

if TYPE_CHECKING:
    from .solution import Obstruction

T = TypeVar("T")
Array = NDArray[np.float64]
JUDGE_FLOPS = 18, 60  # floating point operations of a judgement per block of W, per contact
ESTIMATED = 9_000  # unknowns of a mesh above which the size of u is taken from a coarse level


class Equations(Matrices):
    """The members of `FrictionProblem` that its data answer."""

    has_q = True
    f: Array | None
    w: Array | None
    q: Array | None
    blur: Array | None
    load_scale: float | None
    u_scale: float | None

    # ---------------------------------------------------------------- W
    @cached_property
    def blocks(self) -> BlockRows:
        """W in rows of 3x3 blocks (Delassus form only)."""
        self._need(Form.DELASSUS)
        W: Any = self.W
        d = self.dimension
        return self._shared.once(block_rows, (W,), W, d)

    @cached_property
    def kernel_data(self) -> tuple[Any, ...]:
        """What kernels take: indptr, indices, data, q (nc, 3), kind, parameters, rho."""
        b = self.blocks
        assert self.q is not None
        q = read_only(spatial(self.q))
        law = self.law.kind, self.law.parameters
        return b.indptr, b.indices, b.data, q, *law, b.inverse_norms

    @cached_property
    def product_data(self) -> tuple[Any, ...]:
        """The same for kernels that multiply by W, which take `BlockRows.rows` for data."""
        return *self.kernel_data[:2], self.blocks.rows, *self.kernel_data[3:]

    @cached_property
    def judge_flops(self) -> float:
        """Floating point operations of one judgement, 0 where they are not counted."""
        if self.form is Form.GLOBAL:
            return 0.0
        return float(np.dot(JUDGE_FLOPS, (len(self.blocks.indices), self.contacts)))

    @cached_property
    def q_norm(self) -> float:
        """Euclidean norm of q (Delassus form only)."""
        self._need(Form.DELASSUS)
        return float(np.linalg.norm(self.q))  # type: ignore[arg-type]

    # ---------------------------------------------------------------- motions
    @cached_property
    def free_velocity(self) -> Array:
        """q, (nc, d): local velocity without reactions, w + H^T M^-1 f in the global form."""
        if self.q is not None:
            return self.q
        return self._free[0]

    @property
    def free_blur(self) -> Array:
        """What rounding may have left of the free velocity, (nc,), unit of u."""
        return self._free[1]

    @cached_property
    def _free(self) -> tuple[Array, Array]:
        """H^T M^-1 f + w, and its blur (global form only)."""
        assert self.f is not None and self.H is not None and self.w is not None
        v = self.solve_M(self.f)
        q = self.local_velocity(v)
        terms = (abs(self.H).T @ np.abs(v)).reshape(self.w.shape) + np.abs(self.w)
        blur = judge.FLOOR * judge.EPSILON * np.linalg.norm(terms, axis=1)
        return read_only(q), read_only(blur)

    def velocity(self, r: Array) -> tuple[Array, Array | None]:
        """(u, v) of reactions r, (nc, d); v is None in the Delassus form."""
        if self.form is Form.DELASSUS:
            u = np.empty((self.contacts, 3))
            velocity_inplace(*self.product_data[:4], spatial(r), u)
            return u[:, : self.dimension], None
        assert self.H is not None and self.f is not None
        v = self.solve_M(self.H @ r.ravel() + self.f)
        return self.local_velocity(v), v

    def motion(self, r: Array, v: Array | None = None) -> Motion:
        """(u, v) of a state, without v of its reactions; v = 0 where M is singular."""
        if v is not None:
            return self.local_velocity(v), v
        try:
            return self.velocity(r)
        except SingularOperator:  # and no solver has found another v
            v = np.zeros(self.unknowns)
            return self.local_velocity(v), v

    def local_velocity(self, v: Array) -> Array:
        """u = H^T v + w, (nc, d)."""
        assert self.H is not None and self.w is not None
        return (self.H.T @ v).reshape(self.w.shape) + self.w

    # ---------------------------------------------------------------- judging
    @cached_property
    def measure(self) -> Measure:
        """Which error measure applies, see `judge`."""
        if self.form is Form.DELASSUS:
            return Measure.EXACT
        try:
            cheap = self.condensing_is_cheap and self.condensed() is not None
        except SingularOperator:
            cheap = False
        return Measure.EXACT if cheap else Measure.RESIDUAL

    def prepare(self, deadline: Deadline = NEVER) -> None:
        """Form W where `measure` asks for it; raises TimeUp when it is not there in time."""
        if self.form is Form.GLOBAL:
            with suppress(SingularOperator):
                if self.condensing_is_cheap:
                    self.condensed(deadline)

    @of_plain
    def error(self, r: Array, v: Array | None = None) -> float:
        """Unit-free error of reactions r, (nc, d), and of the motion v, (n,), if it is given.

        Without v it is that of the motion of r.  Infinite when r or v hold a number that is not
        finite, and without v when M is singular.  Raises UnsupportedForm for a v in the
        Delassus form, which has none, InvalidInput for one of another size.
        """
        if v is not None:
            self._check_motion(v)
        if self.measure is Measure.EXACT:
            error = residuals.exact(self.condensed(), r)
            return error if v is None else max(error, self.imbalance(r, v))
        if v is None:
            try:
                v = self.velocity(r)[1]
            except SingularOperator:
                return np.inf
        assert v is not None
        return residuals.residual(self, r, v)

    @of_plain
    def rounding(self, r: Array) -> float:
        """What rounding alone may hide in `error`, unit-free: no smaller error can be known."""
        if self.measure is Measure.EXACT:
            p = self.condensed()
            return judge.ratio(p._hidden(p.rho, r), p.q_norm)
        return judge.ratio(self._hidden(self.rho, r), self.scales[1])

    @of_plain
    def certain_error(self, r: Array, v: Array | None = None) -> float:
        """`error`, evaluated sharply where rounding could hide one in it."""
        error, hidden = self.error(r, v), self.rounding(r)
        if hidden <= error or self.measure is not Measure.EXACT:
            return max(error, hidden)
        p = self.condensed()
        found, left = sharp_error(*p.kernel_data, kernel_rows(r))
        return max(judge.ratio(max(found, left), p.q_norm), self.imbalance(r, v))

    @np.errstate(over="ignore", invalid="ignore")  # of iterates that run away
    def imbalance(self, r: Array, v: Array | None) -> float:
        """|M v - H r - f| relative to the load; 0 for v = None, the motion of r.

        Where the exact measure judges, only what is beyond the rounding of its terms counts: a
        factor of stiff bodies beside small loads gives no better v.
        """
        if v is None:
            return 0.0
        assert self.M is not None and self.H is not None and self.f is not None
        push = self.H @ r.ravel()
        rest = norm_of_rest(self.times_M(v), push, self.f)
        if not np.isfinite(rest):
            return np.inf
        load = self.load or float(np.linalg.norm(push))
        if self.measure is Measure.EXACT and rest > judge.EPSILON * load:
            terms = self._sizes[0] @ np.abs(v) + self._sizes[1] @ np.abs(r.ravel())
            rounding = judge.FLOOR * judge.EPSILON * np.linalg.norm(terms + np.abs(self.f))
            rest = max(rest - float(rounding), 0.0)
        return judge.ratio(rest, load)

    @cached_property
    def _sizes(self) -> tuple[Any, Any]:
        """|M| and |H|, entry by entry."""
        return self._shared.once(entry_sizes, (self.M, self.H), self.M, self.H)

    def _check_motion(self, v: Array) -> None:
        if self.form is Form.DELASSUS:
            raise UnsupportedForm(
                "v: expected None, the problem is in its local form, which has reactions only"
            )
        expect_shape("v", np.shape(v), (self.unknowns,))

    def _hidden(self, rho: Array, r: Array) -> float:
        return judge.rounding_error(self.law.kind, self.law.parameters, rho, kernel_rows(r))

    @of_plain
    def weakest(self, r: Array, v: Array | None = None) -> Weakest:
        """The contact farthest from its law on its own scale; arguments as in `error`."""
        if self.measure is Measure.EXACT:
            return self.condensed().assessed(r).weakest
        if v is None:
            try:
                v = self.velocity(r)[1]
            except SingularOperator:
                return Weakest(np.inf, None)
        assert v is not None
        if not (np.isfinite(r).all() and np.isfinite(v).all()):
            return Weakest(np.inf, None)
        u, q = self.local_velocity(v), self.open_velocity
        rho = np.where(self.rho > 0, self.rho, np.inf)
        parts = (q, u - q, r / rho[:, None])
        scale = np.sum([np.linalg.norm(part, axis=1) for part in parts], axis=0)
        found = judge.weakest_of(r, u, self.law, self.rho, scale)
        return found._replace(hidden=self.rounding(r))

    def kept(self, make: Callable[[Self], T]) -> T:
        """make(problem), of M, H or W alone, made once for all variants of this problem.

        make: a function of a module or class, see `Prepared`.
        """
        return self._shared.once(make, (self.M, self.H, self.W), self)

    def kept_of_pattern(self, make: Callable[[Self], T]) -> T:
        """The same of where the blocks of W are, for all variants that have them there."""
        sources = (self.blocks.indptr, self.blocks.indices)
        return self._shared.once(make, sources, self)

    def kept_alone(self, make: Callable[[Self], T]) -> T:
        """make(problem), made once for this problem with its load and law, see `kept`."""
        return self._alone.once(make, (), self)

    @cached_property
    def _alone(self) -> Prepared:
        return Prepared()

    def accepted(
        self, r: Array, v: Array | None, error: float, tolerance: float
    ) -> Accepted:
        """See `Problem`; by the exact measure the motion is that of r, and v is not read."""
        if self.measure is Measure.EXACT:
            return accepted_exactly(self.condensed(), r, v, error, tolerance)
        return super().accepted(r, v, error, tolerance)

    @property
    def gains_energy(self) -> bool:
        """True where a contact alone gains energy by its reactions: methods go round there."""
        return indefinite.gains_energy(self)

    def obstruction(self, u: Array) -> tuple[Obstruction | None, str]:
        """What in the problem may be the reason of a failure, at velocities u, in words."""
        return indefinite.obstruction(self, u)

    def natural_error(self, r: Array, v: Array | None = None) -> float:
        """[ABD] eq. (13) of reactions r, (nc, d), with v, (n,), if it is known."""
        u = self.velocity(r)[0] if v is None or not self.has_v else self.local_velocity(v)
        return judge.published_natural_error(r, u, self.free_velocity, self.law)

    @of_plain
    def assessed(self, r: Array) -> Assessed:
        """All that is asked of reactions that may have converged (Delassus form only)."""
        return assessed(self.product_data, kernel_rows(r), self.floor, self.q_norm)

    @cached_property
    def floor(self) -> Array:
        """What is added to the scale of each contact in its error, (nc,), unit of u."""
        return self.blur if self.blur is not None else np.zeros(self.contacts)

    @of_plain
    def exact_error(self, r: Array) -> float:
        """The exact measure of the Delassus form."""
        return residuals.exact(self, r)

    def unbalanced(self, r: Array) -> float:
        """Largest force that moves a loose body as a whole, see `residuals.unbalanced`."""
        return residuals.unbalanced(self, r)

    @cached_property
    def loose_modes(self) -> Array:
        """Rigid modes of bodies that contact alone holds, orthonormal columns (n, k)."""
        loose = self.u_scale is not None and self.guess is not None
        if self.form is Form.GLOBAL and not loose:
            try:
                _ = self.open_velocity if self._is_estimated else self.free_velocity
            except SingularOperator:
                loose = True
        if not loose:
            return np.zeros((self.unknowns, 0))
        return self.matrices.loose_modes

    @cached_property
    def rho(self) -> Array:
        """Augmentation parameter, (nc,), unit of r / u; 0 where a contact can not react."""
        if self.form is Form.DELASSUS:
            return self.kernel_data[-1]
        return self.contact_stiffness

    @cached_property
    def scales(self) -> tuple[float, float]:
        """Sizes of the load and of u for the residual measure (global form only)."""
        if self.u_scale is not None:
            return self.load, self.u_scale
        return self.load, float(np.linalg.norm(self.open_velocity))

    @cached_property
    def load(self) -> float:
        """Size of the load, unit of f (global form only)."""
        assert self.f is not None
        return self.load_scale if self.load_scale is not None else float(np.linalg.norm(self.f))

    @cached_property
    def open_velocity(self) -> Array:
        """u without reactions, (nc, d); of large meshes from a coarse level, to some per cent.

        Where contact alone holds a body: u of the guess, else w (global form only).
        """
        assert self.w is not None
        if self.u_scale is not None and self.guess is not None:
            return self.local_velocity(self.guess)
        try:
            return self._open_velocity()
        except SingularOperator:
            return self.w

    @property
    def _is_estimated(self) -> bool:
        """True for large meshes, where M^-1 f would cost too much only to judge."""
        return self.unknowns > ESTIMATED and self.is_mesh

    def _open_velocity(self) -> Array:
        hierarchy = self.hierarchy if self._is_estimated else None
        if hierarchy is None:
            return self.free_velocity
        assert self.f is not None and self.M is not None
        rest = self.f if self.guess is None else self.f - self.times_M(self.guess)
        nodes = hierarchy.nodes
        v = nodes.gather(hierarchy.estimate(nodes.spread(rest), ESTIMATED // 9))
        return self.local_velocity(v if self.guess is None else self.guess + v)
