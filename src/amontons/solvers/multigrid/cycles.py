"""Contact on meshes for about the price of one linear solve: multigrid with the law inside.

One cycle, from v on the finest level:

1. smooth: block Gauss-Seidel in the bulk, then every contact node solves its own problem of
   contact and friction exactly (`nodes`), once before and once after the nodes that it touches
   have been swept again.  In one-sided bases these couple strongly with the contacts, and so
   does the master side: without that sweep cycles doubled with every refinement.  Where their
   rows hold LITTLE of the residual, contacts are solved once, behind the sweep over all nodes.
   Of two bodies these nodes and contacts have the last numbers; the sweep over the others
   continues the one of the cycle before (`linear.halves`).
2. mix: of this point and the last ones, the one with the least residual (`least_residual`);
   contacts solve again unless none has changed its state, and states, reactions and residual
   are of this v.
3. coarse correction: one linear V(1,1) cycle, with two on the second coarse level, on levels
   that see these states, a Galerkin tangent whose test and trial spaces are truncated to the
   directions in which the contacts can move (`truncation`).  It is renewed when more than FEW
   states change, or any while the error falls little (STALE), or when it has fallen far.
   Slip ends where it would turn round (`ContactNodes.limit`).
4. smooth in reverse order.

Residuals say little of what moves slowly in soft parts between stiff ones: after LATE cycles
whole steps are mixed instead (`anderson`), between 4 and 1 and with a longer memory.  What is
mixed is forgotten when many states change.

While many states change and the error hardly falls, step 3 is that of the convex problem with
the present bounds of friction: nodes that it lets penetrate are lifted to the surface, and the
step is taken as far as the energy of that problem falls.  This costs one more product.

On geometric levels the start is nested: each level is solved to `coarse_tolerance` first, from
the solution of the next coarser one.  No parameter depends on the units or on the law.

The truncated coarse spaces go back to R. Kornhuber's monotone multigrid for obstacle problems;
the tangent for Coulomb's law is that of the full Newton method in [HSW] section 7; the limited
step follows [GK].

[GK] C. Gräser, R. Kornhuber, "Multigrid methods for obstacle problems", J. Comput. Math. 27
(2009).
[HSW] S. Hüeber, G. Stadler, B. Wohlmuth, "A primal-dual active set algorithm for
three-dimensional contact problems with Coulomb friction", SIAM J. Sci. Comput. 30 (2008).
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from ...core.arrays import read_only
from ...core.errors import UnsupportedForm
from ...core.options import check_options
from ...linear.halves import Halves
from ...linear.vectors import BESIDE, add_scaled, copy_into, dot
from ...problem.friction import Form, FrictionProblem
from ..anderson import Anderson
from ..contract import (
    Breakdown,
    Iterate,
    Iterates,
    Patience,
    Target,
    check_at_least,
    check_positive,
)
from ..least_residual import LeastResidual
from .levels import ContactLevels
from .nodes import ContactNodes
from .tangent import Tangent
from .visits import CLOSED

Array = NDArray[np.float64]
MANY = 0.1  # share of contacts that change their state above which mixing begins anew
GROWTH = 1e3  # of the error over the best one that counts as divergence
LATE = 30  # cycles after which steps are mixed: residuals hide slow errors in soft parts
LONG = 24  # steps to mix then
FEW = 0.1  # share of the closed contacts up to which changed states leave the tangent as it is
GRID_DEPTH = 2  # past cycles to mix at most where M is not stored
STALE = 0.5  # fall of the error in a cycle above which any changed state renews the tangent
SLOW = 0.8  # fall of the error in a cycle above which, while states change, steps are limited
LITTLE = 0.25  # share of |residual| in the rows that contacts touch: below it these solve once
CLOSE = 0.99  # share of the error that should do at which an iterate is handed out


@dataclass(frozen=True)
class ContactMultigrid:
    """Nonlinear multigrid for meshed bodies in contact, see the module.

    depth: past cycles that are combined for the least residual, 0 for none.  update_ratio: the
    tangent is renewed at the latest when the error has fallen by this factor.  Raises Breakdown
    where contacts have no slave nodes of their own (`one_sided`) and where the cycles fail.
    """

    form: ClassVar[Form] = Form.GLOBAL
    matrix_free: ClassVar[bool] = True  # M may be an operator
    depth: int = 8
    nested: bool = True
    coarse_tolerance: float = 1e-2
    update_ratio: float = 0.01
    contact_sweeps: int = 1  # over the contact nodes after each sweep in the bulk
    patience: int = 30  # cycles without halving the error before it gives up
    report: int = 10  # cycles between iterates that are not yet good enough

    def __post_init__(self) -> None:
        check_options(self)
        check_at_least(0, depth=self.depth)
        check_at_least(
            1, contact_sweeps=self.contact_sweeps, patience=self.patience, report=self.report
        )
        check_positive(coarse_tolerance=self.coarse_tolerance, update_ratio=self.update_ratio)

    def iterates(self, problem: FrictionProblem, start: Iterate, target: Target) -> Iterates:
        """States of the finest level, when they seem good enough and every `report` cycles."""
        if problem.form is not Form.GLOBAL:
            raise UnsupportedForm("ContactMultigrid: the problem has no global form")
        if not problem.contacts:
            return
        levels = ContactLevels.of(problem)
        try:
            yield from self._iterates(problem, levels, start, target)
        finally:
            levels.hierarchy.rest()

    def _iterates(
        self, problem: FrictionProblem, levels: ContactLevels, start: Iterate, target: Target
    ) -> Iterates:
        tangent = Tangent(levels.truncation)
        x = levels.start(problem, start)
        finest = levels.finest(problem)
        if self.nested and start.v is None:
            self._nested_start(levels, tangent, problem, x, finest[1])
        run = _Run(levels, tangent, self, finest, 0)
        run.goal, own = CLOSE * target.tolerance, []
        for error in run.cycles(x):
            own.append(error)
            since = len(own)
            ready = error <= run.goal
            if not (ready or since >= self.report or target.deadline.passed):
                continue
            iterate = Iterate(
                run.contacts.r[:, : problem.dimension].copy(),
                read_only(levels.displacement(x)),
                iterations=since,
                linear_iterations=since,
                stage="contact multigrid",
                own=tuple(own),
            )
            judged, own = (yield iterate), []
            if ready:  # the error that would have been small enough
                told = target.error(problem, iterate, judged)
                share = min(target.tolerance / told, 1.0) if told > 0 else 0.0
                run.goal = CLOSE * error * share

    def _nested_start(
        self,
        levels: ContactLevels,
        tangent: Tangent,
        problem: FrictionProblem,
        x: Array,
        f: Array,
    ) -> None:
        """Add to x what the coarser levels find, from the coarsest one up; f: load of nodes."""
        coarse = levels.coarse_problems(problem, x, f)
        correction: Array | None = None
        for k in range(len(coarse), 0, -1):
            contacts, f = coarse[k - 1]
            y = np.zeros_like(f)
            if correction is not None:
                levels.hierarchy.levels[k].P.add(correction, y)
            given = (contacts, f, *levels.coarse_scales(k, f, problem))
            run = _Run(levels, tangent, self, given, k)
            run.goal = self.coarse_tolerance
            try:
                for error in run.cycles(y):
                    if error <= run.goal:
                        break
            except Breakdown:  # a bad start is better than none
                pass
            correction = y
        if correction is not None:
            levels.hierarchy.levels[0].P.add(correction, x)


class _Run:
    """Cycles on level k as the finest one, for given contacts, load (nodes, 3) and scales.

    tangent: that of this solve, which the runs of its nested start use before.
    """

    def __init__(
        self,
        levels: ContactLevels,
        tangent: Tangent,
        options: ContactMultigrid,
        given: tuple[ContactNodes, Array, float, float],
        k: int,
    ) -> None:
        self.levels, self.tangent, self.options, self.k = levels, tangent, options, k
        self.contacts, self.f, self.load, self.length = given
        self.level = levels.hierarchy.levels[k]
        A = self.level.A
        self.sums = A.sums() if isinstance(A, Halves) else None
        self.left = np.empty((self.contacts.others or 0, 3))  # of these, see `halves`
        self.known = False  # are they of x?
        self.held = np.zeros(self.level.A.nodes, dtype=bool)
        self.held[self.contacts.node] = True
        self.kind = self.held.astype(np.int8)
        self.kind[self.contacts.near.node] = BESIDE
        tangent.begin(k, self.contacts)
        self.parts = self.contacts.tangent()  # V, W, L at the present states
        self.states = np.full_like(self.contacts.state, -2)  # of the tangent
        self.before = self.states  # of the last cycle
        self.calm = False  # is there little residual where contacts touch the bulk?
        self.frozen = False  # are the bounds of friction, in the tangent?
        self.updates = 0
        self.goal = 0.0  # error that will do
        self.r = np.empty_like(self.f)

    def cycles(self, x: Array) -> Iterator[float]:
        """Errors of x, (nodes, 3), which is improved in place between them."""
        depth = self.options.depth
        if not self.level.A.is_stored:  # then cycles are as cheap as the mixing
            depth = min(depth, GRID_DEPTH)
        mixing, long, before = LeastResidual(x.size, depth), None, x
        best = at_update = last = np.inf
        patience = Patience(self.options.patience)
        for count in itertools.count():
            if count == LATE and depth:
                mixing = LeastResidual(x.size, 0)
                long = Anderson(x.size, LONG if self.level.A.is_stored else depth)
                before = np.empty_like(x)
            if long is not None:
                copy_into(x, before)
            self.smooth(x, backward=False)
            for _ in range(self.options.contact_sweeps):
                self.contacts.relax(self.f, x, self.held, backward=False, once=self.calm)
            self.evaluate(x)
            error = self.error(x)
            self.parts = self.contacts.tangent()
            unsettled = self.changed() > MANY * len(self.contacts.node)
            if unsettled:
                mixing.forget()
            if error > self.goal and long is None:
                error = self.accelerate(x, error, mixing)
            yield error
            if not np.isfinite(error) or error > GROWTH * best:
                raise Breakdown("contact multigrid: the cycles diverge")
            best = min(best, error)
            if patience.over(error):
                raise Breakdown("contact multigrid: the cycles have stalled")
            careful = unsettled and error > SLOW * last
            stale = self.changed() > 0 and error > STALE * last
            last = error
            fallen = error < self.options.update_ratio * at_update
            if not self.few_changed() or stale or self.frozen or fallen:
                self.renew(careful)
                at_update = error
            (self.correct_carefully if careful else self.correct)(x)
            self.contacts.relax(self.f, x, self.held, backward=True, once=self.calm)
            self.smooth(x, backward=True)
            if long is not None:
                if unsettled:
                    long.forget()
                long.mix(before.reshape(-1), x.reshape(-1))
                self.known = False

    def changed(self) -> int:
        """Number of contacts in another state than in the tangent."""
        return int(np.count_nonzero(self.contacts.state != self.states))

    def few_changed(self) -> bool:
        """True where hardly any contact has changed its state since the tangent was renewed."""
        closed = int(np.count_nonzero(self.contacts.state >= CLOSED))
        return self.changed() <= FEW * closed

    def smooth(self, x: Array, backward: bool) -> None:
        """One sweep over all nodes but those of contacts; what these touch is next to them."""
        A, contacts = self.level.A, self.contacts
        if backward and contacts.others is not None:
            contacts.near.smooth(self.f, x, self.held, backward)
        if not isinstance(A, Halves) or self.sums is None:
            (contacts.bulk or A).smooth(self.f, x, self.held, backward)
        elif backward:
            A.backward(self.f, x, self.sums)
        else:
            if not self.known:
                A.sum(x, self.sums)
            A.forward(self.f, x, self.sums, self.left)
        if contacts.others is not None and not backward:
            contacts.near.smooth(self.f, x, self.held, backward)
        self.known = backward

    def evaluate(self, x: Array) -> None:
        """The residual after a forward sweep and the visits of contacts."""
        A = self.level.A
        if isinstance(A, Halves) and self.sums is not None:
            A.leave(x, self.left, self.sums, self.r[: A.count])
            self.contacts.residual(self.f, x, self.r)
        else:
            A.residual(x, self.f, self.r)

    def accelerate(self, x: Array, error: float, mixing: LeastResidual) -> float:
        """x as the best of the last points, with its law kept; its error.

        It stays as it was where its error would grow, and the memory begins anew.  The rows of
        contacts in the residual that is made small are those of the tangent (`combine`).
        Contacts solve again only where a state has changed since the last cycle: what sticks or
        is open does so in all points alike, and slip turns little.
        """
        contacts, node, r = self.contacts, self.contacts.node, self.r
        raw, before, state = r[node], x[node], contacts.state.copy()
        settled = bool((state == self.before).all())
        contacts.combine(self.parts[1], r)
        if mixing.mix(x.reshape(-1), r.reshape(-1)):
            if settled:
                contacts.own_residual(self.f, x, r)
            else:
                contacts.sweep(self.f, x)
                contacts.residual(self.f, x, r)
            mixed = self.error(x)
            if mixed <= error:
                error, self.parts = mixed, contacts.tangent()
            else:
                mixing.undo(x.reshape(-1), r.reshape(-1))
                mixing.forget()
                x[node], contacts.state = before, state
                contacts.residual(self.f, x, r)
                self.error(x)
            raw = r[node]
            contacts.combine(self.parts[1], r)
        mixing.keep(x.reshape(-1), r.reshape(-1))
        r[node], self.before = raw, state
        return error

    def error(self, x: Array) -> float:
        """The measure of `judge` from the residual of x; reactions become those of x."""
        law = self.contacts.natural_map(x, self.r)
        balance, near = self.contacts.balance(self.r, self.kind)
        self.calm = near < LITTLE * balance
        return max(balance / self.load, law / self.length)

    def renew(self, frozen: bool) -> None:
        """The tangent at the present states on all coarser levels, for frozen bounds or not."""
        self.frozen = frozen
        self.tangent.renew(*(self.contacts.frozen().tangent() if frozen else self.parts))
        self.states = self.contacts.state.copy()
        self.updates += 1

    def correct(self, x: Array, contacts: ContactNodes | None = None) -> None:
        """x += V P (one V-cycle) on the rows of the tangent; exactly on the coarsest level."""
        # V and W with the slip of now, not those of `tangent`, or the solution would not rest
        V, W, _ = self.parts if contacts is None else contacts.tangent()
        contacts = contacts or self.contacts
        contacts.combine(W, self.r)
        P = self.level.P
        before = x[contacts.node]
        if P is None:
            x += self.tangent.solve(self.r)
        else:
            levels = self.tangent.hierarchy
            coarse = levels.levels[self.k + 1].work
            P.restrict(self.r, coarse.b)
            levels.cycle(self.k + 1, coarse.b, coarse.x, twice=True)
            P.add(coarse.x, x)
        contacts.limit(V, before, x)

    def correct_carefully(self, x: Array) -> None:
        """The same for fixed bounds of friction, as far as the energy falls."""
        contacts = self.contacts.frozen()
        before, force = x.copy(), self.r.copy()
        self.correct(x, contacts)
        contacts.lift(x)
        step = x - before
        product = self.r
        self.level.A.times(step, product)
        length = contacts.step_length(step, dot(force, step), dot(step, product))
        copy_into(before, x)
        add_scaled(length, step, x)
