"""Masters of several bodies, and nodes that are slave of one contact and master of another."""

from dataclasses import replace

import numpy as np
import pytest
from tangent_checker import checked_tangents

import amontons as am
from amontons.core.errors import FileFormatError
from amontons.io.case.contacts import read_contact
from amontons.io.case.tables import Table
from amontons.mechanics.model.large_deformation import large_deformation, large_step

NEO = am.NeoHookean(1.0, 0.3)


def body(name, size, cells, origin, order=1, kind=None):
    box = am.box(size, cells, origin=origin, **({"kind": kind} if kind else {}))
    return am.Body(box, NEO, name=name, order=order)


def balance(step):
    """Sum of all contact forces over their size, and that of the slaves' side."""
    parts = large_deformation(step.model).parts
    u = step.state.displacement.reshape(parts.X.shape)
    pushed = parts.meet(u).columns(step.frames) @ step.state.force.ravel()
    pushed = pushed.reshape(parts.X.shape)
    return np.abs(pushed.sum(axis=0)).max() / np.abs(pushed).sum()


# ---------------------------------------------------------------- a master of two bodies
def table(contacts, order=1):
    """A block that is pressed onto one of two blocks side by side and drawn onto the other."""
    parts = [body("left", (1.5, 1), (6, 3), (-0.4, -1), order),
             body("right", (1.4, 1), (5, 3), (1.1, -1), order),
             body("top", (1, 1), (3, 3), (0, 0))]
    way = (lambda x, t: 1.2 * max(t - 1, 0), lambda x, t: -0.05 * min(t, 1))
    held = [am.Fix("left.bottom", 0), am.Fix("right.bottom", 0), am.Fix("top.top", way),
            am.Fix("left.right", (0, None)), am.Fix("right.left", (0, None))]  # fmt: skip
    return am.Model(parts, held, contacts)


def two(**law):
    return [am.Contact("top.bottom", master=f"{k}.top", **law) for k in ("left", "right")]


def one(**law):
    return [am.Contact("top.bottom", master="left.top", more_masters=["right.top"], **law)]


@pytest.mark.parametrize("order", [1, 2])
def test_a_slave_of_two_masters_slides_from_one_to_the_other(order):
    """As over one body of both, whose halves hold where the two are held side by side."""
    model = table(two(mu=0.1), order)
    assert [c.masters for c in model.contacts] == [("left.top", "right.top")]
    steps = list(am.evolve(model, am.QuasiStatic(0.2), until=2.0))
    assert all(balance(step) < 1e-13 for step in steps)
    normal = np.array([np.ravel(step.resultant())[1] for step in steps])
    assert normal[-1] == pytest.approx(normal[4], rel=0.1)
    assert normal[4:].min() > 0.6 * normal[4]  # also across the cut
    asked = am.evolve(table(one(mu=0.1), order), am.QuasiStatic(0.2), until=2.0)
    *_, last = asked
    np.testing.assert_array_equal(last.state.force, steps[-1].state.force)


def test_a_master_cut_in_two_is_as_a_whole_one():
    """Masters that are held all over: the same forces, also where the cut lies."""
    pieces = [body("left", (1, 1), (4, 3), (-0.5, -1)),
              body("right", (1, 1), (4, 3), (0.5, -1))]  # fmt: skip
    whole = [body("lower", (2, 1), (8, 3), (-0.5, -1))]
    found = []
    for below in (pieces, whole):
        below = [am.Body(b.mesh.with_surfaces({"every": b.mesh.boundary}), NEO, name=b.name)
                 for b in below]  # fmt: skip
        held = [am.Fix("upper.top", (0.05, -0.1))]
        held += [am.Fix(f"{b.name}.every", 0) for b in below]
        first, *more = (f"{b.name}.top" for b in below)
        pair = am.Contact("upper.bottom", master=first, more_masters=more, mu=0.3)
        model = am.Model([*below, body("upper", (1, 1), (3, 3), (0, 0))], held, [pair])
        found.append(am.solve(model, tolerance=1e-11).force)
    np.testing.assert_allclose(found[0], found[1], atol=1e-10)


