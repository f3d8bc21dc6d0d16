"""Unkind contact between bodies: solved, checked against a truth, or named in one message."""

import json

import numpy as np
import pytest
from click.testing import CliRunner
from two_meshes import joined, write_gmsh

import amontons as am
from amontons.app.cli import main
from amontons.mechanics.meshes.facets import Cells

SOFT = am.LinearElastic(young=100, poisson=0.0)
METHODS = ["nodal", "mortar"]
BOTH = pytest.mark.parametrize("method", METHODS)
DIMS = pytest.mark.parametrize("d", [2, 3])
SOME = pytest.mark.parametrize(("d", "method"), [(2, "mortar"), (3, "nodal")])  # the dear ones


def up(d, z):
    return (0,) * (d - 1) + (z,)


def block(d, cells, place=0.0, size=1.0, shift=0.0):
    """A block of height 1 above `place`, of a given width, from `shift` on."""
    return am.box((size,) * (d - 1) + (1,), cells, origin=(shift,) * (d - 1) + (place,))


def two(d, method, high=None, low=None, mu=0.3, **parts):
    """Two blocks: the upper is held at its top, the lower at its bottom."""
    bodies = [am.Body(low or block(d, 3), SOFT, name="lower"),
              am.Body(high or block(d, 4, 1.0), SOFT, name="upper")]  # fmt: skip
    contact = am.Contact("upper.bottom", master="lower.top", mu=mu, method=method)
    supports = [am.Fix("lower.bottom", 0), am.Fix("upper.top", 0)]
    return am.Model(bodies, **({"supports": supports, "contacts": [contact]} | parts))


# ------------------------------------------------------------------- bodies apart
@SOME
@pytest.mark.parametrize("gap", [0.1, 50.0])
def test_bodies_that_do_not_touch_feel_nothing(d, method, gap):
    parts = [am.Fix("lower.bottom", 0), am.Fix("upper.top", up(d, -0.05))]
    found = am.solve(two(d, method, block(d, 4, 1 + gap), supports=parts))
    assert found.counts["open"] == len(found.r)
    assert not found.r.any()
    np.testing.assert_allclose(found.gap, gap - 0.05)
    np.testing.assert_allclose(found.displacement[1][:, -1], -0.05)


@BOTH
@DIMS
@pytest.mark.parametrize("place", [{"shift": 3.0}, {"place": -4.0}], ids=["beside", "behind"])
def test_bodies_that_do_not_face_each_other_are_named(d, method, place):
    model = two(d, method, block(d, 4, **({"place": 1.0} | place)))
    where = r"'bottom' reaches from \(.*\) to \(.*\), 'top' reaches from \(0, "
    with pytest.raises(am.InvalidInput, match=rf"no part of the slave .* {where}.*check the"):
        model.assemble()


# ------------------------------------------------------------------- deep overlaps
@BOTH
@DIMS
@pytest.mark.parametrize("overlap", [0.3, 0.8])
def test_blocks_that_overlap_by_more_than_an_element_are_pushed_apart(d, method, overlap):
    """Two bars of length 1, held at their ends: the stress is E overlap / 2."""
    found = am.solve(two(d, method, block(d, 4, 1 - overlap)))
    exact = 100 * overlap / 2
    assert found.counts["open"] == 0
    assert found.force[:, -1].sum() == pytest.approx(exact, rel=2e-3)  # nodal: 1.6e-3
    if method == "mortar":
        np.testing.assert_allclose(found.pressure, exact, rtol=1e-8)


def punch(d, method, depth):
    """A round foot pressed deep into a block, in one mesh or in two."""
    low = am.box((2,) * d, (16 if d == 2 else 8,) * d, origin=(-1,) * (d - 1) + (-2,))
    high = am.box((1,) * d, (12 if d == 2 else 6,) * d, origin=(-0.5,) * (d - 1) + (0,))
    points = high.points.copy()
    radius = (points[:, :-1] ** 2).sum(axis=1)
    points[:, -1] += (1 - points[:, -1]) * 0.8 * radius - depth
    return low, am.Mesh(points, high.cells, high.surfaces)


