"""A surface against itself in decks and case files, beside the same with two named surfaces."""

import numpy as np
import pytest

import amontons as am
from amontons.io.readers import read_case
from tests.unit.mechanics.test_self_contact import SOFT, fork

GAP, PAIR = 0.02, "\nUP_SIDE, DOWN_SIDE"
INCLUDED = """*CONTACT
*CONTACT INCLUSIONS{}
*CONTACT PROPERTY ASSIGNMENT
 , , INTERACTION_1"""


def strip(mu=0.3):
    """A C pressed together, its slot with two named sides, both of them also as one surface."""
    mesh = fork(GAP)
    middle = {k: mesh.points[b.nodes].mean(axis=1) for k, b in enumerate(mesh.boundary)}
    assert len(middle) == 1
    nodes, centre = mesh.boundary[0].nodes, middle[0]
    in_slot = (np.abs(np.abs(centre[:, 1]) - GAP / 2) < 1e-9) & (centre[:, 0] > 1)
    up, down = (nodes[in_slot & (sign * centre[:, 1] > 0)] for sign in (1, -1))
    slot = np.concatenate([up, down])
    mesh = mesh.with_surfaces(
        {
            name: (am.Facets("line", rows),)
            for name, rows in (("up side", up), ("down side", down), ("slot", slot))
        }
    )
    loads = [am.NodalForce("up", (0.5, -2.0)), am.NodalForce("down", (0.0, 2.0))]
    contact = am.Contact("up side", master="down side", mu=mu)
    return am.Model([am.Body(mesh, SOFT, "fork")], [am.Fix("left", 0)], [contact], loads)


def solved(model):
    return am.solve(model, tolerance=1e-12)


def assert_same(one, other):
    """Displacements to rounding: the same facets meet, whichever side is the slave first."""
    for found in (one, other):
        assert (found.fields.pressure > 0).sum() >= 2
    u, v = one.displacement[0], other.displacement[0]
    np.testing.assert_allclose(v, u, atol=1e-9 * np.abs(u).max())
    np.testing.assert_allclose(np.sort(other.fields.pressure), np.sort(one.fields.pressure),
                               atol=1e-8 * one.fields.pressure.max())  # fmt: skip


@pytest.fixture(scope="module")
def named(tmp_path_factory):
    """The deck with two named sides, and its solution."""
    path = tmp_path_factory.mktemp("deck") / "fork.inp"
    am.write_deck(strip(), path)
    text = path.read_text()
    assert PAIR in text
    return text, solved(read_case(path, ["deck.hard=true"]).model)


@pytest.mark.parametrize("given", [
    "\nSLOT", "\nSLOT,", "\nSLOT, SLOT", ", ALL EXTERIOR", "\nUP_SIDE, DOWN_SIDE",
])  # fmt: skip
@pytest.mark.parametrize("general", [False, True], ids=["pair", "general"])
def test_a_surface_against_itself_is_its_two_sides(given, general, named, tmp_path):
    text, wanted = named
    card = next(line for line in text.splitlines() if line.startswith("*CONTACT PAIR"))
    if general:
        text = text.replace(card + PAIR, INCLUDED.format(given))
    elif "EXTERIOR" in given:
        return
    else:
        text = text.replace(card + PAIR, card + given)
    (tmp_path / "fork.inp").write_text(text)
    case = read_case(tmp_path / "fork.inp", ["deck.hard=true"])
    assert len(case.model.contacts) == 1
    assert_same(wanted, solved(case.model))
    if given != PAIR or general:
        assert any("contact found: " in note for note in case.notes)


def test_a_case_file_finds_it_where_asked(named, tmp_path):
    text, _ = named
    (tmp_path / "fork.inp").write_text(text[: text.index("*SURFACE INTERACTION")])
    toml = """
[mesh]
file = "fork.inp"
[material.default]
young = 1000.0
poisson = 0.3
[[fix]]
on = "LEFT_NODES"
value = [0, 0]
[[traction]]
on = "UP_SIDE"
value = [0.5, -2.0]
[[contact]]
pairs = "auto"
friction = { coulomb = 0.3 }
"""
    path = tmp_path / "fork.toml"
    path.write_text(toml)
    with pytest.raises(am.AmontonsError, match="no contact found"):
        read_case(path)
    path.write_text(toml + "itself = true\n")
    found = solved(read_case(path).model)
    path.write_text(toml.replace('pairs = "auto"', 'slave = "UP_SIDE"\nmaster = "DOWN_SIDE"'))
    assert_same(solved(read_case(path).model), found)
    path.write_text(toml + "itself = 1\n")
    with pytest.raises(am.FileFormatError, match=r"itself: expected true or false, got 1"):
        read_case(path)
