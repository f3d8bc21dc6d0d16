"""Audits of what other programs do otherwise: ties at points, means over a sector, CalculiX."""

from __future__ import annotations

import shutil
import subprocess
from dataclasses import replace

import pytest
from bar_deck import bar_deck, node
from click.testing import CliRunner

import amontons as am
from amontons.app.cli import main
from amontons.io.decks.written import write_deck
from amontons.mechanics.meshes import second_order

STEEL = am.LinearElastic(1000.0, 0.3)
CALCULIX = pytest.mark.skipif(shutil.which("ccx") is None, reason="CalculiX is not installed")


def stacked(
    origin=(2.3, 1.7), order=1, motion=(0.05, 0.0, -0.1), slave="high.bottom", **contact
) -> am.Model:
    """A block on a larger one, somewhere across its facets."""
    low = am.box((12, 10, 6), cells=(5, 4, 2))
    high = am.box((6, 5.5, 5), cells=(3, 3, 2), origin=(*origin, 6))
    bodies = [am.Body(mesh if order == 1 else second_order(mesh, serendipity=True), STEEL, name)
              for mesh, name in ((low, "low"), (high, "high"))]  # fmt: skip
    master = {"high.bottom": "low.top", "low.top": "high.bottom"}[slave]
    law = contact if contact.get("tied") else {"mu": 0.3} | contact
    return am.Model(bodies, [am.Fix("low.bottom", 0.0), am.Fix("high.top", motion)],
                    [am.Contact(slave, master=master, **law)])  # fmt: skip


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("slave", ["high.bottom", "low.top"])
@pytest.mark.parametrize("origin", [(2.3, 1.7), (2.2, 1.3), (1.4, 2.45)])
def test_forces_on_nodes_that_are_hardly_covered_count(origin, slave, order):
    """Facets at the rim are covered by slivers: their nodes carry forces, but no contact."""
    model = stacked(origin, order, slave=slave)
    found = am.audit(model, am.solve(model, tolerance=1e-10))
    assert found.verdict == "right", str(found)
    assert found.findings["balance"].numbers["between_sides"] < 1e-6
    pair = found.pairs[0].record
    assert pair["force"] == pytest.approx([-f for f in pair["master_force"]], rel=1e-6)


@pytest.mark.parametrize("motion", [(0.05, 0.0, 0.1), (0.05, 0.0, -0.1), (0.1, 0.0, 0.0)])
def test_a_tie_at_points_is_right_whatever_it_carries(motion):
    points = am.solve(stacked(motion=motion, tied=True, method="nodal"))
    means = stacked(motion=motion, tied=True)
    found = am.audit(means, points.displacement, digits=6)
    assert found.verdict == "right", str(found)
    loose = am.solve(stacked(motion=motion, mu=0.0), tolerance=1e-10)
    assert am.audit(means, loose.displacement).verdict == "wrong"


def ring(order: int) -> am.Model:
    """A ring shrunk onto a shaft, around the y axis."""
    shaft = am.box((6, 8), cells=(4, 5), origin=(4, 0))
    hub = am.box((6, 6), cells=(4, 4), origin=(10 - 0.012, 1))
    if order == 2:
        shaft, hub = (second_order(mesh, serendipity=True) for mesh in (shaft, hub))
    bodies = [am.Body(mesh.turned(), am.LinearElastic(210e3, 0.3), name)
              for mesh, name in ((shaft, "shaft"), (hub, "hub"))]  # fmt: skip
    return am.Model(
        bodies, [am.Fix("shaft.bottom", (None, 0.0)), am.Fix("hub.bottom", (None, 0.0))],
        [am.Contact("hub.left", master="shaft.right", mu=0.15)],
    )  # fmt: skip


@CALCULIX
@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("suffix", ["frd", "dat"])
def test_means_that_calculix_takes_over_its_sector_are_taken_back(order, suffix, tmp_path):
    found = audited_of_calculix(ring(order), tmp_path, suffix, penalty=1e9)
    right = {name for name, each in found.findings.items() if each.verdict.value == "right"}
    assert right >= {"balance", "penetration", "cone", "geometry", "time"}, str(found)
    assert found.findings["balance"].numbers["residual"] < 1e-3
    status = found.findings["status"]
    if order == 1:  # its facets are flat over the sector: closing makes points slip across
        assert status.verdict.value == "wrong" and "along them by 0.00021" in status.text


LAWS = {"mu": 0.3}, {"mu": 0.0}, {"tied": True}
CASES = [(order, law) for order in (1, 2) for law in LAWS if order == 1 or "mu" in law]