@DIMS
@pytest.mark.parametrize("depth", [0.3])
def test_no_node_is_lost_in_a_deep_round_overlap(d, depth):
    """Nodal and mortar contact agree on the force; a lost node would halve it."""
    low, high = punch(d, "nodal", depth)
    nodal, mortar = (am.solve(two(d, m, high, low)) for m in METHODS)
    assert len(nodal.r) == len(high.surface_nodes("bottom"))
    assert nodal.resultant[-1] == pytest.approx(mortar.resultant[-1], rel=0.08)
    one = am.Model(
        [am.Body(joined(low, high), SOFT)],
        [am.Fix("floor", 0), am.Fix("roof", 0)],
        [am.Contact("high", master="low", mu=0.3, method="nodal")],
    )
    np.testing.assert_allclose(am.solve(one).force, nodal.force, atol=1e-6)


@BOTH
@DIMS
def test_the_whole_boundary_of_a_body_may_be_the_master(d, method):
    """Its sides, flush with those of the slave, do not face it, whatever rounding says."""
    low = block(d, 3)
    low = am.Mesh(low.points, low.cells, low.surfaces | {"skin": low.boundary})
    for overlap in (0.1, 0.5):
        high = block(d, 4, 1 - overlap)
        high = am.Mesh(high.points, high.cells, high.surfaces | {"all": high.boundary})
        for slave in ("upper.bottom", "all") if method == "nodal" else ("upper.bottom",):
            contact = am.Contact(slave, master="skin", mu=0.3, method=method)
            found = am.solve(two(d, method, high, low, contacts=[contact]))
            assert len(found.r) == 5 ** (d - 1)
            assert found.force[:, -1].sum() == pytest.approx(50 * overlap, rel=2e-3)


# ------------------------------------------------------------------- self-contact
@BOTH
@DIMS
def test_a_surface_is_not_its_own_master(d, method):
    mesh = joined(block(d, 3), block(d, 4, 1.0))
    mesh = am.Mesh(mesh.points, mesh.cells, mesh.surfaces | {"skin": mesh.boundary})
    for slave in ("skin", "high"):
        contact = am.Contact(slave, master="skin", mu=0.3, method=method)
        model = am.Model([am.Body(mesh, SOFT)], [am.Fix("floor", 0)], [contact])
        with pytest.raises(am.InvalidInput, match="facets are on both sides.*own master"):
            model.assemble()


@BOTH
@DIMS
def test_sides_of_one_block_do_not_meet_through_it(d, method):
    for slave, master in (("bottom", "top"), ("bottom", "left")):
        contact = am.Contact(slave, master=master, mu=0.3, method=method)
        model = am.Model([am.Body(block(d, 3), SOFT)], [am.Fix("right", 0)], [contact])
        with pytest.raises(am.InvalidInput, match="no part of the slave"):
            model.assemble()


@BOTH
@DIMS
@pytest.mark.parametrize("overlap", [0.02, 0.4])
def test_parts_of_one_body_press_each_other(d, method, overlap):
    mesh = joined(block(d, 3), block(d, 4, 1 - overlap))
    for slave, master in (("high", "low"), ("low", "high")):
        contact = am.Contact(slave, master=master, mu=0.3, method=method)
        supports = [am.Fix("floor", 0), am.Fix("roof", 0)]
        found = am.solve(am.Model([am.Body(mesh, SOFT)], supports, [contact]))
        size = abs(found.force[:, -1].sum())
        assert size == pytest.approx(50 * overlap, rel=1e-2 if method == "nodal" else 1e-8)


