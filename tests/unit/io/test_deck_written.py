"""Decks that are written: what is read back, and what CalculiX makes of them."""

import shutil
import subprocess
from dataclasses import replace

import numpy as np
import pytest
from click.testing import CliRunner

import amontons as am
from amontons.app.cli import main
from amontons.core.errors import InvalidInput
from amontons.io.answers.frd import read_frd
from amontons.io.readers import read_case

E, LOAD = 1000.0, 5.0


def block(size=(1.0, 1.0), *, order=1, mu=0.0, material=None, loads=None, **law):
    """A block of height 1 on the plane y = 0 (z = 0), held sideways."""
    dim = len(size)
    mesh = am.box(size, cells=2, kind="tri" if order == 2 else None)
    up = (0.0,) * (dim - 1) + (1.0,)
    sides = [am.Fix("left", (0.0, *(None,) * (dim - 1)))]
    sides += [am.Fix("front", (None, 0.0, None))] if dim == 3 else []
    material = material or am.LinearElastic(E, 0.0)
    return am.Model(
        [am.Body(mesh, material, "block", order=order)], sides,
        [am.Contact("bottom", obstacle=am.Plane(up), mu=mu, **law)],
        loads or [am.Pressure("top", LOAD)], name="a block",
    )  # fmt: skip


def stacked(**law):
    """A block on another one, whose mesh is another."""
    lower = am.box((2.0, 1.0), cells=(3, 2), origin=(-0.5, -1.0))
    upper = am.box((1.0, 1.0), cells=(2, 2))
    soft = am.OrthotropicElastic((900.0, 1100.0, 1000.0), (0.2, 0.1, 0.15),
                                 (400.0, 300.0, 350.0), expansion=1e-4)  # fmt: skip
    return am.Model(
        [am.Body(lower, am.LinearElastic(E, 0.3, expansion=2e-4), "lower"),
         am.Body(upper, soft, "upper")],
        [am.Fix("lower.bottom", 0), am.Fix("upper.left", (0.0, None))],
        [am.Contact("upper.bottom", master="lower.top", **law)],
        [am.Traction("upper.top", (0.3, -LOAD)), am.BodyForce((0.0, -1.0), "default"),
         am.Temperature(10.0)],
    )  # fmt: skip


def again(model, tmp_path, dialect="calculix"):
    """The model of the deck that is written, with hard contact and rigid sticking."""
    am.write_deck(model, tmp_path / "model.inp", dialect)
    return read_case(tmp_path / "model.inp", ["deck.hard=true"]).model


def assert_same(model, other):
    one, two = model.assemble(), other.assemble()
    scale = abs(one.M).max()
    assert one.M.shape == two.M.shape
    if model.bodies[0].mesh.order == 1:  # mortar contact of second order sits at corners
        assert one.contacts == two.contacts
    assert abs(one.M - two.M).max() <= 1e-11 * scale  # numbers have 14 digits
    np.testing.assert_allclose(two.f, one.f, atol=1e-11 * np.abs(one.f).max())
    if not model.contacts[0].tied:
        np.testing.assert_allclose(two.mu, one.mu[: two.contacts])


@pytest.mark.parametrize("dialect", ["calculix", "abaqus"])
@pytest.mark.parametrize("model", [
    lambda: block(), lambda: block(order=2), lambda: block((1.0, 1.0, 1.0)),
    lambda: block(mu=0.3), lambda: replace(block(), load_factor=0.5),
], ids=["2D", "second order", "3D", "friction", "load factor"])  # fmt: skip
def test_a_block_on_a_plane_is_read_back(model, dialect, tmp_path):
    made = model()
    assert_same(made, again(made, tmp_path, dialect))


@pytest.mark.parametrize("law", [{"mu": 0.4}, {"tied": True}, {"mu": 0.1, "clearance": -1e-3}])
def test_two_bodies_are_read_back(law, tmp_path):
    made = stacked(**law)
    other = again(made, tmp_path)
    assert_same(made, other)
    one, two = made.assemble(), other.assemble()
    assert abs(one.H - two.H).max() <= 1e-12
    np.testing.assert_allclose(two.w, one.w, atol=1e-12)


def test_equations_and_springs_are_read_back(tmp_path):
    made = replace(
        block(), constraints=[am.Equation([(8, 1, 1.0), (7, 1, -0.5), ("R", 0, 2.0)])],
        references=[am.Reference("R", (0.0, 3.0))],
        springs=[am.Spring([("R", 0, 1.0)], 70.0), am.Spring([(5, 0, 1.0), (6, 0, -1.0)], 9.0)],
        supports=[*block().supports, am.Fix("R", (None, 0.0)), am.Fix("R.rotation", (0.0,))],
    )  # fmt: skip
    assert_same(made, again(made, tmp_path))


