"""Audits of models with references, of our own files, and of single wrong displacements."""

import numpy as np
import pytest

import amontons as am
from verify.press_fits import Fit

STEEL = am.LinearElastic(1000.0, 0.3)


def coupled() -> am.Model:
    body = am.Body(am.box((2, 1), (8, 4)), STEEL)
    return am.Model(
        [body], [am.Fix("R", (0.01, -0.02)), am.Fix("R.rotation", (0.002,))],
        [am.Contact("bottom", am.Plane(normal=(0, 1)), mu=0.4)],
        references=[am.Reference("R", (2.0, 0.5))], constraints=[am.Coupling("top", "R")],
    )  # fmt: skip


@pytest.fixture(scope="module")
def solved() -> am.ModelSolution:
    return am.solve(coupled(), tolerance=1e-10)


def test_a_model_with_a_reference_is_audited(solved):
    found = am.audit(solved.model, solved)
    assert found.is_right, str(found)
    assert found.findings["balance"].numbers["residual"] < 1e-8


def test_a_node_that_leaves_its_coupling_is_named(solved):
    moved = solved.displacement[0].copy()
    node = int(solved.model.bodies[0].mesh.surface_nodes("top")[3])
    moved[node, 1] += 1e-3
    found = am.audit(solved.model, (moved,))
    assert found.findings["balance"].verdict.value == "wrong"
    assert "constraints" in found.findings["balance"].text
    assert found.findings["balance"].nodes == (str(node),)


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("surface", [None, "bottom"])
def test_the_one_node_that_is_off_is_named_first(solved, seed, surface):
    rng = np.random.default_rng(seed)
    mesh = solved.model.bodies[0].mesh
    taken = np.concatenate([mesh.surface_nodes("top"), mesh.surface_nodes("bottom")])
    among = (np.setdiff1d(np.arange(len(mesh.points)), taken) if surface is None
             else mesh.surface_nodes(surface))  # fmt: skip
    node, moved = int(rng.choice(among)), solved.displacement[0].copy()
    moved[node, int(rng.integers(2))] += 2e-4 * rng.choice([-1, 1])
    balance = am.audit(solved.model, (moved,)).findings["balance"]
    assert balance.verdict.value == "wrong"
    assert balance.nodes[0] == str(node)
    assert f"node {node} alone, off by 0.0002" in balance.text


@pytest.mark.parametrize("suffix", ["frd", "dat", "vtu", "h5"])
def test_our_own_files_are_right(solved, suffix, tmp_path):
    path = tmp_path / f"solution.{suffix}"
    solved.write(path)
    assert am.audit(solved.model, path).is_right


def test_a_body_at_rest_does_not_overlap_by_rounding():
    low = am.Body(am.box((0.3, 0.1), 3), STEEL, "low")
    up = am.Body(am.box((0.3, 0.1), 3, origin=(0.1, 0.1 + 1e-17)), STEEL, "up")
    model = am.Model([low, up], [am.Fix("low.bottom", 0.0), am.Fix("up.top", 0.0)],
                     [am.Contact("up.bottom", master="low.top", mu=0.3)])  # fmt: skip
    still = tuple(np.zeros(body.mesh.points.shape) for body in model.bodies)
    assert am.audit(model, still).is_right


def test_what_moves_as_a_whole_has_no_forces_and_six_digits_can_not_tell(tmp_path):
    body = am.Body(am.box((1, 1), 3, origin=(0, 1)), STEEL)
    model = am.Model([body], [am.Fix("top", (0.037, 0.113))],
                     [am.Contact("bottom", am.Plane(normal=(0, 1)), mu=0.3)])  # fmt: skip
    solution = am.solve(model)
    for suffix, verdicts in (("dat", ("right",)), ("frd", ("right", "undecided"))):
        solution.write(tmp_path / f"a.{suffix}")  # rounding may press, or pull
        assert am.audit(model, tmp_path / f"a.{suffix}").verdict in verdicts


@pytest.mark.parametrize("seed", range(8))
def test_rounding_noise_of_a_body_without_forces_is_never_wrong(seed):
    body = am.Body(am.box((1, 1), 3, origin=(0, 1)), STEEL)
    model = am.Model([body], [am.Fix("top", (0.037, -0.9))],
                     [am.Contact("bottom", am.Plane(normal=(0, 1)), mu=0.3)])  # fmt: skip
    moved = am.solve(model).displacement[0]
    last = np.array([0.5e-10, 0.5e-9])  # half a unit of the ninth digit
    noise = last * np.random.default_rng(seed).uniform(-1, 1, moved.shape)
    assert am.audit(model, (moved + noise,), digits=9).verdict != "wrong"


@pytest.mark.parametrize("push", [0.0, 1.0])
def test_our_own_curved_fit_of_second_order_is_right(push):
    """Frames turn over its facets: nodal forces are no multiples of one frame each."""
    model = Fit((2, 4, 2), (2, 6, 3), order=2).model(push)
    found = am.audit(model, am.solve(model, tolerance=1e-10))
    assert found.verdict == "right", str(found)
