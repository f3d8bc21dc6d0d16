"""Where Newton's method begins a load step: the last way is given its time."""

import amontons as am
from amontons.solvers.newton import predictors
from amontons.solvers.newton.step_lengths import Failed


def test_the_last_way_of_a_whole_load_is_given_its_time(monkeypatch):
    def fails(*given):
        raise Failed("no way")

    monkeypatch.setattr(predictors, "by_tangent", fails)
    monkeypatch.setattr(predictors, "EARLY", 0)
    block = am.Body(am.box((1, 1), 3), am.NeoHookean(240.565, 0.4999))
    supports = [am.Fix("top", (0, -0.02)), am.Fix("left", (0, None))]
    floor = am.Contact("bottom", am.Plane((0, 1)), mu=0.5)
    solution = am.solve(am.Model([block], supports, [floor]))
    assert solution.convergence.outcome.name == "CONVERGED"