@pytest.mark.parametrize(("model", "word"), [
    (lambda: block(mu=None, tresca=1.0), "no deck has this friction"),
    (lambda: block(mu=0.1, cap=1.0), "no largest shear stress"),
    (lambda: block(mu=lambda x: 0.1 + x[:, 0]), "expected one number"),
    (lambda: block(material=am.NeoHookean(E, 0.3)), "NeoHookean: can not be said"),
    (lambda: block(loads=[am.Pressure("top", lambda x, t: t)]), "depends on time"),
    (lambda: replace(block(), contacts=[
        am.Contact("bottom", obstacle=am.Sphere((0.5, -1.0), 1.0), mu=0.0)]), "Sphere"),
])  # fmt: skip
def test_what_no_deck_says_is_refused_and_nothing_written(model, word, tmp_path):
    with pytest.raises(InvalidInput, match=word):
        am.write_deck(model(), tmp_path / "model.inp")
    assert not list(tmp_path.iterdir())


def test_the_command_writes_a_deck(tmp_path):
    target = tmp_path / "cube.inp"
    asked = ["convert", "example:cube", str(target), "--penalty", "1e5"]
    found = CliRunner().invoke(main, asked)
    assert found.exit_code == 0, found.output
    assert "PRESSURE-OVERCLOSURE=LINEAR\n100000.0" in target.read_text()
    wrong = CliRunner().invoke(
        main, ["convert", "example:cube", str(tmp_path / "a.h5"), "--dialect", "abaqus"]
    )
    assert wrong.exit_code and "does not end in .inp" in wrong.output


@pytest.mark.skipif(shutil.which("ccx") is None, reason="CalculiX is not installed")
@pytest.mark.parametrize("mu", [0.0, 0.3])
def test_calculix_comes_to_ours_as_its_penalty_grows(mu, tmp_path):
    made = block((1.0, 1.0, 1.0), mu=mu)
    ours = am.solve(made).displacement[0]
    assert ours[:, 2].min() == pytest.approx(-LOAD / E)
    for penalty in (1e4, 1e6):
        name = f"block{penalty:.0f}"
        am.write_deck(made, tmp_path / f"{name}.inp", penalty=penalty)
        run = ["ccx", name]
        subprocess.run(run, cwd=tmp_path, check=True, capture_output=True, timeout=100)
        found = next(b for b in read_frd(tmp_path / f"{name}.frd").blocks if b.name == "DISP")
        theirs = found.values[: len(ours)]
        np.testing.assert_allclose(ours[:, 2] - theirs[:, 2], LOAD / penalty, rtol=0.02)


def test_hybrid_elements_are_said_where_the_program_has_them(tmp_path):
    model = block(material=am.LinearElastic(E, 0.499))
    there = again(model, tmp_path, "abaqus")
    assert "TYPE=CPE4IH" in (tmp_path / "model.inp").read_text()
    assert_same(model, there)
    assert "elements: quad of region" in str(am.solve(there))
    notes = am.write_deck(model, tmp_path / "model.inp", "calculix")
    assert any("CalculiX has no hybrid elements" in note for note in notes)
    assert "TYPE=CPE4I," in (tmp_path / "model.inp").read_text()
    assert "CPE4IH" not in (tmp_path / "model.inp").read_text()


@pytest.mark.skipif(shutil.which("ccx") is None, reason="CalculiX is not installed")
@pytest.mark.parametrize("young", [(E, 3 * E), (3 * E, E)])
def test_hard_contact_of_calculix_is_that_of_the_stiffest_body(young, tmp_path):
    """CalculiX' penalty is 50 times the first modulus of a deck, whichever bodies touch."""
    lower = am.box((1.0, 1.0), cells=2, origin=(0.0, -1.0))
    made = am.Model(
        [am.Body(lower, am.LinearElastic(young[0], 0.0), "lower"),
         am.Body(am.box((1.0, 1.0), cells=2), am.LinearElastic(young[1], 0.0), "upper")],
        [am.Fix("lower.bottom", 0), am.Fix("upper.left", (0.0, None))],
        [am.Contact("upper.bottom", master="lower.top", mu=0.0)],
        [am.Traction("upper.top", (0.0, -LOAD))],
    )  # fmt: skip
    ours = am.solve(made).displacement[1][:, 1].min()
    am.write_deck(made, tmp_path / "pair.inp")
    subprocess.run(["ccx", "pair"], cwd=tmp_path, check=True, capture_output=True, timeout=100)
    found = next(b for b in read_frd(tmp_path / "pair.frd").blocks if b.name == "DISP")
    theirs = found.values[: 2 * len(lower.points), 1].min()
    assert ours - theirs == pytest.approx(LOAD / (50 * 3 * E), rel=0.01)  # six digits