@BOTH
@DIMS
def test_pairs_count_once(d, method):
    model = two(d, method)
    (first,) = model.contacts
    exchanged = am.Contact("lower.top", master="upper.bottom", mu=0.3, method=method)
    for second, text in ((first, "points have a contact"), (exchanged, "exchanged")):
        both = two(d, method, contacts=[first, second])
        with pytest.raises(am.InvalidInput, match=f"{text}.*every pair once"):
            both.assemble()
    plane = am.Contact("lower.bottom", am.Plane(up(d, 1)), mu=0.3, method=method)
    with pytest.raises(am.InvalidInput, match="with the same obstacle already"):
        two(d, method, contacts=[first, plane, plane], supports=[]).assemble()


@DIMS
def test_parts_of_a_pair_may_differ_in_friction(d):
    parts = [
        am.Contact("upper.bottom", master="lower.top", mu=mu, where=where)
        for mu, where in ((0.1, lambda x: x[:, 0] < 0.4), (0.5, lambda x: x[:, 0] >= 0.4))
    ]
    found = am.solve(two(d, "nodal", block(d, 4, 0.98), contacts=parts))
    assert len(found.r) == 5 ** (d - 1)


# ------------------------------------------------------------------- meshes
@DIMS
@pytest.mark.parametrize("turn", [0, 1])
def test_repeated_cells_are_refused(d, turn):
    mesh = block(d, 2)
    nodes = mesh.cells[0].nodes
    again = nodes[1:2].copy()
    if turn:
        again = again[:, ::-1] if d == 2 else again[:, [4, 5, 6, 7, 0, 1, 2, 3]]
    cells = (Cells(mesh.cells[0].kind, nodes), Cells(mesh.cells[0].kind, again, "other"))
    with pytest.raises(am.InvalidInput, match="two cells near .* have the same nodes"):
        am.Mesh(mesh.points, cells, mesh.surfaces)


@DIMS
def test_inverted_cells_are_turned(d):
    mesh, mirrored = block(d, 3), block(d, 3).points.copy()
    mirrored[:, 0] *= -1  # every cell is inside out, left and right stay names
    other = am.Mesh(mirrored, mesh.cells, mesh.surfaces)
    kwargs = {"low": other, "high": block(d, 4, 0.98, shift=0.0)}
    high = kwargs["high"].points.copy()
    high[:, 0] *= -1
    kwargs["high"] = am.Mesh(high, kwargs["high"].cells, kwargs["high"].surfaces)
    found = am.solve(two(d, "mortar", **kwargs))
    np.testing.assert_allclose(found.pressure, 1, rtol=1e-8)


@DIMS
def test_cells_without_volume_are_named(d):
    mesh = block(d, 2)
    with pytest.raises(am.InvalidInput, match=r"degenerate \(no volume\); .* expected none"):
        am.Mesh(mesh.points * up(d, 0) + 0.0, mesh.cells, mesh.surfaces)


@BOTH
@DIMS
def test_empty_surfaces_are_named(d, method):
    mesh = block(d, 2)
    mesh = am.Mesh(mesh.points, mesh.cells, mesh.surfaces | {"none": ()})
    for contact in (
        am.Contact("none", master="top", mu=0.3, method=method),
        am.Contact("bottom", master="none", mu=0.3, method=method),
        am.Contact("none", am.Plane(up(d, 1)), mu=0.3, method=method),
    ):
        with pytest.raises(am.InvalidInput, match="surface 'none': holds no facets"):
            am.Model([am.Body(mesh, SOFT)], [am.Fix("right", 0)], [contact])


# ------------------------------------------------------------------- supports
@SOME
def test_a_body_that_contact_presses_down_is_solved(d, method):
    load = am.Traction("upper.top", up(d, -1))
    model = two(d, method, supports=[am.Fix("lower.bottom", 0)], loads=[load])
    found = am.solve(model)
    np.testing.assert_allclose(found.resultant, up(d, 1), atol=1e-8)
    assert found.pressure.min() > 0.8