def test_masters_of_other_kinds_of_cells():
    """In space a slave on hexahedra beside tetrahedra: forces balance, tangents are exact."""
    parts = [body("left", (1, 1, 1), (2, 2, 1), (-0.5, 0, -1)),
             body("right", (1, 1, 1), (2, 2, 1), (0.5, 0, -1), kind="tet"),
             body("upper", (1, 0.8, 0.5), (2, 2, 1), (0, 0.1, 0))]
    held = [am.Fix("left.bottom", 0), am.Fix("right.bottom", 0), am.Fix("upper.top", 0)]
    pair = am.Contact("upper.bottom", master="left.top", more_masters=["right.top"], mu=0.3)
    check(am.Model(parts, held, [pair]), 0.02, 3)


def overlapping(dim, at=0.0, kind=None, order=1):
    """A block over two blocks whose ends lie in each other by .1, not at one height."""
    deep = () if dim == 2 else (1,)
    cells = [(2, *deep, 1), (3, *deep, 1)]
    boxes = [("left", cells[0], (1, *deep, 1), (-0.5, *(0 for _ in deep), -1)),
             ("right", cells[1], (1, *deep, 1), (0.4, *(0 for _ in deep), -1.02)),
             ("upper", cells[1], (1, *(0.8 for _ in deep), 0.5), (at, *(0.1 for _ in deep), 0))]
    parts = [body(name, size, number, origin, order, kind)
             for name, number, size, origin in boxes]
    held = [am.Fix("left.bottom", 0), am.Fix("right.bottom", 0), am.Fix("upper.top", 0)]
    pair = am.Contact("upper.bottom", master="left.top", more_masters=["right.top"], mu=0.3)
    return am.Model(parts, held, [pair])


@pytest.mark.parametrize("dim", [2, 3])
def test_what_overlapping_masters_cover_counts_once_wherever_they_are(dim):
    """What faces any of them, at most all of a facet; no jumps of averages as ends pass."""
    parts = large_deformation(overlapping(dim)).parts
    [pair] = parts.contact.pairs
    upper = np.isin(np.arange(len(parts.X)), pair.slave.all)
    found = []
    for way in np.linspace(-0.3, 0.3, 61):
        meeting = pair.at(parts.X + np.where(upper[:, None], np.eye(dim)[0] * way, 0.0))
        assert np.abs(meeting.shared.covered - 1).max() < 1e-9
        found.append(meeting.averages @ parts.X[:, -1])
    assert np.abs(np.diff(found, axis=0)).max() < 3e-3  # .02 of height, over .1 of the way


@pytest.mark.parametrize(("dim", "kind", "order"), [
    (2, None, 1), (2, "tri", 2), (3, None, 1), (3, "tet", 2),
])  # fmt: skip
def test_tangents_over_overlapping_masters_are_exact(dim, kind, order):
    check(overlapping(dim, 0.02, kind, order), 0.005, 3)


@pytest.mark.parametrize("dim", [2, 3])
def test_tangents_are_exact_where_what_is_cut_is_hardly_opposite_too(dim):
    """The block's underside is a roof whose sides lean by some 50 degrees."""
    model = overlapping(dim, 0.02)
    left, right, upper = model.bodies
    points = upper.mesh.points.copy()
    points[:, -1] += 1.2 * np.abs(points[:, 0] - 0.75)
    upper = am.Body(replace(upper.mesh, points=points), NEO, name="upper")
    model = am.Model([left, right, upper], model.supports, model.contacts)
    parts = large_deformation(model).parts
    shared = parts.meet(np.zeros(parts.X.shape)).parts[0].shared
    assert shared.cut is not None
    assert (shared.opposed[: len(shared.cut.share)][shared.cut.share < 1] < 1).any()
    check(model, 0.005, 3)


def check(model, size, least):
    """The tangent at random states against differences."""
    rng = np.random.default_rng(3)
    dofs = large_deformation(model).parts.X.size
    before = size * rng.standard_normal(dofs)
    problem = large_step(model, np.zeros(dofs), np.zeros(dofs), before)
    draws = (rng.standard_normal((2, problem.unknowns)) * [[size], [1.0]] for _ in range(12))
    assert checked_tangents(problem, draws) > least


@pytest.mark.parametrize(("contacts", "word"), [
    ([*two(mu=0.1)[:1], *two(mu=0.2)[1:]], "one contact with one law"),
    ([am.Contact("top.bottom", master="left.top", mu=0.1),
      am.Contact("top.bottom", am.Plane((0, 1), (0, -1)), mu=0.1)], "slave of two contacts"),
])  # fmt: skip
def test_nodes_of_two_laws_are_refused(contacts, word):
    with pytest.raises(am.UnsupportedForm, match=word):
        am.solve(table(contacts))


