"""The linear problem of one step of an active set method: whole, or by multigrid cycles."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...core.errors import SingularOperator
from ...linear import LinearSolver
from ...linear.hierarchy import components
from ...problem.friction import FrictionProblem
from ...problem.one_sided import HELD, OneSided, one_sided
from ..augmentation import own_blocks
from ..contract import Breakdown, Iterate
from ..driven import able_directions, driven_directions
from .conditions import Conditions
from .multigrid import ContactCycles, MultigridCycle

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
EXACT = 1e-12  # relative residual at which cycles count as an exact solution
MOST_CYCLES = 200  # per step; a hierarchy that needs more does not converge


@dataclass(frozen=True, eq=False)
class State:
    """r and u (nc, d) with v (n,), which may be in the one-sided basis."""

    r: Array
    u: Array
    v: Array
    linear_iterations: int = 0


class System(Protocol):
    """One step: the linear problem with given conditions."""

    def state(self, start: Iterate) -> State:
        """The first state; zero where the start says nothing."""
        ...

    def step(self, given: Conditions, state: State) -> State:
        """The next state."""
        ...

    def displacement(self, state: State) -> Array:
        """v of a state, (n,)."""
        ...


class Saddle:
    """[M, -H; G_u H^T, G_r] with any H, factorised in every step."""

    def __init__(self, problem: FrictionProblem, linear: LinearSolver) -> None:
        self.problem, self.linear = problem, linear
        self.able, self.driven = able_directions(problem), driven_directions(problem)
        own = np.diagonal(own_blocks(problem), axis1=1, axis2=2)
        largest = own.max(axis=1, initial=0.0)
        self.rho = 1 / np.where(largest > 0, largest, 1.0)

    def state(self, start: Iterate) -> State:
        """v of the start; of its reactions, if there are any and M has an inverse; else 0."""
        return first_state(self.problem, start)

    def step(self, given: Conditions, state: State) -> State:
        """A sparse factorisation; rows of displacements are scaled to the unit of r."""
        p, able = self.problem, self._able(given)[:, :, None]
        assert p.M is not None and p.H is not None and p.f is not None and p.w is not None
        nc, d = p.contacts, p.dimension
        scale = np.where(np.einsum("kii->ki", given.G_r) == 0, self.rho[:, None], 1.0)
        rows_u = given.G_u * scale[:, :, None] * able
        rows_r = given.G_r * scale[:, :, None] * able + (~able) * np.eye(d)
        b = (given.b * scale - np.einsum("kij,kj->ki", rows_u, p.w)) * able[:, :, 0]
        G_u, G_r = _block_diagonal(rows_u), _block_diagonal(rows_r)
        matrix: Any = sparse.block_array([[p.M, -p.H], [G_u @ p.H.T, G_r]], format="csc")
        x = self.linear.factor(matrix).solve(np.concatenate([p.f, b.ravel()]))
        v, r = x[: p.unknowns], x[p.unknowns :].reshape(nc, d)
        return State(r, p.local_velocity(v), v, 1)

    def _able(self, given: Conditions) -> Mask:
        """Directions with a condition on r: driven ones while it is not that they stick."""
        return self.able | (self.driven & given.G_r.any(axis=2))

    def displacement(self, state: State) -> Array:
        """v as it is."""
        return state.v


class Cycles:
    """Multigrid cycles in the one-sided basis."""

    def __init__(
        self,
        problem: FrictionProblem,
        basis: OneSided,
        option: MultigridCycle,
        cycles: int | None,
    ) -> None:
        self.problem, self.basis, self.option, self.cycles = problem, basis, option, cycles
        self.tool = problem.kept(_contact_cycles)
        used = basis.dofs != HELD
        self.slots = np.where(used, basis.dofs, 0)
        self.frames, self.to_reaction = basis.frames, basis.inverse
        self.rows = sparse.csr_array(basis.M)[self.slots.ravel()]

    def state(self, start: Iterate) -> State:
        """As for the direct solver, in the one-sided basis."""
        given = first_state(self.problem, start)
        return State(given.r, given.u, self.basis.from_displacement(given.v))

    def step(self, given: Conditions, state: State) -> State:
        """m cycles, or as many as an exact solution needs; one step of one solve at a time."""
        with self.tool.lock:
            v, count = self._solve(given, state)
        force = (self.rows @ v).reshape(self.slots.shape) - self.basis.f[self.slots]
        r = np.einsum("kij,kj->ki", self.to_reaction, force)
        u = np.einsum("kij,kj->ki", self.frames, v[self.slots]) + self.problem.w
        return State(r, u, v, count)

    def _solve(self, given: Conditions, state: State) -> tuple[Array, int]:
        """v in the one-sided basis, and cycles."""
        tool, w = self.tool, self.problem.w
        assert w is not None
        tool.set(given, self.basis.f, w)
        x = tool.nodes.spread(state.v)
        size, count = tool.residual(x), 0
        while count < (self.cycles or MOST_CYCLES):
            size = tool.cycle(x, self.option)
            count += 1
            if not np.isfinite(size):
                raise Breakdown("the multigrid cycles diverge")
            if self.cycles is None and size <= EXACT:
                break
        return tool.nodes.gather(x), count

    def displacement(self, state: State) -> Array:
        """v from the one-sided basis."""
        return self.basis.to_displacement(state.v)


def _contact_cycles(problem: FrictionProblem) -> ContactCycles:
    """Prepared of M and H, which have a one-sided basis."""
    basis = one_sided(problem)
    assert basis is not None
    known = problem.structure
    if known is not None:
        return ContactCycles(basis, known.component)
    modes, n, d = problem.near_nullspace, problem.unknowns, problem.dimension
    return ContactCycles(basis, components(modes, n, d))


def first_state(problem: FrictionProblem, start: Iterate) -> State:
    """v of the start; of its reactions, if there are any and M has an inverse; else 0."""
    v = start.v
    if v is None and start.r.any():
        try:
            v = problem.velocity(start.r)[1]
        except SingularOperator:
            v = None
    if v is None:
        v = np.zeros(problem.unknowns)
    return State(start.r, problem.local_velocity(v), v)


def _block_diagonal(blocks: Array) -> sparse.csr_array:
    nc, d, _ = blocks.shape
    index = np.arange(nc + 1)
    tiles = sparse.bsr_array((blocks, index[:-1], index), shape=(nc * d, nc * d))
    return sparse.csr_array(tiles)
