"""Walls: geometry, contacts between touching faces only, full rank of H, statics."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest

import amontons as am
from amontons.mechanics.ready.walls import Bond, Wall

STONE = am.LinearElastic(young=2.2e9, poisson=0.2, density=2000)
SIZES = {2: ((0.4, 0.2), (4, 2)), 3: ((0.4, 0.2, 0.2), (4, 2, 2))}


def wall(bond=Bond.RUNNING, dim=3, rows=3, blocks=2, **changes):
    size, cells = SIZES[dim]
    options = {"size": size, "cells": cells, "material": STONE, "bond": bond, "plate": 0.1}
    return Wall(rows, blocks, **(options | changes))


def sheared(made):
    down = (0,) * (len(made.size) - 1) + (-1e5,)
    return made.sheared(down, (1e-4,) + (0,) * (len(made.size) - 2) + (None,))


@pytest.mark.parametrize(
    ("bond", "blocks"),
    [(Bond.STACK, [2, 2, 2]), (Bond.RUNNING, [2, 3, 2]), (Bond.TOOTHED, [2, 2, 2])],
)
def test_rows_of_a_bond(bond, blocks):
    made = wall(bond)
    assert [len(spans) for spans in made.spans] == blocks
    names = [body.name for body in made.bodies]
    assert names[-1] == "plate"
    assert len(names) == sum(blocks) + 1
    volume = sum(np.ptp(b.mesh.points, axis=0).prod() for b in made.bodies[:-1])
    assert volume == pytest.approx(6 * 0.4 * 0.2 * 0.2)
    assert made.height == pytest.approx(0.6)
    assert np.ptp(made.bodies[-1].mesh.points[:, 0]) == pytest.approx(0.8)


@pytest.mark.parametrize("bond", Bond)
@pytest.mark.parametrize("dim", [2, 3])
def test_h_has_full_column_rank_and_is_well_conditioned(bond, dim):
    model = sheared(wall(bond, dim))
    problem = model.discretisation
    H = problem.H.toarray()
    values = np.linalg.svd(H, compute_uv=False)
    assert H.shape[1] < H.shape[0]
    assert values[-1] > 0.3
    assert values[0] < 3
    np.testing.assert_allclose(problem.gap, 0, atol=1e-12)


def test_every_node_is_the_slave_of_one_contact_at_most():
    model = sheared(wall())
    pairs = [(p.body, node) for p in model.discretisation.placed for node in p.rows.nodes]
    assert len(set(pairs)) == len(pairs)


@pytest.mark.parametrize("bond", Bond)
def test_all_touching_nodes_meet_something(bond):
    """Every node of a lower face that lies on a face of the row below has a contact."""
    made = wall(bond)
    model = sheared(made)
    for k, body in enumerate(model.bodies):
        nodes = body.mesh.surface_nodes("bottom")
        row = round(body.mesh.points[nodes[0], 2] / 0.2)
        x = body.mesh.points[nodes, 0]
        if row:
            below = made.spans[row - 1]
            on = (x >= below[0][0] - 1e-9) & (x <= below[-1][1] + 1e-9)
        else:
            on = np.ones(len(x), dtype=bool)
        met = [p.rows.nodes for p in model.discretisation.placed if p.body == k]
        assert set(nodes[on]) <= set(np.concatenate(met))


def between_supports(**changes):
    """Three rows of three and a half blocks between two rigid supports."""
    options = {"size": (0.4, 0.2, 0.2), "cells": (8, 4, 4), "bond": Bond.ALTERNATING,
               "plate": 0.05, "base": 0.05, "plate_material": am.Rigid(7800)}  # fmt: skip
    return Wall(3, 3, material=STONE, **(options | changes))


def test_the_wall_of_the_paper_has_its_nodes_and_unknowns():
    """12 blocks of 2400 nodes, two rigid supports of 6 unknowns: 7212 as printed."""
    made = between_supports()
    names = [body.name for body in made.bodies]
    assert names[0] == "base"
    assert names[-1] == "plate"
    assert sum(len(body.mesh.points) for body in made.bodies[1:-1]) == 2400
    assert [[round(b - a, 9) for a, b in row] for row in made.spans] == [
        [0.2, 0.4, 0.4, 0.4], [0.4, 0.4, 0.4, 0.2], [0.2, 0.4, 0.4, 0.4],
    ]  # fmt: skip
    model = sheared(made)
    assert model.discretisation.H.shape == (7212, 3 * 805)
    assert sorted(set(model.law.coefficient)) == [0.53, 0.83]


@pytest.mark.parametrize("dim", [2, 3])
def test_h_between_rigid_supports_has_full_column_rank_too(dim):
    size, cells = SIZES[dim]
    model = sheared(between_supports(size=size, cells=cells))
    values = np.linalg.svd(model.discretisation.H.toarray(), compute_uv=False)
    assert values[-1] > 0.3
    pairs = [(p.body, node) for p in model.discretisation.placed for node in p.rows.nodes]
    assert len(set(pairs)) == len(pairs)


@pytest.mark.parametrize("dim", [2, 3])
def test_a_rigid_wall_has_the_same_contacts_and_few_unknowns(dim):
    size, cells = SIZES[dim]
    elastic = sheared(between_supports(size=size, cells=cells)).discretisation
    rigid = sheared(between_supports(size=size, cells=cells, rigid=True)).discretisation
    assert rigid.H.shape == (14 * (3 if dim == 2 else 6), elastic.H.shape[1])
    driven = int(rigid.eliminated.driven.sum())
    assert np.linalg.matrix_rank(rigid.H.toarray()) == rigid.H.shape[0] - driven


def test_a_rigid_wall_carries_its_load():
    size, cells = SIZES[2]
    made = between_supports(size=size, cells=cells, rigid=True)
    model = made.sheared((0, -1e4), lambda x, t: (1e-4 * t, None))
    steps = list(am.evolve(model, am.MoreauJean(step=0.01, theta=1, reach=1e-6), until=0.1))
    floor = [k for k, c in enumerate(model.contacts) if c.master == "base.top"]
    assert steps[-1].resultant(floor)[1] == pytest.approx(1e4 * 1.4, rel=1e-6)
    assert steps[-1].gap.min() > -1e-9


@pytest.mark.parametrize("bond", [Bond.STACK, Bond.RUNNING])
def test_the_floor_carries_weight_and_pressure(bond):
    """Dynamics with much damping comes to rest: the floor carries everything."""
    made = wall(bond, dim=2)
    pressure, density = 1e4, 2000
    model = made.model(
        [am.Fix("plate.top", (0, None))],
        [am.Traction("plate.top", (0, -pressure)), am.BodyForce((0, -density * 9.81))],
    )
    method = am.MoreauJean(step=0.02, theta=1)
    last = list(am.evolve(model, method, until=0.4))[-1]
    floor = [k for k, c in enumerate(model.contacts) if c.obstacle is not None]
    weight = density * 9.81 * 0.8 * (0.6 + 0.1)
    np.testing.assert_allclose(last.resultant(floor)[1], weight + pressure * 0.8, rtol=1e-3)
    assert last.energies.kinetic < 1e-4 * last.energies.elastic


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"rows": 0}, "rows: expected a whole number"),
        ({"blocks": 1.5}, "blocks: expected a whole number"),
        ({"bond": "running"}, "bond: expected a Bond"),
        ({"size": (1,)}, "size, cells: expected 2 or 3"),
        ({"cells": (3, 2, 2)}, "even number along the length"),
        ({"plate": -1}, "plate: expected a height"),
        ({"base": -1}, "base: expected a height"),
        ({"bond": Bond.ALTERNATING, "rows": 1, "cells": (3, 2, 2)}, "even number along"),
    ],
)
def test_bad_walls_are_named(changes, words):
    with pytest.raises(am.InvalidInput, match=words):
        wall(**changes)


def test_a_wall_without_plate_is_not_sheared():
    with pytest.raises(am.InvalidInput, match="nothing to load"):
        sheared(wall(plate=0.0))
    assert len(wall(plate=0.0).bodies) == 7


def test_where_must_answer_for_every_point():
    body = am.Body(am.box((1, 1), 2), STONE)
    contact = am.Contact("bottom", am.Plane((0, 1)), mu=0.3, where=lambda x: x)
    model = am.Model([body], [am.Fix("top", 0)], [contact])
    with pytest.raises(am.InvalidInput, match="where to return"):
        model.assemble()
    none = am.Contact("bottom", am.Plane((0, 1)), mu=0.3, where=lambda x: x[:, 0] > 40)
    words = r"'bottom': where: .* from \[0, 0\] to \[1, 0\]"
    with pytest.raises(am.InvalidInput, match=words) as told:
        am.Model([body], [am.Fix("top", 0)], [none]).assemble()
    assert told.value.at == ("contacts", 0, "where")
    half = am.Contact("bottom", am.Plane((0, 1)), mu=0.3, where=lambda x: x[:, 0] > 0.4)
    assert am.Model([body], [am.Fix("top", 0)], [half]).assemble().contacts == 2


def test_the_script_of_the_wall_runs(capsys):
    path = Path(__file__).resolve().parents[3] / "examples" / "wall" / "wall.py"
    spec = importlib.util.spec_from_file_location("wall", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    small = module.paper_wall(cells=(2, 1, 1), rows=3)
    steps = list(am.evolve(small, am.MoreauJean(step=2e-2, theta=1, reach=1e-5), until=0.4))
    for step in steps:
        e = step.energies
        assert e.contact <= 1e-8 * (e.total + e.turnover)  # the tolerance
        assert abs(e.defect) <= 1e-8 * (e.total + e.turnover)
    floor = [k for k, c in enumerate(small.contacts) if c.master == "base.top"]
    down = 3e4 * (0.1 + 0.9 * 0.3 / 4)
    np.testing.assert_allclose(steps[-1].resultant(floor)[2], down, rtol=0.02)
    assert steps[-1].resultant(floor)[0] < 0  # against the shear
    module.main(steps=1)
    assert "shear force" in capsys.readouterr().out


def struck(push, until):
    """Steps of a wall of three rows, half blocks in the second, hit by the velocity push y."""
    stone = am.LinearElastic(1e8, 0.2, plane="stress", density=2000.0)
    wall = am.Wall(3, 1, (1.0, 0.5), (2, 1), stone, corotational=True, mu=0.7, mu_support=0.7)
    model = wall.model([], [am.BodyForce((0, -2000 * 9.81))])
    start = am.at_rest(model, velocity=lambda x: (push * x[1], 0.0))
    return list(am.evolve(model, am.MoreauJean(8e-3, stiffness_damping=2e-3), until=until,
                          start=start))  # fmt: skip


@pytest.mark.parametrize(("push", "falls"), [(0.8, False), (4.0, True)])
def test_a_wall_of_blocks_that_turn_rocks_or_topples(push, falls):
    """As one stiff block of its outline, which turns about its foot, it falls from 2.4 on."""
    steps = struck(push, 0.32)
    way = np.array([step.displacement[-1][-1] for step in steps])
    books = max(abs(step.energies.defect) for step in steps)
    kinetic = 0.5 * 2000 * push**2 * 1.5**3 / 3
    assert books < 1e-10 * kinetic
    assert max(step.energies.contact for step in steps) < 1e-7 * kinetic
    if falls:
        assert way[-1, 1] < -0.4
        assert way[-1, 0] > 1.0
    else:
        assert way[:, 0].max() < 0.2
        assert way[-1, 0] < 0.6 * way[:, 0].max()  # on its way back
        assert min(step.gap.min() for step in steps) > -5e-3


@pytest.mark.parametrize("bond", [Bond.RUNNING, Bond.TOOTHED])
def test_a_wall_of_blocks_that_turn_stands(bond):
    """The floor bears its weight after a while, within the waves that damping has left."""
    stone = am.LinearElastic(1e7, 0.2, plane="stress", density=2000.0)
    wall = am.Wall(2, 2, (1.0, 0.5), (2, 1), stone, bond=bond, corotational=True)
    model = wall.model([], [am.BodyForce((0, -2e4))])
    *_, step = am.evolve(model, am.MoreauJean(4e-3, stiffness_damping=4e-3), until=0.1)
    floor = [pair.force for name, pair in step.pairs.items()
             if name.startswith("row 1") and name.endswith("bottom")]  # fmt: skip
    area = 0.5 * sum(right - left for row in wall.spans for left, right in row)
    assert sum(floor)[1] == pytest.approx(2e4 * area, rel=0.1)


def test_rigid_blocks_do_not_turn_in_frames():
    stone = am.LinearElastic(1e7, 0.2, density=2000.0)
    with pytest.raises(am.InvalidInput, match="blocks that turn are elastic"):
        am.Wall(2, 2, (1.0, 0.5), (2, 1), stone, rigid=True, corotational=True)
