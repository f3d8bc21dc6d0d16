"""Audits: own answers are right, altered ones are found, whatever the units and the sides."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import amontons as am
from amontons.analysis.audit import questions
from amontons.core.errors import InvalidInput, UnsupportedForm

YOUNG = 1000.0


def two_blocks(
    length: float = 1.0, stress: float = 1.0, mu: float = 0.3, **law: float
) -> am.Model:
    """A block pressed on a larger one and dragged; meshes that do not match."""
    steel = am.LinearElastic(YOUNG * stress, 0.3)
    low = am.box((2 * length, 2 * length, length), cells=(4, 4, 2))
    top = am.box((length, length, length), cells=(3, 3, 2))
    raised = am.Mesh(top.points + length * np.array([0.5, 0.5, 1.0]), top.cells, top.surfaces)
    bodies = [am.Body(low, steel, "low"), am.Body(raised, steel, "high")]
    supports = [am.Fix("low.bottom", 0.0),
                am.Fix("high.top", (0.004 * length, 0.0, -0.01 * length))]  # fmt: skip
    contact = am.Contact("high.bottom", master="low.top", mu=mu, **law)
    return am.Model(bodies, supports, [contact], name="two blocks")


@pytest.fixture(scope="module")
def solved() -> am.ModelSolution:
    return am.solve(two_blocks())


def test_our_own_answer_is_right(solved):
    found = am.audit(solved.model, solved)
    assert found.is_right, str(found)
    assert found.findings["balance"].numbers["residual"] < 1e-8
    assert found.findings["forces"].numbers["difference"] < 1e-8
    name = found.pairs[0].name
    assert found.pairs[0].force == pytest.approx(solved.pairs[name].force, rel=1e-8)


UNITS = [(1.0, 1.0), (1e-3, 1e6), (1e-3, 1e-3), (1e3, 1.0), (1e-6, 1e6)]


@pytest.mark.parametrize(("length", "stress"), UNITS)
def test_the_verdict_is_the_same_in_all_units(solved, length, stress):
    model = two_blocks(length, stress)
    moved = tuple(length * part for part in solved.displacement)
    found, first = am.audit(model, moved, digits=6), am.audit(solved.model, solved, digits=6)
    assert found.is_right
    for name in ("penetration", "cone", "status"):
        share = {"penetration": "share", "cone": "ratio", "status": "missing_friction"}[name]
        wanted = first.findings[name].numbers[share]
        assert found.findings[name].numbers[share] == pytest.approx(wanted, rel=0.1, abs=1e-4)


def test_slave_and_master_may_be_exchanged(solved):
    contact = solved.model.contacts[0]
    turned = replace(contact, slave=contact.master, master=contact.slave)
    model = am.Model(solved.model.bodies, solved.model.supports, [turned])
    found = am.audit(model, solved.displacement, digits=6)
    assert found.is_right
    own = am.audit(solved.model, solved).pairs[0].force
    assert found.pairs[0].force == pytest.approx(-own, rel=1e-3)


@pytest.mark.parametrize("seed", range(20))
def test_one_altered_displacement_is_found_and_named(solved, seed):
    rng = np.random.default_rng(seed)
    moved = [part.copy() for part in solved.displacement]
    body = int(rng.integers(2))
    node, axis = int(rng.integers(len(moved[body]))), int(rng.integers(3))
    size = max(np.abs(part).max() for part in moved)
    moved[body][node, axis] += 0.02 * size * rng.choice([-1, 1])
    found = am.audit(solved.model, tuple(moved))
    assert found.verdict == "wrong"
    named = [n for finding in found.findings.values() for n in finding.nodes]
    mesh = solved.model.bodies[body].mesh
    near = {node, *(n for c in mesh.cells for row in c.nodes if node in row for n in row)}
    assert {f"{solved.model.bodies[body].name}:{n}" for n in near} & set(named)


@pytest.mark.parametrize("seed", range(5))
def test_one_altered_contact_force_is_found_and_named(solved, seed):
    rng = np.random.default_rng(seed)
    r = solved.r.copy()
    k = int(rng.choice(np.flatnonzero(r[:, 0] > 0.2 * r[:, 0].max())))
    r[k] = -r[k] if seed % 2 else 1.05 * r[k]
    from amontons.analysis.audit import Answer, audit_answer

    found = audit_answer(solved.model, Answer(solved.displacement, reactions=r))
    assert found.findings["forces"].verdict.value == "wrong"
    assert found.findings["forces"].nodes == (f"high:{solved.fields.node[k]}",)


def test_a_soft_contact_is_wrong_for_hard_contact_and_right_by_its_own_law():
    soft = am.solve(two_blocks(stiffness=2 * YOUNG))
    assert am.audit(soft.model, soft).is_right
    found = am.audit(soft.model, soft, law="hard")
    assert found.verdict == "wrong"
    numbers = found.findings["penetration"].numbers
    assert numbers["share"] > 0.1 and numbers["share_by_deck_law"] < 1e-6
    depth = (soft.pressure / (2 * YOUNG)).max()
    assert numbers["deepest"] == pytest.approx(depth, rel=0.2)


def test_a_node_without_load_that_overlaps_is_said(solved):
    seen = am.audit(solved.model, solved).pairs[0].seen[0]
    node = seen.side.node[0]
    idle = replace(seen, pressed=seen.side.node != node, deepest=0.5, deepest_node=int(node))
    found = questions.penetration((idle,), 1.0, 1.0, 1.0, str, deck=False)
    assert found.verdict.value == "right"
    assert f"node {node} carries no load, and overlaps by 0.5 of that" in found.text
    carries = replace(idle, pressed=seen.side.node == node)
    text = questions.penetration((carries,), 1.0, 1.0, 1.0, str, deck=False).text
    assert "carries no load" not in text


def test_a_result_of_zeros_whose_nodes_overlap_by_rounding_is_judged(solved):
    """Nothing presses, nothing is closed: there is no length to compare an overlap with."""
    seen = am.audit(solved.model, solved).pairs[0].seen[0]
    idle = replace(seen, pressed=np.zeros(len(seen.side.node), bool), deepest=1e-17)
    found = questions.penetration((idle,), 0.0, 1.0, 0.0, str, deck=False)
    assert "carries no load" not in found.text


def test_questions_to_pairs_have_words_where_there_are_no_pairs():
    body = am.Body(am.box((2, 1), (2, 1)), am.LinearElastic(1000.0, 0.3))
    model = am.Model([body], [am.Fix("left", 0)], loads=[am.Traction("right", (0.0, -1.0))])
    found = am.audit(model, am.solve(model).displacement)
    assert found.is_right
    assert all(each.text for each in found.findings.values())


def test_friction_of_another_coefficient_is_wrong(solved):
    more = am.audit(two_blocks(mu=0.1), solved.displacement)
    assert more.findings["cone"].verdict.value == "wrong"
    less = am.audit(two_blocks(mu=0.6), solved.displacement)
    assert less.findings["status"].verdict.value == "wrong"
    assert more.verdict == less.verdict == "wrong"


def test_too_few_digits_are_undecided(solved):
    # a rigid motion that swamps the strains in six digits
    moved = tuple(part + np.array([1e4, 0, 0]) for part in solved.displacement)
    supports = [am.Fix("low.bottom", (1e4, 0, 0)), am.Fix("high.top", (1e4 + 0.004, 0, -0.01))]
    model = am.Model(solved.model.bodies, supports, solved.model.contacts)
    assert am.audit(model, moved).is_right
    found = am.audit(model, tuple(part.round(1) for part in moved), digits=6)
    assert found.verdict == "undecided"
    assert found.rounding_bound > 0.1


def test_bodies_that_pass_through_each_other_are_wrong():
    model = two_blocks()
    free = am.Model(model.bodies, model.supports, [replace(model.contacts[0], mu=0.0)])
    low, high = (np.zeros(body.mesh.points.shape) for body in model.bodies)
    high += (0.004, 0, -0.01)
    found = am.audit(free, (low, high))
    assert found.findings["penetration"].verdict.value == "wrong"


def test_displacements_of_another_model_are_told(solved):
    with pytest.raises(InvalidInput, match="a row for each node"):
        am.audit(solved.model, (solved.displacement[0], solved.displacement[1][:-1]))
    broken = solved.displacement[0].copy()
    broken[3, 1] = np.nan
    with pytest.raises(InvalidInput, match="node 3 .*finite"):
        am.audit(solved.model, (broken, solved.displacement[1]))
    with pytest.raises(InvalidInput, match="law"):
        am.audit(solved.model, solved, law="soft")


def test_large_deformations_are_refused():
    block = am.Body(am.box((1, 1), cells=2), am.NeoHookean(1.0, 0.3))
    contact = am.Contact("bottom", am.Plane(normal=(0, 1)), mu=0.2)
    model = am.Model([block], [am.Fix("top", (0, -0.01))], [contact])
    with pytest.raises(UnsupportedForm, match="small strains"):
        am.audit(model, (np.zeros((9, 2)),))


def test_a_picture_and_a_page_show_it(solved, tmp_path):
    found = am.audit(solved.model, solved)
    found.plot(tmp_path / "a.png")
    page = found.report(tmp_path / "a.html").read_text(encoding="utf-8")
    assert "This answer is right." in page