@CALCULIX
@pytest.mark.parametrize(("order", "law"), CASES)
def test_what_calculix_says_of_blocks_is_right(order, law, tmp_path):
    found = audited_of_calculix(stacked(order=order, **law), tmp_path, "frd", penalty=1e6)
    assert found.verdict == "right", str(found)


LOADED = ("*BOUNDARY\nBOT, 1, 3\n*STEP\n*STATIC\n1., 1.\n*CLOAD\n"
          "{1}, 1, {{0}}\n{5}, 3, -{{0}}\n*NODE FILE\nU\n*END STEP\n")  # fmt: skip


@CALCULIX
@pytest.mark.parametrize("kind", ["PLANE, {0}, {2}, {6}, {8}, {4}", "STRAIGHT, {0}, {2}, {1}",
                                  "BEAM, {3}, {8}"])  # fmt: skip
def test_constraints_that_turn_with_their_nodes_are_not_called_wrong(kind, tmp_path):
    """CalculiX takes NLGEOM with these *MPC; half the load is another answer, and wrong."""
    top = [node(i, j, 4, upper=True) for j in range(3) for i in range(3)]
    ties = f"*MPC\n{kind.format(*top)}\n"
    for name, size in (("model", 0.03), ("small", 0.02), ("far", 3.0)):
        text = bar_deck(ties, LOADED.format(*top).format(size))
        (tmp_path / f"{name}.inp").write_text(text)
        subprocess.run(["ccx", name], cwd=tmp_path, capture_output=True, check=True)
    found = am.audit(tmp_path / "model.inp", tmp_path / "model.frd")
    assert found.verdict == "right", str(found)
    assert am.audit(tmp_path / "model.inp", tmp_path / "small.frd").verdict == "wrong"
    far = am.audit(tmp_path / "far.inp", tmp_path / "far.frd")
    assert far.findings["balance"].verdict.value == "undecided"
    assert "turning" in far.findings["balance"].text


def audited_of_calculix(model: am.Model, folder, suffix: str, penalty: float) -> am.Audit:
    write_deck(model, folder / "model.inp", penalty=penalty)
    run = subprocess.run(["ccx", "model"], cwd=folder, capture_output=True, timeout=200)
    assert run.returncode == 0, run.stdout[-2000:]
    return am.audit(folder / "model.inp", folder / f"model.{suffix}")


def test_only_what_calculix_printed_is_taken_back(tmp_path):
    model = ring(2)
    solution = am.solve(model, tolerance=1e-10)
    assert am.audit(model, solution).is_right
    write_deck(model, tmp_path / "model.inp")
    for suffix in ("frd", "dat"):
        solution.write(tmp_path / f"model.{suffix}")
        found = am.audit(tmp_path / "model.inp", tmp_path / f"model.{suffix}")
        assert found.is_right, str(found)
        assert found.findings["balance"].numbers["residual"] < 2e-4  # .frd has six digits


def test_friction_that_is_missing_around_an_axis_is_missed():
    model = ring(1)
    smooth = am.solve(replace(model, contacts=(replace(model.contacts[0], mu=0.0),)))
    found = am.audit(model, smooth.displacement, digits=6)
    assert found.findings["status"].verdict.value == "wrong", str(found)


def test_what_only_pulls_is_not_right():
    """A bond that is judged as contact: nothing presses, and all pulls."""
    tied = am.solve(stacked(motion=(0.05, 0.0, 0.1), tied=True))
    found = am.audit(stacked(motion=(0.05, 0.0, 0.1)), tied.displacement)
    assert found.findings["cone"].verdict.value == "wrong"
    assert found.findings["cone"].numbers["tension"] == pytest.approx(1.0, abs=0.1)


@pytest.mark.parametrize("contact", [{"tied": True}, {"mu": 0.3}])
def test_a_body_that_is_stiffer_than_said_is_found_at_its_contact(contact):
    """All its forces are off by one factor: they balance within it, not across the contact."""
    motion = (0.05, 0.0, 0.1 if "tied" in contact else -0.1)
    solution = am.solve(stacked(motion=motion, **contact))
    low, high = solution.model.bodies
    stiffer = replace(high, material=am.LinearElastic(1050.0, 0.3))
    model = replace(solution.model, bodies=(low, stiffer))
    balance = am.audit(model, solution.displacement).findings["balance"]
    assert balance.verdict.value == "wrong" and "both sides" in balance.text
    assert balance.numbers["between_sides"] == pytest.approx(0.05, rel=0.2)


