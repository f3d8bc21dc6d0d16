"""Searches that somebody looks at, and may end with what is known by then."""

import signal
import time
from contextlib import contextmanager

import numpy as np
import pytest
from click.testing import CliRunner

import amontons as am
from amontons.app import progress
from amontons.app.cli import main
from amontons.app.cli.stopping import ending_early
from amontons.core.clock import NEVER, Deadline
from amontons.core.errors import TimeUp
from amontons.core.onlookers import Onlooker, present, say
from amontons.mechanics.ready.gallery import random_delassus
from amontons.mechanics.ready.hild import hild_triangle


def test_every_deadline_ends_where_an_onlooker_asks_for_it():
    asked = []
    for deadline in (NEVER, Deadline.after(60), Deadline.counted(60)):
        with present(Onlooker(ends=lambda: bool(asked))):
            assert not deadline.passed
            assert deadline.share(0.5).left > 0
            asked.append(1)
            assert deadline.passed
            assert deadline.left == deadline.share(0.5).left == 0
            with pytest.raises(TimeUp, match="stopped after .* by the user"):
                deadline.pay(1.0)
            asked.clear()
        assert not deadline.passed


def test_what_is_looked_at_says_its_stage():
    seen = []
    with present(Onlooker(look=seen.append)):
        say("a stage")
        assert not NEVER.passed
        am.critical_friction(hild_triangle(6))
        am.all_solutions(random_delassus(0, 3, 3))
    assert seen[0] == "a stage"
    assert any("critical friction" in stage for stage in seen)
    assert any("this load: region 1" in stage for stage in seen)
    count = len(seen)
    assert not NEVER.passed
    assert len(seen) == count  # nobody is there any more


@pytest.mark.parametrize("verb", [am.uniqueness, am.all_solutions, am.critical_friction])
def test_a_search_that_has_to_end_at_once_says_so(verb):
    problem = hild_triangle(30, mu=2.5).assemble().condensed()
    with present(Onlooker(ends=lambda: True)):
        found = verb(problem)
    assert "by the user" in found.reason


def at_the_second_stage(monkeypatch, module):
    """Let Ctrl-C be pressed when a search says its second stage."""
    said = []

    def pressing(stage):
        said.append(stage)
        if len(said) == 2:
            signal.raise_signal(signal.SIGINT)
        say(stage)

    monkeypatch.setattr(f"amontons.analysis.{module}.say", pressing)
    return said


def test_ctrl_c_ends_a_verdict_with_the_bounds_reached(monkeypatch):
    before = signal.getsignal(signal.SIGINT)
    at_the_second_stage(monkeypatch, "certificates.critical_friction")
    done = CliRunner().invoke(main, ["uniqueness", "example:vee"])
    assert done.exit_code == 0  # this load is settled by what is always done
    assert "unique this load" in done.output
    assert "every load has one solution below" in done.output
    assert "proved by contact multipliers" in done.output  # not by the search that was ended
    assert signal.getsignal(signal.SIGINT) is before


def test_ctrl_c_leaves_a_verdict_undecided_and_says_so(monkeypatch):
    at_the_second_stage(monkeypatch, "certificates.critical_friction")
    large = ["--mu", "2.5", "--set", "mesh.refine=5"]
    done = CliRunner().invoke(main, ["uniqueness", "example:hild", *large])
    assert done.exit_code == 128 + signal.SIGINT
    assert "undecided" in done.output
    assert "every load has one solution below" in done.output


def test_ctrl_c_ends_a_list_with_what_newton_finds(monkeypatch):
    at_the_second_stage(monkeypatch, "solutions.enumerate")
    done = CliRunner().invoke(main, ["enumerate", "example:slab"])
    assert done.exit_code == 128 + signal.SIGINT
    assert "there may be others: stopped after" in done.output
    assert "by the user" in done.output


def test_a_second_signal_breaks_into_the_search():
    with ending_early() as stop:
        signal.raise_signal(signal.SIGINT)
        assert stop.received is signal.SIGINT
        assert NEVER.passed
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)


def test_the_line_on_a_terminal(monkeypatch):
    drawn = []

    @contextmanager
    def line(first):
        drawn.append(("", first))
        yield lambda stage, text: drawn.append((stage, text))

    monkeypatch.setattr(progress, "_line", line)
    monkeypatch.setattr(progress, "PAUSE", 0.0)
    with progress.searching("outer"), progress.searching("inner"):  # one line for both
        say("a stage")
        time.sleep(0.001)
        assert not NEVER.passed
    (first, second) = drawn
    assert first == ("", "outer …")
    assert second[0] == "outer"
    assert second[1].startswith("a stage  0.")
    drawn.clear()
    found = am.uniqueness(random_delassus(0, 3, 2))
    assert drawn[0] == ("", "uniqueness …")
    assert np.isfinite(found.seconds)