@SOME
def test_without_load_a_loose_body_rests(d, method):
    found = am.solve(two(d, method, supports=[am.Fix("lower.bottom", 0)]))
    assert not found.r.any()


@BOTH
@DIMS
def test_bodies_that_nothing_holds_are_named_with_their_motions(d, method):
    load = am.Traction("upper.top", up(d, -1))
    slides = "translation along x" + (
        ", translation along y, rotation about z" if d == 3 else ""
    )
    text = f"'upper' is free to move: {slides}; hold it with a support"
    with pytest.raises(am.SingularOperator, match=text):
        two(d, method, mu=0, supports=[am.Fix("lower.bottom", 0)], loads=[load]).assemble()
    with pytest.raises(am.SingularOperator, match="'lower' is free.*'upper' is free"):
        two(d, method, supports=[], loads=[load]).assemble()


@SOME
@pytest.mark.parametrize(
    ("pull", "motion"),
    [(up, "translation along {}"), (lambda d, z: (0.6, *up(d - 1, -1)), "along x with")],
    ids=["lifted", "dragged"],
)
def test_loads_that_contact_can_not_balance_are_proved(d, method, pull, motion):
    load = am.Traction("upper.top", pull(d, 1))
    model = two(d, method, supports=[am.Fix("lower.bottom", 0)], loads=[load])
    with pytest.raises(am.NotConverged) as caught:
        am.solve(model, max_iterations=10)
    detail = caught.value.solution.convergence.detail
    assert "there is no solution, no contact forces balance the loads" in detail
    assert f"'upper' gives way by translation {motion.format('xyz'[d - 1])[12:]}" in detail


@DIMS
@pytest.mark.parametrize(("law", "limit"), [("mu", 0.3), ("tresca", 0.3)])
def test_the_proof_knows_the_limit_of_friction(d, law, limit):
    """A slab under its weight 1 per area, pushed sideways with 0.98 and 1.02 of the limit."""
    body = am.Body(am.box((2,) * (d - 1) + (1,), (4,) * (d - 1) + (2,)), SOFT)
    contact = am.Contact("bottom", am.Plane(up(d, 1)), **{law: limit})
    for share, proved in ((0.98, False), (1.02, True)):
        load = am.BodyForce((share * limit, *up(d - 1, -1)))
        text = str(am.Model([body], [], [contact], [load]).imbalance())
        assert text.startswith("there is no solution") == proved


def squeezed(d, method, weight):
    """A block between two others that press it, held by friction only."""
    meshes = (am.box((1,) * d, n, origin=(k, *(0,) * (d - 1))) for k, n in enumerate((3, 4, 3)))
    bodies = [am.Body(mesh, SOFT, name=name) for mesh, name in zip(meshes, "abc", strict=True)]
    sides = (("b.left", "a.right"), ("b.right", "c.left"))
    contacts = [am.Contact(a, master=b, mu=0.3, method=method) for a, b in sides]
    supports = [am.Fix("a.left", 0), am.Fix("c.right", (-0.3, *(0,) * (d - 1)))]
    return am.Model(bodies, supports, contacts, [am.BodyForce(up(d, -weight), region=None)])


@SOME
def test_a_body_held_by_friction_only(d, method):
    """Two contacts of force 10 and friction 0.3 carry a weight of 6 at most."""
    found = am.solve(squeezed(d, method, 1.0))
    np.testing.assert_allclose(found.force[:, 0].sum(), 0, atol=1e-8)
    np.testing.assert_allclose(found.force.sum(axis=0), up(d, 1), atol=1e-8)
    with pytest.raises(am.NotConverged, match="friction alone hold body 'b'"):
        am.solve(squeezed(d, method, 20.0), max_iterations=10)


