"""Existence: a motion that opens all contacts, or reactions that hold each other."""

import json

import numpy as np
import pytest
from click.testing import CliRunner
from scipy import sparse

import amontons as am
from amontons.analysis.certificates.opening import RESIDUAL, Existence
from amontons.app.cli import main

WEDGED = sparse.csc_array(np.array([[1.0, 0, -1, 0], [0, 1, 0, -1], [0, 0.5, 0, 0.5]]))


def between_walls(w, mu):
    """A body between two parallel walls in 2D."""
    M = sparse.eye_array(3, format="csc")
    return am.FrictionProblem.from_global(M, WEDGED, np.zeros(3), w, np.full(2, float(mu)))


def check_certificate(problem, found):
    """Every claim again, from the arrays alone."""
    is_global = problem.form is am.Form.GLOBAL
    H = problem.H if is_global else problem.W
    H = H.toarray() if sparse.issparse(H) else np.asarray(H)
    w = problem.w if is_global else problem.q
    mu = problem.law.coefficient
    if found.verdict is Existence.ASSURED:
        u = (H.T @ found.v).reshape(w.shape) + w
        inside = u[:, 0] - mu * np.linalg.norm(u[:, 1:], axis=1)
        assert (inside > 0).all()
        assert found.margin > 0
    if found.verdict is Existence.NOT_ASSURED:
        r = found.r
        assert np.abs(r).max() == pytest.approx(1)
        assert (np.linalg.norm(r[:, 1:], axis=1) <= mu * r[:, 0] + 1e-7).all()
        felt, terms = H @ r.ravel(), np.abs(H) @ np.abs(r.ravel())
        assert np.abs(felt).max() <= 10 * RESIDUAL * terms.max()
        assert (w * r).sum() <= RESIDUAL * (np.abs(w) * np.abs(r)).sum()


@pytest.mark.parametrize("mu", [0, 0.3, 2])
@pytest.mark.parametrize(
    ("w", "verdict"),
    [
        ([[-1, 0], [-1, 0]], "not_assured"),  # walls that come together
        ([[0, 0], [0, 0]], "not_assured"),  # that just touch
        ([[1, 0], [1, 0]], "assured"),
        ([[1e-9, 0], [0, 0]], "assured"),
        ([[-1, 0], [1.001, 0.3]], "assured"),
    ],
)
def test_a_body_between_two_walls(w, mu, verdict):
    problem = between_walls(w, mu)
    for form in (problem, problem.condensed()):
        found = am.existence(form)
        assert found.verdict.value == verdict
        check_certificate(form, found)


def random_problem(random, d):
    nc, n = random.integers(1, 7), random.integers(1, 12)
    H = random.standard_normal((n, nc * d))
    if random.random() < 0.5:  # contacts that work against each other
        H[:, -d:] = -H[:, :d]
    w = random.standard_normal((nc, d)) * random.choice([0.0, 1.0])
    mu = random.choice([0.0, 0.2, 1.0, 5.0], nc)
    return am.FrictionProblem.from_global(
        sparse.eye_array(n, format="csc"), sparse.csc_array(H), np.zeros(n), w, mu
    )


@pytest.mark.parametrize("d", [2, 3])
def test_random_problems_have_one_certificate_or_the_other(d):
    random = np.random.default_rng(d)
    seen = set()
    for _ in range(60):
        problem = random_problem(random, d)
        found = am.existence(problem)
        assert found.verdict is not Existence.UNDECIDED, found
        check_certificate(problem, found)
        seen.add(found.verdict)
    assert len(seen) == 2


def test_in_2d_a_linear_program_says_the_same():
    from scipy.optimize import linprog

    random = np.random.default_rng(7)
    for _ in range(40):
        problem = random_problem(random, 2)
        found = am.existence(problem)
        H, w, mu = problem.H.toarray(), problem.w, problem.law.coefficient
        n, nc = H.shape[0], len(mu)
        rows, right = [], []
        for i in range(nc):
            for side in (1, -1):  # t - (u_N + side mu u_T) <= 0
                a = H[:, 2 * i] + side * mu[i] * H[:, 2 * i + 1]
                rows.append(np.append(-a, 1.0))
                right.append(w[i, 0] + side * mu[i] * w[i, 1])
        best = linprog(np.append(np.zeros(n), -1.0), np.array(rows), right,
                       bounds=[(-1e6, 1e6)] * n + [(None, 1.0)])  # fmt: skip
        if abs(best.x[-1]) > 1e-7:
            assert (best.x[-1] > 0) == (found.verdict is Existence.ASSURED)


