"""What a law of friction is: a kind and parameters per contact, and what is asked of both.

Rows [x_N, x_T] in the local frame, (nc, d), d = 2 or 3; r_N >= 0 is compression, u_N >= 0 open.
Every law but TIED has the same normal part, 0 <= u_N, 0 <= r_N, one of them zero, and friction
that opposes the slip within a bound, the multi-valued limit of all of them:

    |r_T| <= g(r_N),    r_T = -g(r_N) u_T / |u_T|  where u_T != 0

    kind      g(r_N)               parameters
    COULOMB   mu r_N               mu, infinity
    TRESCA    tau                  0, tau        also where r_N = 0
    CAPPED    min(mu r_N, tau)     mu, tau
    TIED      infinite             0, infinity   u = 0 and r free

At a given r_N a capped contact is one of the other two, so `given` tells all that kernels need:
whether the bound is the second parameter or the first times r_N.  Contacts of several kinds may
stand in one problem (`mixed`).  Tension (`cohesive`) and two coefficients (`orthotropic`) are
changes of variables (`changed`), of which kernels know nothing.

A law in a file of its own names its parameters and, for speed, its own formulas; kernels take
`kind` (nc,) and `parameters` (nc, 2) and never the object.
"""

from __future__ import annotations

from enum import IntEnum
from functools import cached_property
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...core.arrays import LARGEST, read_only, real
from ...core.canonical import are_within
from ...core.compiled import njit
from ...core.errors import InvalidInput
from ...core.locks import KeepsLocks
from .cones import project_disk, project_disk_jacobian

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Kinds = NDArray[np.int8]
INSIDE = (
    "friction that follows a curve holds the others, VaryingFriction(curve, law=Cohesive(…))"
)
MU, BOUND = 0, 1  # columns of the parameters


class Kind(IntEnum):
    """What the two parameters of a contact mean."""

    COULOMB = 0
    TRESCA = 1
    CAPPED = 2
    TIED = 3


COULOMB, TRESCA, CAPPED, TIED = (int(kind) for kind in Kind)


@njit(cache=True, error_model="numpy", inline="always")
def given(kind, p, r0):
    """Whether friction at r_N = r0 is bounded by the number p[BOUND], and not by p[MU] r_N."""
    return kind == TRESCA or kind == TIED or (kind == CAPPED and p[MU] * r0 > p[BOUND])


