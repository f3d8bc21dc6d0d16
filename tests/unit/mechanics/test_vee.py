"""The V-shaped body: folds and solutions against independent programs, and on its own mesh."""

import json
import os
from pathlib import Path

import numpy as np
import pytest

from amontons import Mesh, refined
from amontons.analysis.paths.following import Limits, track_both
from amontons.analysis.paths.friction_path import FrictionPath
from amontons.analysis.paths.starting import exact_state
from amontons.mechanics.meshes.facets import Cells, Facets
from amontons.mechanics.ready.vee import vee
from amontons.mechanics.steps.system import Motion

REFERENCE = Path(os.environ.get("AMONTONS_SHARED", "../shared")) / "reference/vee"
needs_reference = pytest.mark.skipif(not REFERENCE.exists(), reason="no reference data")


def path_of(model):
    motion = Motion(model)
    ends = [
        motion.body.increment(motion.load(t), motion.prescribed(t), np.zeros((1, 1)))
        for t in (0.0, 1.0)
    ]
    return FrictionPath(*ends), motion.body


def reference_mesh(level):
    data = np.load(REFERENCE / "vee_h0.03.npz")
    edges, tags = data["boundary_edges"], data["boundary_tags"]
    surfaces = {"clamped": (Facets("line", edges[tags == 1]),),
                "contact": (Facets("line", edges[tags == 2]),)}  # fmt: skip
    return refined(Mesh(data["points"], (Cells("tri", data["triangles"]),), surfaces), level)


def whole_branch(path):
    return track_both(path, exact_state(path, 0.0), 0.0, Limits((0.0, 1.0)))


@needs_reference
@pytest.mark.parametrize("level", [0, 1])
def test_folds_and_solutions_of_other_programs(level):
    expected = json.loads((REFERENCE / "event_curve.json").read_text())["meshes"][level]
    path, body = path_of(vee(reference_mesh(level)))
    branch = whole_branch(path)
    folds = [fold["gamma"] for fold in expected["folds"]]
    np.testing.assert_allclose([e.parameter for e in branch.folds], folds, rtol=0, atol=1e-11)
    states = branch.at(0.38)
    assert len(states) == len(expected["solutions_at_0_38"]) == 3
    for y, other in zip(states, expected["solutions_at_0_38"], strict=True):
        solution = path.solution(y, 0.38)
        assert solution.convergence.error < 1e-11
        left = int(np.argmin(body.recover(solution).points[:, 0]))
        found = [*solution.u[left], *solution.r[left]]
        wanted = [-other["u_n"], other["u_t"], -other["lam_n"], other["lam_t"]]
        np.testing.assert_allclose(found, wanted, rtol=0, atol=1e-11)
        letters = {"f": "f", "s": "s", "l": "+", "r": "-"}
        assert solution.pattern[left] == letters[other["status"][0]]


@pytest.mark.parametrize(("mu", "folds"), [(1.4, 0), (1.8, 2)])
def test_folds_come_with_friction(mu, folds):
    path, _ = path_of(vee(1, mu=mu))
    branch = whole_branch(path)
    assert len(branch.folds) == folds
    for point in branch.points[:: len(branch) // 8]:
        assert path.solution(point.state, point.parameter).convergence.error < 1e-11
    if folds:
        upper, lower = (event.parameter for event in branch.folds)
        assert 0.32 < lower < 0.33 and 0.43 < upper < 0.45  # noqa: PT018
        assert len(branch.at(0.38)) == 3
