"""How v follows r in a step of the accelerated gradient method (`gradient`).

    v^{k+1} = argmin_v  v M v / 2 - (f + H r^{k+1}) v + |v - v^k|_D^2 / (2 beta_k)

takes one factor of M, or W, in the metric D = M, and a factor in each step, or the modes of M,
in the metric D = 1.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...core.errors import SingularOperator, UnsupportedForm
from ...linear import Direct
from ...linear.dense import dense
from ...problem.friction import Form, FrictionProblem

Array = NDArray[np.float64]
SPECTRAL = 1500  # unknowns up to which the modes of M replace a factor in each iteration
DENSE = 200  # size up to which extreme eigenvalues come from all of them
NORM_ERROR = 1e-3  # of gamma^2 and omega from Lanczos' method
SAFETY = 1.01  # by which gamma^2 is increased, being found from below
EPSILON = np.finfo(float).eps


class Motion(Protocol):
    """How v follows r in one metric; x stands for v in the basis that makes steps cheap."""

    problem: FrictionProblem
    omega: float
    weight: Array  # (nc,): alpha of each contact relative to the option
    gamma_squared: float  # square of the norm of H^T between the metrics of v and of r so

    def start(self, r: Array, v: Array | None) -> Array:
        """x of v, or in equilibrium with r where there is none."""
        ...

    def load(self, r: Array) -> Array:
        """f + H r in the form that `step` takes."""
        ...

    def step(self, x: Array, load: Array, beta: float) -> Array:
        """x^{k+1}."""
        ...

    def response(self, load: Array) -> Array:
        """u, (nc, d), in equilibrium with a load."""
        ...

    def u(self, x: Array) -> Array:
        """u of x, (nc, d)."""
        ...

    def v(self, x: Array) -> Array | None:
        """v of x, (n,); None in the Delassus form."""
        ...

    def size(self, x: Array) -> float:
        """Norm of a difference of two x in the metric."""
        ...


def in_stiffness(problem: FrictionProblem) -> Motion:
    """The motion in the metric M."""
    return _Local(problem) if problem.form is Form.DELASSUS else _Stiffness(problem)


def in_identity(problem: FrictionProblem) -> Motion:
    """The motion in the metric 1; raises UnsupportedForm in the Delassus form."""
    if problem.form is Form.DELASSUS:
        raise UnsupportedForm(
            "metric=IDENTITY: measures v, which the local form does not have; "
            "use STIFFNESS or the global form"
        )
    return _Modes(problem) if problem.unknowns <= SPECTRAL else _Identity(problem)


@dataclass(frozen=True, eq=False)
class _Local(Motion):
    """Metric M in the Delassus form: x is u, flat."""

    problem: FrictionProblem
    omega: float = 1.0

    @property
    def weight(self) -> Array:
        return self.problem.rho

    @cached_property
    def gamma_squared(self) -> float:
        d = self.problem.dimension
        root = np.repeat(np.sqrt(self.weight), d)
        return _largest(lambda y: root * self._compliance(root * y), root.size)

    def _compliance(self, r: Array) -> Array:
        assert self.problem.W is not None
        return self.problem.W @ r

    def start(self, r: Array, v: Array | None) -> Array:
        return self.load(r)

    def load(self, r: Array) -> Array:
        return self.problem.velocity(r)[0].ravel()

    def step(self, x: Array, load: Array, beta: float) -> Array:
        return (x + beta * load) / (1 + beta)

    def response(self, load: Array) -> Array:
        return self.u(load)

    def u(self, x: Array) -> Array:
        return x.reshape(self.problem.contacts, -1)

    def v(self, x: Array) -> Array | None:
        return None

    def size(self, x: Array) -> float:
        return float(np.linalg.norm(x))


class _Stiffness(_Local):
    """Metric M in the global form: x is v, and a load is M^-1 (f + H r)."""

    def _compliance(self, r: Array) -> Array:
        p = self.problem
        assert p.H is not None
        return p.H.T @ p.solve_M(p.H @ r)

    def start(self, r: Array, v: Array | None) -> Array:
        return self.load(r) if v is None else v

    def load(self, r: Array) -> Array:
        v = self.problem.velocity(r)[1]
        assert v is not None
        return v

    def u(self, x: Array) -> Array:
        return self.problem.local_velocity(x)

    def v(self, x: Array) -> Array | None:
        return x

    def size(self, x: Array) -> float:
        return float(np.sqrt(max(x @ (self.problem.M @ x), 0.0)))


@dataclass(frozen=True, eq=False)
class _Identity(Motion):
    """Metric 1: x is v, a factor of 1 + beta M in each step."""

    problem: FrictionProblem

    @cached_property
    def weight(self) -> Array:
        return np.where(self.problem.rho > 0, 1.0, 0.0)

    @cached_property
    def gamma_squared(self) -> float:
        H = self.problem.H
        assert H is not None
        return _largest(lambda r: H.T @ (H @ r), H.shape[1])

    @cached_property
    def omega(self) -> float:
        try:
            return 1 / _largest(self.problem.solve_M, self.problem.unknowns)
        except SingularOperator:
            return 0.0

    def start(self, r: Array, v: Array | None) -> Array:
        if v is not None:
            return v
        try:
            return self.problem.solve_M(self.load(r))
        except SingularOperator:
            return np.zeros(self.problem.unknowns)

    def load(self, r: Array) -> Array:
        assert self.problem.H is not None and self.problem.f is not None
        return self.problem.f + self.problem.H @ r.ravel()

    def step(self, x: Array, load: Array, beta: float) -> Array:
        assert self.problem.M is not None
        matrix = beta * self.problem.M + sparse.eye_array(x.size, format="csc")
        return Direct().factor(sparse.csc_array(matrix)).solve(x + beta * load)

    def response(self, load: Array) -> Array:
        return self.u(self.problem.solve_M(load))

    def u(self, x: Array) -> Array:
        return self.problem.local_velocity(x)

    def v(self, x: Array) -> Array | None:
        return x

    def size(self, x: Array) -> float:
        return float(np.linalg.norm(x))


def _modes(problem: FrictionProblem) -> tuple[Array, Array]:
    """Eigenvalues and eigenvectors of M."""
    assert problem.M is not None
    return np.linalg.eigh(dense(problem.M, 2, "M"))


class _Modes(_Identity):
    """Metric 1 with the modes of M: x are their amplitudes, and a step is a product with H."""

    @cached_property
    def _modes(self) -> tuple[Array, Array]:
        return self.problem.kept(_modes)

    @cached_property
    def _directions(self) -> Array:
        """V^T H, (n, nc d)."""
        assert self.problem.H is not None
        return (self.problem.H.T @ self._modes[1]).T

    @cached_property
    def _steady(self) -> Array:
        """V^T f, (n,)."""
        assert self.problem.f is not None
        return self._modes[1].T @ self.problem.f

    @cached_property
    def omega(self) -> float:
        values = self._modes[0]
        return max(values[0], 0.0) if values[0] > values.size * EPSILON * values[-1] else 0.0

    def start(self, r: Array, v: Array | None) -> Array:
        return self._modes[1].T @ super().start(r, v)

    def load(self, r: Array) -> Array:
        return self._steady + self._directions @ r.ravel()

    def step(self, x: Array, load: Array, beta: float) -> Array:
        return (x + beta * load) / (1 + beta * self._modes[0])

    def response(self, load: Array) -> Array:
        if self.omega == 0:
            raise SingularOperator("M: has no inverse, which restarts need; use Restart.NEVER")
        return self.u(load / self._modes[0])

    def u(self, x: Array) -> Array:
        assert self.problem.w is not None
        return (x @ self._directions).reshape(self.problem.w.shape) + self.problem.w

    def v(self, x: Array) -> Array | None:
        return self._modes[1] @ x


def _largest(product: Callable[[Array], Array], size: int) -> float:
    """Largest eigenvalue of a positive semidefinite operator, from above."""
    from scipy.sparse import linalg as sparse_linalg

    if size == 0:
        return 0.0
    if size <= DENSE:
        matrix = np.column_stack([product(row) for row in np.eye(size)])
        return float(np.linalg.norm(matrix, 2))
    operator = sparse_linalg.LinearOperator((size, size), matvec=product, dtype=float)
    start = np.random.default_rng(0).standard_normal(size)
    values = sparse_linalg.eigsh(
        operator, k=1, v0=start, return_eigenvectors=False,
        tol=NORM_ERROR,  # type: ignore[arg-type]  # scipy: tol=0 reads as an int
    )  # fmt: skip
    return SAFETY * float(values[0])