class Law(KeepsLocks):
    """A law of friction for nc contacts; those of several kinds share these formulas."""

    name: ClassVar[str]  # in messages
    kind: Kinds  # (nc,)
    parameters: Array  # (nc, 2)

    def __len__(self) -> int:
        return len(self.kind)

    # ---------------------------------------------------------------- the law at a state
    def given(self, r: Array) -> Mask:
        """Contacts whose bound at r is a number, and not proportional to r_N; (nc,)."""
        mu, bound = self.parameters.T
        capped = (self.kind == CAPPED) & (mu * r[:, 0] > bound)
        return (self.kind == TRESCA) | self.tied | capped

    @cached_property
    def tied(self) -> Mask:
        """Contacts that neither part nor slip, (nc,)."""
        return self.kind == TIED

    @cached_property
    def has_stresses(self) -> bool:
        """True where its forces, or lengths over forces, belong to the area of a contact."""
        of_area = np.isfinite(self.plain.parameters[:, BOUND]) | (self.cohesion > 0)
        if self.give is not None:
            of_area |= (self.give > 0).any(axis=1)
        return self.varies or bool(of_area.any())

    def bound(self, r: Array) -> Array:
        """Largest |r_T| allowed at r, shape (nc,)."""
        mu, bound = self.parameters.T
        return np.where(self.given(r), bound, mu * np.maximum(r[:, 0], 0))

    def bound_slope(self, r: Array) -> Array:
        """Derivative of the bound in r_N, (nc,): zero at r_N = 0 and at a cap."""
        return np.where(self.given(r) | (r[:, 0] <= 0), 0.0, self.parameters[:, MU])

    def shear(self, x: Array) -> Array:
        """x_T of rows (nc, d): all but the normal ones."""
        return x[:, 1:]

    def excess(self, r: Array) -> Array:
        """What |r_T| is above its bound, or tension, whichever is more; (nc,), unit of r."""
        shear = np.linalg.norm(self.shear(r), axis=1) - self.bound(r)
        return np.where(self.tied, 0.0, np.maximum(shear, -r[:, 0]))

    def natural_map(self, r: Array, u: Array, rho: Array) -> Array:
        """Residual of the law, (nc, d), unit of r; zero exactly at a solution."""
        out = np.empty(r.shape)
        for law, own in self._regimes(r):
            out[own] = law.natural_map(r[own], u[own], rho[own])
        return out

    def regions(self, r: Array, u: Array, rho: Array) -> tuple[Mask, Mask]:
        """Masks (closed, sliding), (nc,): the piece of the natural map that holds at (r, u)."""
        closed, sliding = np.zeros((2, len(r)), dtype=bool)
        for law, own in self._regimes(r):
            closed[own], sliding[own] = law.regions(r[own], u[own], rho[own])
        return closed, sliding & (closed | (self.kind == TRESCA))

    def _regimes(self, r: Array) -> list[tuple[Law, Mask]]:
        """Coulomb's and Tresca's law, and ties, for the contacts that have them at r."""
        from .coulomb import Coulomb
        from .tied import Tied
        from .tresca import Tresca

        fixed, tied = self.given(r), self.tied
        pairs = ((Coulomb, MU, ~fixed), (Tresca, BOUND, fixed & ~tied))
        found: list[tuple[Law, Mask]] = []
        found += [(law(self.parameters[own, k]), own) for law, k, own in pairs if own.any()]
        return [*found, (Tied(int(tied.sum())), tied)] if tied.any() else found

    def augmented_reaction(self, x: Array) -> Array:
        """(x_N^+, projection of x_T onto the disk that the law allows at x_N^+), (nc, d).

        Alart and Curnier's form: r obeys the law with u where r = this of x = r - rho u,
        whatever rho > 0.
        """
        normal = np.where(self.tied, x[:, 0], np.maximum(x[:, 0], 0.0))
        return np.column_stack([normal, project_disk(x[:, 1:], self.bound(x))])

    def augmented_reaction_jacobian(self, x: Array) -> Array:
        """One element of the generalised Jacobian of `augmented_reaction`, (nc, d, d).

        On kinks: zero at x_N = 0, identity in x_T on the rim of the disk.
        """
        radius = self.bound(x)
        in_t, in_radius = project_disk_jacobian(x[:, 1:], radius)
        in_t[radius == 0] = 0.0
        out = np.zeros((*x.shape, x.shape[1]))
        out[:, 0, 0] = (x[:, 0] > 0) | self.tied
        out[:, 1:, 1:] = in_t
        out[:, 1:, 0] = in_radius * self.bound_slope(x)[:, None]
        return out

    # ---------------------------------------------------------------- variants
    has_moments: ClassVar[bool] = False  # True where contacts have more rows, see `rolling`
    varies: ClassVar[bool] = False  # True where coefficients follow the state, see `varying`
    stretch: Array | None = None  # T of tangents, (nc, 2, 2), see `changed`
    give: Array | None = None  # diagonal of C, (nc, 3)
    offset: Array | float = 0.0  # of the gap, (nc,)

    @property
    def plain(self) -> Law:
        """The law of which this one is a change of variables (`changed`), else itself."""
        return self

    @cached_property
    def cohesion(self) -> Array:
        """Largest tension, (nc,), unit of r: r_N >= -cohesion."""
        return np.zeros(len(self))

    def pressed(self, r: Array) -> Array:
        """Reactions s of the plain law, (nc, d)."""
        return r

    def released(self, s: Array) -> Array:
        """r of the s of the plain law, (nc, d)."""
        return s

    def stretched(self, u: Array, r: Array | None = None) -> Array:
        """Velocities u' of the plain law, (nc, d), at reactions r."""
        return u

    def unstretched(self, u: Array, r: Array) -> Array:
        """u of the u' of the plain law, (nc, d), at reactions r."""
        return u

    def at(self, index: NDArray[np.integer]) -> Law:
        """The law of a selection of contacts."""
        return self._of(self.kind[index], self.parameters[index])

    def scaled(self, force: float | Array) -> Law:
        """The law in another unit of r: all forces times `force` > 0, a number or (nc,)."""
        other = self.parameters.copy()
        other[:, BOUND] *= force
        return self._of(self.kind, other)

    def with_bounds(self, bounds: Array) -> Law:
        """The law with other bounds tau, (nc,), of the contacts that have one."""
        finite = np.isfinite(self.parameters[:, BOUND])
        bound = np.where(finite, bounds, self.parameters[:, BOUND])
        return self._of(self.kind, np.column_stack([self.parameters[:, MU], bound]))

    def lost(self, gone: Mask) -> Law:
        """The law where contacts gone (nc,) have lost what holds them without pressure."""
        held = gone & (self.kind == TRESCA)
        return self.with_bounds(np.where(held, 0.0, self.parameters[:, BOUND]))

    def with_mu(self, mu: Array) -> Law:
        """The law with other coefficients mu, (nc,), of the contacts that have one."""
        has = (self.kind == COULOMB) | (self.kind == CAPPED)
        mu = np.where(has, mu, self.parameters[:, MU])
        return self._of(self.kind, np.column_stack([mu, self.parameters[:, BOUND]]))

    @property
    def widest(self) -> Law | None:
        """The law with the largest bounds that it may have; None where that is not known."""
        return self

    def _of(self, kind: Kinds, parameters: Array) -> Law:
        """A law of the same class with these kinds and parameters."""
        raise NotImplementedError

    @property
    def facts(self) -> dict[str, Array]:
        """Its numbers by the names that users know, each (k,) of the contacts that have it."""
        mu, bound = self.parameters.T
        if self.stretch is not None:  # both coefficients, both half axes
            mu, bound = (np.linalg.eigvalsh(self.stretch) * p[:, None] for p in (mu, bound))
        table = {
            "friction coefficient": mu[(self.kind != TRESCA) & ~self.tied].ravel(),
            "friction bound": bound[(self.kind != COULOMB) & ~self.tied].ravel(),
            "cohesion": self.cohesion[self.cohesion > 0],
        }
        if self.give is not None:
            table["contact compliance"] = self.give[self.give[:, 0] > 0, 0]
            table["stick compliance"] = self.give[self.give[:, 1] > 0, 1]
        return {name: values for name, values in table.items() if values.size}