def test_packings_have_a_solution_and_jammed_ones_depend_on_the_load():
    for seed in range(3):
        problem = am.SpherePacking(count=40, seed=seed).problem()
        found = am.existence(problem)
        assert found.verdict is Existence.ASSURED
        check_certificate(problem, found)


def test_what_the_theorem_does_not_speak_of_is_undecided():
    lopsided = am.FrictionProblem.from_delassus(
        np.array([[1.0, 0.8], [0.0, 1.0]]), q=[[-0.2, 1.0]], mu=[0.5]
    )
    found = am.existence(lopsided)
    assert found.verdict is Existence.UNDECIDED
    assert "not symmetric" in found.reason
    negative = am.FrictionProblem.from_delassus(np.diag([1.0, -1.0]), q=[[-0.2, 1.0]], mu=[0.5])
    assert am.existence(negative).verdict is Existence.UNDECIDED
    block = am.Body(am.box((1.0, 1.0), 2), am.LinearElastic(1e3, 0.2))
    loose = am.Model([block], [], [am.Contact("bottom", am.Plane((0, 1)), mu=0.3)],
                     [am.Traction("top", (0, -1.0))])  # fmt: skip
    found = am.existence(loose)
    assert found.verdict is Existence.UNDECIDED
    assert "contact alone holds a body" in found.reason


def test_time_is_finite():
    problem = am.SpherePacking(count=100).problem()
    found = am.existence(problem, time_limit=1e-6)
    assert found.verdict is Existence.UNDECIDED
    assert "1e-06 s" in found.reason
    with pytest.raises(am.InvalidInput, match="time_limit"):
        am.existence(problem, time_limit=-1)


def test_tresca_asks_for_normals_only():
    M = sparse.eye_array(3, format="csc")
    problem = am.FrictionProblem.from_global(
        M, WEDGED, np.zeros(3), [[1, 5], [1, -5]], am.Tresca([1.0, 1.0])
    )
    assert am.existence(problem).verdict is Existence.ASSURED


def test_info_tells_ranks_and_existence(tmp_path):
    from amontons.io.fclib import write_fclib

    for name, w, verdict in (("open", 1.0, "assured"), ("shut", -1.0, "not assured")):
        path = tmp_path / f"{name}.hdf5"
        flat = [[w, 0, 0], [w, 0, 0]]
        H = np.zeros((3, 6))
        H[0, [0, 3]], H[1, [1, 4]], H[2, [2, 5]] = (1, -1), (1, -1), (1, -1)
        write_fclib(
            am.FrictionProblem.from_global(
                sparse.eye_array(3, format="csc"), sparse.csc_array(H), np.zeros(3), flat,
                np.full(2, 0.4),
            ),
            path,
        )  # fmt: skip
        told = CliRunner().invoke(main, ["info", str(path)])
        assert told.exit_code == 0, told.output
        assert "rank of H" in told.output
        assert f"{verdict}: " in told.output
        data = json.loads(CliRunner().invoke(main, ["info", str(path), "--json", "-"]).output)
        assert data["rank of H"] == "3 of 6"
        assert data["degree of hyperstaticity"] == 3
        assert data["existence"]["verdict"] == verdict.replace(" ", "_")
        assert (data["existence"]["v"] is None) == (verdict != "assured")
        assert (data["existence"]["r"] is None) == (verdict == "assured")
    hurried = CliRunner().invoke(main, ["info", str(path), "--time-limit", "1e-9"])
    assert hurried.exit_code == 0
    assert "undecided" in hurried.output
    refused = CliRunner().invoke(main, ["info", str(path), "--time-limit", "-1"])
    assert refused.exit_code == 2
