"""A race of methods by measured progress: what `Auto` runs on the Delassus form.

Every track has a state of its own and goes on in chunks.  The next chunk goes to the track that
promises the goal for the least further cost:

    rest = ln(error / goal) (C - c) / ln(error(c) / error(C)),   c = (1 - WINDOW) C,

C what the track has cost and error(c) its best error then: the rate of the last part of its own
cost, a long one, which is patience; where its error stands, a multiple of how long it has done
so at least.  Smoothing Newton begins at a point far worse than the one that it starts from, and
its best error stands until it has come back: its rate is told from the error of where it is,
the first time; once it had to begin again, that promises nothing.  Every chunk costs a call
besides.  A track that has promised to be there at a cost F, and has not, is believed less: its
rest counts C / (GRACE F) times.  Besides

    unknown     a track is taken to need some part, or multiple, of all that was spent while it
                has had a small share of it; a method of Newton's kind what it usually needs
                until it has cost that
    near        where the best error of all is near the goal, momentum is taken to need, until
                it has cost that, a multiple of the whole way at the mean rate at which that
                error was come by: sweeps of another kind cost less than Newton's from afar
    as long     momentum and smoothing Newton are taken to need at most some multiple of what
                they have cost, or of what a trial costs: of a plateau nothing is known but how
                long it has lasted, and where a trial is cheap it is made before dear ones
    first       the track at the top of the table has a few chunks before all others, and more
                while it promises the goal for less than to let them in costs
    stacks      where most contacts share faces of rigid bodies, reactions are many more than
                balances: the method that solves such a problem at rest in a few steps follows
                the first chunk, a shorter one, unless the first track promises to be there for
                less, and has what it usually needs before all others, if its second step is
                nearer than its start; where chunks are brief it waits with the others, and
                comes before them
    dear        the interior point, smoothing Newton, and steps and sweeps in turn, begin where
                sweeps have cost as much as all steps and what smoothing Newton, or the latter,
                usually need: where none helps these trials cost no more than sweeps do
    nothing     where no track promises anything, the one that has cost least

    the end     where five times as much was spent as when the best error, or that of a track
                just above it, last halved, and a thousand Newton steps' worth, and many chunks
                or some seconds, with few contacts less, since

So no track is ever given up, none takes more than its share while it does not progress, and
only ratios of costs matter, which are operation counts.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Callable
from dataclasses import dataclass, field
from operator import itemgetter

from ...core.errors import SingularOperator
from ..contract import Breakdown, Iterate, Iterates
from .chunk import Chunk, Chunks, Done, Turn
from .state import FIRST_CHUNKS, State, chunks_alone

WINDOW = 0.6  # last part of a track's cost from which its rate is told
GRACE = 1.2  # times the cost at which a track has promised the goal: its promise is broken
# What an error that stands takes on, of how long it has; part of it that is no fall.
LULL, FALL = 2.0, 0.9
IDLE = 2  # chunks on stacks after which a method has to have come nearer
# Logarithm of the way to the goal, over that of the way to the best error, up to which that is
# near; multiple of the best error at which it is taken to have been come by.
NEAR, ALMOST = 1.5, 2.0
LATER = 1 / 3  # of the digits that the first chunk gains, what the next ones do
GROWTH = 0.2  # cost of a chunk, of what its track has cost
CALL = 3e4  # nanoseconds that a chunk costs besides: Python, a judgement, bookkeeping
SHORTEST = 6e4  # nanoseconds of a chunk at least, or the calls cost more than the sweeps
# Nanoseconds that letting the other tracks in costs: joints, symbolic factors; per block of W.
ENTRY, ENTRY_BLOCK = 3e5, 150.0
# All cost, in what it was at the last progress; Newton steps since, and nanoseconds or chunks;
# nanoseconds as dense factors cost, by the cube of contacts, up to some seconds.
LOST, LOST_STEPS, LOST_CUBED, LOST_MOST, LOST_CHUNKS = 5.0, 1000.0, 2e6, 2e9, 500
BESIDE = 10.0  # times the best error up to which a track's own progress counts as that of all
# Cost between two iterates that are handed out, of all cost, and its bounds in nanoseconds: the
# driver's judgement costs more than a chunk of a small problem, but it looks at the clock.
PAUSE, LEAST_PAUSE, MOST_PAUSE = 0.1, 5e6, 5e7


@dataclass(frozen=True)
class Entry:
    """A row of the table of tracks: chunks(state) where when(state) holds.

    share: of all cost up to which it is taken to be unknown, and then to need `optimism` times
    all cost.  needs: nanoseconds that a method of Newton's kind is taken to need, whatever its
    rate, until it has cost them; None for sweeps.  near: what it is taken to need near the end,
    in whole ways at the mean rate of the best; 0: nothing is known.  last: it runs where no
    other promises the goal for that, and has no more than its share while another promises it
    at all.  again, trial: it is taken to need at most `again` times what it has cost, or what
    trial(state), nanoseconds, says that a trial costs where that is more; no bound where trial
    is None.  stacked: Newton steps that it usually takes on stacks of rigid blocks, where it
    comes second; 0: it comes with the others.  waits: nanoseconds that sweeps have to have cost
    more than methods of Newton's kind before it begins.
    """

    name: str
    chunks: Callable[[State], Chunks]
    share: float = 0.0
    optimism: float = 1.0
    needs: Callable[[State], float] | None = None
    when: Callable[[State], bool] = lambda state: True
    last: bool = False
    near: float = 0.0
    again: float = math.inf
    trial: Callable[[State], float] | None = None
    stacked: int = 0
    waits: Callable[[State], float] | None = None


@dataclass(eq=False)
class Track:
    """A method in a race: what it has cost, and how its best error, unit of u, has fallen."""

    entry: Entry
    state: State
    cost: float = 0.0  # nanoseconds so far
    errors: list[float] = field(default_factory=list)
    # cost and what its rate is told from: its best error, or that of where it has got to
    path: list[tuple[float, float]] = field(default_factory=list)
    along: bool = False  # the latter
    chunks: Chunks | None = None
    promise: float = math.inf  # nanoseconds to the goal at its rate
    foreseen: float = math.inf  # the least cost at which it has promised the goal
    mark: float = math.inf  # its error when that last halved
    fell: tuple[float, float] = (0.0, math.inf)  # of `path`, where it last fell

    def advance(self, growth: float = GROWTH) -> Chunk | None:
        """A chunk, its reaction taken by the state; None where the method has ended.

        growth: its cost at least, of what the track has cost.
        """
        if self.chunks is None:
            self.chunks = self.entry.chunks(self.state)
            next(self.chunks)
            self.errors.append(self.state.first_error)
            self.path.append((0.0, self.state.first_error))
            self.fell = self.path[0]
        try:
            turn = Turn(max(growth * self.cost, SHORTEST), self.errors[-1])
            chunk = self.chunks.send(turn)
        except (StopIteration, Breakdown, SingularOperator):
            return None
        state = self.state
        state.take(chunk.r, chunk.error)
        if self.entry.needs is None and state.latest < state.swept_error:
            state.swept, state.swept_error = chunk.r, state.latest
        self.cost += chunk.cost + CALL
        self.errors.append(min(state.latest, self.errors[-1]))
        self._go_along(chunk)
        self.promise = self._at_its_rate()
        self.foreseen = min(self.foreseen, self.cost + self.promise)
        return chunk

    def rest(self, total: float, way: float = math.inf, spare: float = math.inf) -> float:
        """Nanoseconds to the goal that it promises, of `total` spent on all tracks.

        way: nanoseconds of the whole way at the mean rate of the best of all; spare: `spare`.
        """
        entry = self.entry
        if entry.needs is not None:
            needed = entry.needs(self.state)
            if entry.last:
                return needed if self.cost < entry.share * total else math.inf
            if self.cost < needed:
                waits = None if self.errors else entry.waits
                if waits is not None and spare < waits(self.state):
                    return math.inf
                return needed - self.cost
        broken = max(1.0, self.cost / (GRACE * self.foreseen))
        promise = max(broken * self.promise, LULL * (self.cost - self.fell[0]))
        if self.cost < entry.near * way:
            promise = min(promise, entry.near * way - self.cost)
        if entry.trial is not None:
            promise = min(promise, entry.again * max(self.cost, entry.trial(self.state)))
        unknown = self.cost < entry.share * total
        return min(promise, entry.optimism * total) if unknown else promise

    def soon(self) -> float:
        """Nanoseconds to the goal at the rate of the last chunk.

        The first falls from afar: the next ones are taken to gain a part of its digits.
        """
        (before, higher), (cost, error) = self.path[-2:]
        if error <= self.state.goal:
            return 0.0
        fall = higher / error if len(self.path) > 2 else (higher / error) ** LATER
        rest = math.log(error / self.state.goal) * (cost - before)
        return rest / math.log(fall) if fall > 1.0 else math.inf

    @property
    def idle(self) -> bool:
        """True where its first steps have not come nearer than where it began.

        On stacks the second step of the interior point does where some five are to be enough.
        """
        return len(self.errors) > IDLE and not self.errors[-1] < FALL * self.errors[0]

    def halved(self) -> bool:
        """True where its best error is half of what it was when this was last so."""
        halved = self.errors[-1] < 0.5 * min(self.mark, self.errors[0])
        self.mark = self.errors[-1] if halved else self.mark
        return halved

    def aim(self) -> None:
        """Promise the goal of the state anew."""
        if self.path:
            self.promise = self._at_its_rate()
            self.foreseen = self.cost + self.promise

    def _go_along(self, chunk: Chunk) -> None:
        """Note what the rate is told from."""
        along = chunk.path < math.inf
        if along is not self.along:
            self.along = along
            self.path.clear()
            self.fell = 0.0, math.inf
        best = self.path[-1][1] if self.path else math.inf
        self.path.append((self.cost, min(chunk.path, best) if along else self.errors[-1]))
        if self.path[-1][1] < FALL * self.fell[1]:
            self.fell = self.path[-1]

    def _at_its_rate(self) -> float:
        if len(self.path) <= FIRST_CHUNKS:
            return math.inf
        (begun, _), (cost, error) = self.path[0], self.path[-1]
        at = bisect_right(self.path, cost - WINDOW * (cost - begun), key=itemgetter(0)) - 1
        before, higher = self.path[max(at, 0)]
        if not error < higher:
            return math.inf
        if error <= self.state.goal:
            return 0.0
        rate = math.log(higher / error) / (cost - before)
        return math.log(error / self.state.goal) / rate


def whole_way(fall: list[tuple[float, float]], goal: float, near: float = NEAR) -> float:
    """Nanoseconds of the whole way at the mean rate of the best, infinite where it is afar.

    fall: cost of all and best error, unit of u, whenever that fell, from the start on.
    """
    best, first = fall[-1][1], fall[0][1]
    if not 0.0 < best < first or not goal > 0.0:
        return math.inf
    part = math.log(first / goal) / math.log(first / best)
    if part > near:
        return math.inf
    return part * next(cost for cost, error in fall if error <= ALMOST * best)


def spare(tracks: list[Track]) -> float:
    """Nanoseconds that sweeps have cost more than methods of Newton's kind."""
    racing = [track for track in tracks if not track.entry.last]
    return sum(t.cost if t.entry.needs is None else -t.cost for t in racing)