def per_contact(name: str, value: ArrayLike) -> Array:
    """A read-only copy, shape (nc,); rejects negative, non-finite and huge values by position.

    The square of a huge one is no number any more.
    """
    array = real(name, value)
    if array.ndim != 1:
        array = np.atleast_1d(array)
    if array.ndim != 1:
        raise InvalidInput(f"{name}: expected shape (nc,), got {array.shape}")
    if are_within(array, 0.0, LARGEST):
        return read_only(array)
    bad = np.flatnonzero(~np.isfinite(array) | (array < 0))
    if bad.size:
        raise InvalidInput(
            f"{name}[{bad[0]}]: expected a finite number >= 0, got {array[bad[0]]:.6g}"
        )
    huge = np.flatnonzero(array > LARGEST)
    if huge.size:
        raise InvalidInput(
            f"{name}[{huge[0]}]: expected at most {LARGEST:g}, got {array[huge[0]]:g}"
        )
    return read_only(array)


def same_length(**values: Array) -> list[Array]:
    """Arrays (nc,) of which those with one number are repeated; raises InvalidInput else."""
    size = max((len(array) for array in values.values()), default=0)
    for name, array in values.items():
        if len(array) not in (1, size):
            raise InvalidInput(f"{name}: expected one number or {size}, got {len(array)}")
    return [read_only(np.broadcast_to(array, (size,)).copy()) for array in values.values()]


def columns_of(mu: ArrayLike, bound: ArrayLike, size: int) -> Array:
    """Parameters (nc, 2), read-only, of numbers or arrays (nc,)."""
    out = np.empty((size, 2))
    out[:, MU], out[:, BOUND] = mu, bound
    return read_only(out)


def kinds_of(kind: Kind, size: int) -> Kinds:
    """Kinds (nc,), read-only, all the same."""
    out = np.empty(size, np.int8)
    out.fill(kind)
    return read_only(out)