def test_more_masters_are_checked():
    with pytest.raises(am.InvalidInput, match="more_masters"):
        am.Contact("a", am.Plane((0, 1)), mu=0, more_masters=["b"])
    with pytest.raises(am.InvalidInput, match="every master once"):
        am.Contact("a", master="b", mu=0, more_masters=["b"])
    with pytest.raises(am.InvalidInput, match="surface 'nobody'"):
        table([am.Contact("top.bottom", master="left.top", mu=0, more_masters=["nobody"])])
    small = am.LinearElastic(1.0, 0.3)
    blocks = [am.Body(am.box((1, 1), 1, origin=(k, 0)), small, name=f"b{k}") for k in range(3)]
    with pytest.raises(am.UnsupportedForm, match="kinematics='finite'"):
        am.Model(blocks, [], [am.Contact("b0.top", master="b1.left", mu=0,
                                         more_masters=["b2.left"])])  # fmt: skip


# ----------------------------------------------------------------------------- chains
def chain(mu=0.2, swap=False, order=1, at=0.1):
    """A block on a second one, which leans on a third: a corner is master and slave."""
    parts = [body("top", (0.9, 1), (3, 2), (at, 0)),
             body("mid", (1, 1), (4, 3), (0, -1), order),
             body("wall", (0.5, 1.6), (2, 5), (1, -1.3))]
    held = [am.Fix("mid.bottom", (None, 0)), am.Fix("mid.left", (0.03, None)),
            am.Fix("wall.right", 0), am.Fix("top.top", (0, -0.08))]  # fmt: skip
    pairs = [am.Contact("top.bottom", master="mid.top", mu=mu),
             am.Contact("mid.right", master="wall.left", mu=mu)]
    return am.Model(parts, held, pairs[:: -1 if swap else 1])


def test_a_corner_that_is_slave_and_master():
    """Both pairs press with all that the supports bear; their order does not matter."""
    found = []
    for swap in (False, True):
        model = chain(swap=swap)
        solution = am.solve(model, tolerance=1e-11)
        parts = large_deformation(model).parts
        u = np.concatenate([np.asarray(each) for each in solution.displacement])
        pushed = parts.meet(u).columns(solution.fields.frames) @ solution.r.ravel()
        pushed = pushed.reshape(parts.X.shape)
        first, last = (len(model.bodies[k].mesh.points) for k in (0, 2))
        assert np.abs(pushed.sum(axis=0)).max() < 1e-12 * np.abs(pushed).sum()
        assert pushed[:first].sum(axis=0)[1] > 0.01
        assert pushed[-last:].sum(axis=0)[0] > 0.01
        top = np.sum(solution.fields.reaction[0], axis=0)
        np.testing.assert_allclose(top, -pushed[:first].sum(axis=0), atol=1e-9)
        found.append(u)
    np.testing.assert_allclose(found[0], found[1], atol=1e-9)


@pytest.mark.parametrize(("order", "at"), [(1, 0.1), (2, 0.1), (1, 0.67)])
def test_tangents_of_a_chain_are_exact(order, at):
    """The last one where a node of the first slave hangs over that corner, and fades."""
    check(chain(order=order, at=at), 0.01, 4)


def test_a_ring_is_refused():
    """Each is the slave of one contact and the master of the other, at one corner."""
    parts = [body("a", (1, 1), 2, (0, 0)), body("b", (1, 1), 2, (1, 0))]
    pairs = [am.Contact("a.right", master="b.left", mu=0),
             am.Contact("b.top", master="a.top", mu=0)]
    with pytest.raises(am.UnsupportedForm, match="ring"):
        am.solve(am.Model(parts, [am.Fix("a.left", 0), am.Fix("b.right", 0)], pairs))


def test_case_files_take_a_list():
    """master = [...] of a contact table; anything else in the list is told."""
    blocks = table([]).bodies
    given = {"slave": "top.bottom", "friction": {"coulomb": 0.1},
             "master": ["left.top", "right.top"]}  # fmt: skip
    contact = read_contact(Table("case.toml", "contact.1", given), blocks)
    assert contact.masters == ("left.top", "right.top")
    with pytest.raises(FileFormatError, match="list of texts"):
        read_contact(Table("case.toml", "c", given | {"master": ["left.top", 3]}), blocks)