@CALCULIX
@pytest.mark.parametrize("slope", [5e2, 1e3])
def test_a_stick_slope_that_creeps_is_named_and_right_where_it_is_meant(slope, tmp_path):
    model = stacked(mu=0.3, stick_stiffness=slope)
    found = audited_of_calculix(model, tmp_path, "frd", penalty=1e5)
    status = found.findings["status"]
    assert status.verdict.value == "wrong" and "the deck's stick slope explains" in status.text
    own = am.audit(tmp_path / "model.inp", tmp_path / "model.frd", law="own")
    assert own.verdict == "right", str(own)


def of_calculix(model, tmp_path, penalty=None):
    """CalculiX' answer to the model as it was written: (deck, .frd)."""
    deck = tmp_path / "model.inp"
    write_deck(model, deck, penalty=penalty)
    subprocess.run(["ccx", "model"], cwd=tmp_path, capture_output=True, check=True, timeout=60)
    return deck, tmp_path / "model.frd"


def verdict_of(deck, frd):
    done = CliRunner().invoke(main, ["audit", str(deck), str(frd), "--law", "own"])
    assert done.exception is None or isinstance(done.exception, SystemExit), done.exception
    return done.output.splitlines()[0].rsplit(": ", 1)[1]


@CALCULIX
def test_decks_without_contact_are_audited(tmp_path):
    body = am.Body(am.box((3, 1, 1), (3, 1, 1)), STEEL)
    model = am.Model([body], [am.Fix("left", 0)], loads=[am.Traction("right", (0, 0, -1.0))])
    assert verdict_of(*of_calculix(model, tmp_path)) == "right"


@CALCULIX
def test_a_temperature_that_varies(tmp_path):
    """CalculiX takes its mean in each brick, and so does what we read of the deck."""
    body = am.Body(am.box((3, 1, 1), (3, 2, 2)), replace(STEEL, expansion=1e-4))
    model = am.Model([body], [am.Fix("left", 0)], loads=[am.Temperature(lambda x: 10 * x[2])])
    assert verdict_of(*of_calculix(model, tmp_path)) == "right"


@CALCULIX
def test_a_master_that_is_held_all_over(tmp_path):
    """Seen from the master there is no contact: no node of it moves."""
    body = am.Body(am.box((2, 1), (4, 2)), STEEL)
    model = am.Model([body], [am.Fix("left", (0, None)), am.Fix("top", (None, -0.01))],
                     [am.Contact("bottom", am.Plane((0, 1)), mu=0.0)])  # fmt: skip
    assert verdict_of(*of_calculix(model, tmp_path, penalty=5e4)) == "right"


@CALCULIX
def test_plane_stress_of_calculix_is_only_bounded(tmp_path):
    """Its cells are solids, which no law of ours has: what misses a little is not wrong."""
    law = replace(STEEL, plane="stress")
    lower = am.Body(am.box((3, 1), (7, 3)), law, "lower")
    upper = am.Body(am.box((1, 1), (4, 4), origin=(1, 1)), law, "upper")
    held = [am.Fix("lower.bottom", 0), am.Fix("upper.top", (0.003, -0.01))]
    model = am.Model([lower, upper], held,
                     [am.Contact("upper.bottom", master="lower.top", mu=0.2)])  # fmt: skip
    assert verdict_of(*of_calculix(model, tmp_path, penalty=5e4)) in ("right", "undecided")


@CALCULIX
def test_nodes_that_calculix_has_adjusted_are_those_of_the_deck(tmp_path):
    """Plane decks are matched by place: slave nodes were moved onto the master before."""
    low = am.Body(am.box((4, 2), (8, 4)), STEEL, "low")
    high = am.Body(am.box((2, 2), (5, 4), origin=(1, 2.02)), STEEL, "high")
    model = am.Model([low, high], [am.Fix("low.bottom", 0.0), am.Fix("high.top", (0.0, -0.01))],
                     [am.Contact("high.bottom", master="low.top", mu=0.3)])  # fmt: skip
    write_deck(model, tmp_path / "model.inp", penalty=1e6)
    text = (tmp_path / "model.inp").read_text()
    (tmp_path / "model.inp").write_text(text.replace("TO SURFACE", "TO SURFACE, ADJUST=0.03"))
    run = subprocess.run(["ccx", "model"], cwd=tmp_path, capture_output=True, timeout=200)
    assert run.returncode == 0, run.stdout[-2000:]
    found = am.audit(tmp_path / "model.inp", tmp_path / "model.frd")
    assert found.verdict == "right", str(found)
    assert int(found.pairs[0].seen[0].pressed.sum()) > 0