@BOTH
@DIMS
@pytest.mark.parametrize("width", [0.1, 0.4])
def test_a_master_smaller_than_the_slave(d, method, width):
    """Forces balance, and what passes is the stiffness of the thin column, to first order."""
    column = block(d, 3, size=width, shift=0.5 - width / 2)
    found = am.solve(two(d, method, block(d, 2, 0.98), column))
    assert found.counts["open"] < len(found.r)
    area = width ** (d - 1)
    assert 0.2 * area < found.resultant[-1] < 2.1 * area  # of 2 if the block were rigid


@SOME
def test_contact_shares_nodes_with_supports(d, method):
    """The side of the upper block pushes it down; reactions balance what it carries."""
    supports = [am.Fix("lower.bottom", 0), am.Fix("upper.left", up(d, -0.05))]
    model = two(d, method, supports=supports)
    found = am.solve(model)
    assert found.counts["open"] < len(found.r)
    assert found.gap.min() > -1e-8
    for foot in ("lower.top", "upper.bottom"):
        rest = "upper.top" if foot == "lower.top" else "lower.bottom"
        held = [am.Fix(foot, 0), am.Fix(rest, up(d, -0.02 if rest == "upper.top" else 0.02))]
        found = am.solve(two(d, method, supports=held))
        assert found.force[:, -1].sum() == pytest.approx(2.0, rel=1e-6)
    both = [am.Fix("lower.top", 0), am.Fix("upper.bottom", up(d, 0.05))]
    with pytest.raises(am.InvalidInput, match="every slave node is fixed by a support"):
        two(d, method, supports=both).assemble()
    both[1] = am.Fix("upper.bottom", up(d, -0.05))
    with pytest.raises(am.InvalidInput, match=r"supports hold the node .* push it 0\.05 into"):
        two(d, method, supports=both).assemble()


# ------------------------------------------------------------------- case files
CASE = """
[mesh]
file = "two.msh"
[material.default]
young = 100.0
poisson = 0.0
[[fix]]
on = "floor"
value = {zero}
[[fix]]
on = "roof"
value = {zero}
[[contact]]
slave = "high"
master = "low"
friction = {{ coulomb = 0.3 }}
method = "{method}"
"""
def run_case(folder, mesh, method, *changes, repeat=False):
    """Exit code, what is said on stderr, and the result or None."""
    write_gmsh(folder / "two.msh", mesh, repeat=repeat)
    text = CASE.format(zero=[0.0] * mesh.dim, method=method)
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    (folder / "case.toml").write_text(text)
    out = folder / "out"
    result = CliRunner().invoke(
        main,
        [
            "solve",
            str(folder / "case.toml"),
            "-o",
            str(out),
            "--quiet",
            "--max-iterations",
            "99",
        ],
    )
    assert result.exception is None or isinstance(result.exception, SystemExit)
    assert "Traceback" not in result.output
    saved = out / "solution.json"
    return result.exit_code, result.stderr, (
        json.loads(saved.read_text()) if saved.exists() else None
    )  # fmt: skip


FREE_TOP = ('on = "roof"', 'on = "floor"')


@SOME
def test_case_files_with_deep_overlaps_and_open_gaps(tmp_path, d, method):
    code, _, found = run_case(tmp_path, joined(block(d, 3), block(d, 4, 0.6)), method)
    assert code == 0
    assert found["resultant"][-1] == pytest.approx(20, rel=2e-3)
    code, _, found = run_case(tmp_path, joined(block(d, 3), block(d, 4, 1.5)), method)
    assert code == 0
    assert found["contacts"]["open"] == found["contacts"]["total"]