def by_calculix(model, path):
    """Displacements and outside forces (nodes, 3) of CalculiX on the deck of a model."""
    am.write_deck(model, path / "model.inp")
    subprocess.run(["ccx", "model"], cwd=path, check=True, capture_output=True, timeout=100)
    blocks = {block.name: block.values for block in read_frd(path / "model.frd").blocks}
    count = sum(len(body.mesh.points) for body in model.bodies)
    return blocks["DISP"][:count], blocks["FORC"][:count]


@pytest.mark.skipif(shutil.which("ccx") is None, reason="CalculiX is not installed")
def test_ties_in_2d_hold_in_calculix(tmp_path):
    """Its *TIE does nothing between 2D elements, so a bond is written."""
    made = replace(stacked(tied=True), loads=[am.Traction("upper.top", (0.3, LOAD))])
    ours = am.solve(made).displacement[1]
    theirs = by_calculix(made, tmp_path)[0][-len(ours) :, :2]
    np.testing.assert_allclose(theirs, ours, atol=0.03 * np.abs(ours).max())


@pytest.mark.skipif(shutil.which("ccx") is None, reason="CalculiX is not installed")
def test_tables_press_in_calculix(tmp_path):
    """CalculiX 2.20 takes no force from a table of surfaces, so nodes are written."""
    law = am.OverclosureCurve([0.0, 5.0, 30.0], [0.0, 1e-3, 3e-3])
    made = stacked(mu=0.0, stiffness=law)
    top = am.Fix("upper.top", (None, -0.01))
    made = replace(made, loads=[], supports=[*made.supports, top])
    ours = am.solve(made)
    _, force = by_calculix(made, tmp_path)
    upper = force[len(made.bodies[0].mesh.points) :, 1].sum()
    assert ours.resultant[1] == pytest.approx(-upper, rel=0.1)  # nodes there, averages here


def test_bonds_and_the_line_of_nodes_are_read_back(tmp_path):
    from amontons.io.decks.contact_laws import bend

    for law in ({"tied": True, "stiffness": 5e3, "stick_stiffness": 2e3},
                {"mu": 0.0, "stiffness": bend(1e5, 2.0)}):  # fmt: skip
        am.write_deck(stacked(**law), tmp_path / "model.inp")
        (found,) = read_case(tmp_path / "model.inp").model.contacts
        assert found.tied == law.get("tied", False)
        assert found.stick_stiffness == law.get("stick_stiffness")
        if found.tied:
            assert found.stiffness == 5e3
    text = (tmp_path / "model.inp").read_text()
    row = text.split("PRESSURE-OVERCLOSURE=LINEAR\n")[1].split("\n")[0]
    np.testing.assert_allclose([float(x) for x in row.split(",")], [1e5, 2.0], rtol=1e-9)


@pytest.mark.skipif(shutil.which("ccx") is None, reason="CalculiX is not installed")
@pytest.mark.parametrize("held", [True, False])
def test_ties_of_held_nodes_hold_in_calculix(held, tmp_path):
    """Its *TIE leaves held components of slave nodes out, and the master there goes free."""
    lower, upper = (am.box((1.0, 1.0, 1.0), cells=2, origin=(0.0, 0.0, z)) for z in (-1.0, 0.0))
    made = am.Model(
        [am.Body(mesh, am.LinearElastic(E, 0.3), name)
         for mesh, name in ((lower, "lower"), (upper, "upper"))],
        [am.Fix("lower.bottom", 0), am.Fix("upper.left", (0.0, None, None))][: 1 + held],
        [am.Contact("upper.bottom", master="lower.top", tied=True)],
        [am.Traction("upper.top", (1.0, 0.0, LOAD))],
    )  # fmt: skip
    ours = np.concatenate([*am.solve(made).displacement])
    theirs, _ = by_calculix(made, tmp_path)
    assert ("*TIE" in (tmp_path / "model.inp").read_text()) is not held
    rough = 0.03 if held else 1e-5  # a penalty of 50 E, or six digits
    np.testing.assert_allclose(theirs, ours, atol=rough * np.abs(ours).max())
