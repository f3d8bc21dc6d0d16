"""Gauss-Seidel with several relaxations in a race: no single one is good for all problems.

Measured on packings of some 1000 to 2000 spheres: 1.6 reaches 1e-8 in 1500 sweeps on most of
them, where 1.0 needs four times as many, but wanders for ever near 1e-3 on two, where 1.3 gets
to 1e-5; on a rock pile with mu = 1 0.9 gets to 1e-4 in a fraction of the sweeps of the others.
So all tracks run in turn, the cautious one later, but a track far behind the leader waits.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ...problem.friction import FrictionProblem
from ...problem.judge.measures import natural_error
from ..sweeps.kernels import Sweep, counted, sweep_data, sweeps_inplace, watch_for

Array = NDArray[np.float64]
RELAXATIONS = (1.6, 1.3, 0.9)
ALONE = 600  # sweeps that the first tracks do before the last one joins them
FAR_BEHIND = 3.0  # times the leader's error, from which a track waits


@dataclass(eq=False)
class Track:
    """Sweeps with one relaxation."""

    relaxation: float
    data: Sweep
    r: Array
    error: float = math.inf  # unit of u
    done: int = 0


class Race:
    """Tracks of one problem, all from the same reaction, (nc, 3)."""

    def __init__(self, problem: FrictionProblem, r: Array) -> None:
        self.kernel_data, self.judge_flops = problem.kernel_data, problem.judge_flops
        first = sweep_data(problem)
        self.tracks = [Track(w, first._replace(relaxation=w), r.copy()) for w in RELAXATIONS]
        self.alone = ALONE

    def enter(self, r: Array) -> None:
        """Let all tracks go on from another reaction, the last one too."""
        self.alone = 0
        for track in self.tracks:
            track.r, track.error, track.done = r.copy(), math.inf, 0

    def run(self, sweeps: int, goal: float) -> tuple[Track, int, float]:
        """Some sweeps of one track, at most until its error, unit of u, is `goal`.

        Returns the track, the sweeps and their floating point operations.
        """
        track = self._next()
        run = partial(sweeps_inplace, track.data, track.r, sweeps, watch_for(goal))
        count, flops = counted(track.data, run)
        track.done += count
        track.error = natural_error(*self.kernel_data, track.r)
        return track, count, flops + self.judge_flops

    def _next(self) -> Track:
        """The track whose turn it is."""
        bold = self.tracks[:-1]
        if min(track.done for track in bold) < self.alone:
            return min(bold, key=lambda track: track.done)
        fresh = [track for track in self.tracks if not track.done]
        least = min(track.error for track in self.tracks)
        near = [track for track in self.tracks if track.error <= FAR_BEHIND * least]
        return fresh[0] if fresh else min(near, key=lambda track: track.done)