@dataclass(eq=False)
class Race:
    """The tracks of one problem; the first of the table leads."""

    state: State
    table: tuple[Entry, ...]

    def __post_init__(self) -> None:
        self.tracks = [Track(self.table[0], self.state)]
        self.total = 0.0  # nanoseconds of all tracks
        self.shown = 0.0  # total when an iterate was handed out last
        self.done = Done()  # since then
        self.chunks = 0
        self.shows_all = False  # where the driver ends what can not come to an end
        # error when the best last halved; total and chunks at the last progress
        self.mark = (self.state.first_error, 0.0, 0)
        self.fall = [(0.0, self.state.first_error)]  # total and best error whenever that fell

    def iterates(self) -> Iterates:
        """The best reaction now and then, to the end; a tighter goal that is sent counts."""
        alone, leader = FIRST_CHUNKS, self.tracks[0]
        while leader in self.tracks and self._is_first(leader):
            yield from self._go_on(leader)
            if self.chunks == 1:
                alone = chunks_alone(self.state.problem)
                if alone == 1:
                    yield from self._on_stacks(leader)
        if alone > 1:
            yield from self._on_stacks(leader)
        self.enter()
        while self.tracks and not self._is_lost():
            yield from self._go_on(self._next())
        if self.done.iterations:
            yield self._shown()

    def _is_first(self, first: Track) -> bool:
        """True while the first track has its chunks, or promises the goal before others run."""
        entry = ENTRY + ENTRY_BLOCK * len(self.state.problem.blocks.indices)
        return len(first.errors) <= FIRST_CHUNKS or first.rest(self.total) < entry

    def _on_stacks(self, first: Track) -> Iterates:
        """What is quick on stacks beside the first track, until it has had what it needs."""
        state = self.state
        if not (self.tracks and state.is_stacked):
            return
        for entry in [e for e in self.table if e.stacked and e.when(state)]:
            needed = entry.stacked * (state.relaxation_cost + CALL)
            track = Track(entry, state)
            self.tracks.append(track)
            while track in self.tracks and track.cost < needed and not track.idle:
                sooner = first in self.tracks and first.soon() < needed - track.cost
                yield from self._go_on(first if sooner else track)

    def enter(self) -> None:
        """Let all others of the table in; what tells which of them run costs something too."""
        state = self.state
        self.shows_all = state.problem.gains_energy
        there = [track.entry for track in self.tracks]
        for entry in self.table[1:]:
            if entry not in there and entry.when(state):
                self.tracks.append(Track(entry, state))

    def _go_on(self, track: Track) -> Iterates:
        """A chunk of a track, which leaves where it has ended."""
        growth = 0.0 if self.shows_all else GROWTH  # ended by how often the driver looks
        before, chunk = track.cost, track.advance(growth)
        if chunk is None:
            self.tracks.remove(track)
            return
        self.total += track.cost - before
        self.chunks += 1
        if self.state.error < self.fall[-1][1]:
            self.fall.append((self.total, self.state.error))
        self.done.add(chunk, track.entry.name)
        if track.halved() and track.errors[-1] <= BESIDE * self.state.error:
            self.mark = self.mark[0], self.total, self.chunks
        if self._is_due():
            judged = yield self._shown()
            if judged is not None and judged.goal < self.state.target.tolerance:
                self.state.aim(judged.goal)
                for every in self.tracks:
                    every.aim()

    def _shown(self) -> Iterate:
        """The best reaction for the driver."""
        done, self.done, self.shown = self.done, Done(), self.total
        return self.state.best(done.iterations, done.stage, done.flops, done.linear_iterations)

    def _is_due(self) -> bool:
        """True where the driver should see the best reaction: it may do, or it has waited."""
        pause = min(max(PAUSE * self.total, LEAST_PAUSE), MOST_PAUSE)
        waited = self.total - self.shown >= pause
        return self.shows_all or waited or self.state.error <= self.state.goal

    def _is_lost(self) -> bool:
        """True where nothing has helped for long."""
        error, total, chunks = self.mark
        if self.state.error < 0.5 * error:
            self.mark = self.state.error, self.total, self.chunks
            return False
        since, state = self.total - total, self.state
        long = min(LOST_CUBED * state.problem.contacts**3, LOST_MOST)
        needed = max((LOST - 1.0) * total, LOST_STEPS * state.step_cost)
        return since > needed and (since > long or self.chunks - chunks > LOST_CHUNKS)

    def _next(self) -> Track:
        """The track that promises the goal for the least cost."""
        way = whole_way(self.fall, self.state.goal)
        more = spare(self.tracks)
        rests = [track.rest(self.total, way, more) for track in self.tracks]
        least = min(rests)
        if least < math.inf:
            return self.tracks[rests.index(least)]
        return min(self.tracks, key=lambda track: track.cost)