@SOME
@pytest.mark.parametrize(
    ("place", "changes", "words"),
    [
        ({"shift": 3.0}, [], ["contact[0].master", "no part of the slave"]),
        ({}, [('master = "low"', 'master = "high"')], ["contact[0].master", "own master"]),
        ({}, [('slave = "high"', 'slave = "roof"')], ["contact[0].master", "no part of"]),
        ({}, [('slave = "high"', 'slave = "hihg"')], ["contact[0].slave", "mean 'high'"]),
        ({}, [("coulomb = 0.3", "coulomb = 0.0"), FREE_TOP], ["fix", "free to move"]),
    ],
    ids=["apart", "own master", "wrong side", "unknown", "loose"],
)
def test_case_files_with_one_clear_message(tmp_path, d, method, place, changes, words):
    mesh = joined(block(d, 3), block(d, 4, **({"place": 1.0} | place)))
    code, said, found = run_case(tmp_path, mesh, method, *changes)
    assert code == 2
    assert found is None
    for word in [*words, "case.toml"]:
        assert word in said


@DIMS
def test_case_files_with_pairs_or_cells_that_are_there_twice(tmp_path, d):
    mesh = joined(block(d, 3), block(d, 4, 1.0))
    pair = (
        '[[contact]]\nmaster = "high"\nslave = "low"\nfriction = { coulomb = 0.3 }\n[[contact]]'
    )
    code, said, _ = run_case(tmp_path, mesh, "mortar", ("[[contact]]", pair))
    assert code == 2
    assert "every pair once" in said
    code, _, found = run_case(tmp_path, mesh, "mortar", repeat=True)
    assert code == 0  # files of gmsh 2.2 may name a cell in several groups: it counts once
    assert not found["contacts"]["stick"]


@SOME
def test_case_files_whose_loads_can_not_be_balanced(tmp_path, d, method):
    load = f'[[traction]]\non = "roof"\nvalue = {[*up(d, 1)]}\n[[contact]]'
    mesh = joined(block(d, 3), block(d, 4, 1.0))
    code, said, found = run_case(tmp_path, mesh, method, FREE_TOP, ("[[contact]]", load))
    assert code == 1
    assert "there is no solution" in said
    assert "(part 2 of 2)' gives way" in said
    assert found["outcome"] != "converged"


@pytest.mark.parametrize("share", [0.9, 0.97, -0.99])
@pytest.mark.parametrize("size", [(2.0, 1.0), (1.0, 1.0)])
def test_a_block_that_friction_just_holds(size, share):
    """Newton's branches leave no stiffness against sliding; a solution exists all the same."""
    mu, load = 0.2, np.array([0.2 * share, -1.0])
    body = am.Body(am.box(size, cells=(8, 4)), am.LinearElastic(young=2e3, poisson=0.3))
    model = am.Model(
        [body],
        loads=[am.Traction("top", load)],
        contacts=[am.Contact("bottom", am.Plane(normal=(0, 1)), mu=mu)],
    )
    found = am.solve(model)
    np.testing.assert_allclose(found.resultant, -load * size[0], rtol=1e-6)
    r = found.solution.r
    assert (np.abs(r[:, 1]) <= mu * r[:, 0] * (1 + 1e-6) + 1e-9).all()
    moment = (found.fields.points - [size[0] / 2, 0.0])[:, 0] @ r[:, 0]
    assert moment == pytest.approx(load[0] * size[0] * size[1], rel=1e-5)


@SOME
def test_an_obstacle_behind_the_slave_is_named(d, method):
    """A normal turned the wrong way left all contacts open without a word."""

    def on(normal, surface="bottom"):
        model = am.Model(
            [am.Body(block(d, 2), SOFT)],
            [am.Fix("top", up(d, -0.1))],
            [am.Contact(surface, am.Plane(normal), mu=0.3, method=method)],
        )
        return am.solve(model, tolerance=1e-8)

    assert on(up(d, 1.0)).resultant[-1] > 1
    for wrong in (up(d, -1.0), (1.0, *up(d - 1, -0.5))):
        with pytest.raises(am.InvalidInput, match="no facet of it faces the obstacle"):
            on(wrong)
    on((1.0, *up(d - 1, 0.0)))  # at right angles: an edge of the slave may touch
