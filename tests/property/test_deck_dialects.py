"""The same model in any dialect of decks is the same case; broken decks say where and what."""

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import amontons as am
from amontons.io.readers import read
from tests.unit.io.test_decks import DECK, REST

BASE = DECK.replace(
    "*SURFACE INTERACTION, NAME=I\n", "*SURFACE INTERACTION, NAME=Int 1\n"
).replace("INTERACTION=I,", "INTERACTION=Int 1,")


def lines_of(text):
    return [line for line in text.split("\n") if line]


def read_text(folder, data, name="deck.inp"):
    path = folder / name
    path.write_bytes(data)
    return read(path)


def fingerprint(case):
    """All numbers of a case, in any order of its nodes and cells."""
    model = case.in_time
    mesh = model.bodies[0].mesh
    named = {
        name: np.sort(np.unique(np.concatenate([f.nodes.ravel() for f in facets])))
        for name, facets in mesh.surfaces.items()
    }
    sets = [np.sort(nodes).tolist() for nodes in mesh.node_sets.values()]
    times = (0.0, 0.3, 1.0)
    values = [
        [v(None, t) if callable(v) else v for v in part.value]
        for t in times for part in (*model.supports, *model.loads)
    ]  # fmt: skip
    return {
        "points": mesh.points.tolist(),
        "cells": [(c.kind, c.region, c.nodes.tolist()) for c in mesh.cells],
        "surfaces": {k: v.tolist() for k, v in named.items()}, "sets": sets, "values": values,
        "law": {k: v for k, v in model.contacts[0].numbers.items()},
        "pair": (model.contacts[0].slave, model.contacts[0].master),
    }  # fmt: skip


@pytest.fixture(scope="module")
def plain(tmp_path_factory):
    return fingerprint(read_text(tmp_path_factory.mktemp("plain"), BASE.encode()))


def any_case(draw, text):
    return "".join(c.upper() if draw(st.booleans()) else c.lower() for c in text)


def spread(draw, line):
    """Blanks, tabs and a comma at the end."""
    gap = st.sampled_from(["", " ", "\t", "  "])
    parts = [f"{draw(gap)}{part.strip()}{draw(gap)}" for part in line.split(",")]
    text = ",".join(parts)
    return text + "," if not line.startswith("*") and draw(st.booleans()) else text


def dialect(draw, text):
    """The deck as somebody else would have written it."""
    out = []
    cased = draw(st.booleans())
    for line in lines_of(text):
        if draw(st.integers(0, 5)) == 0:
            out.append(draw(st.sampled_from(["** a remark, *NODE", "  **", "** \u00e9"])))
        written = any_case(draw, line) if cased else line
        if line.startswith("*"):
            key, *options = written.split(",")
            options = [option.strip() for option in options]
            if "int 1" in written.lower():
                options = [o.replace(o.split("=")[1], f'"{o.split("=")[1]}"')
                           if o.lower().endswith("int 1") else o for o in options]  # fmt: skip
            join = draw(st.sampled_from([", ", ",", ",\n", " ,  ", ",\n** between\n"]))
            out.append(join.join([key, *options]) + draw(st.sampled_from(["", "  "])))
        else:
            out.append(spread(draw, written))
            if draw(st.integers(0, 9)) == 0:
                out.append(draw(st.sampled_from(["", "   ", "\t"])))
    return draw(st.sampled_from(["\n", "\r\n", "\r"])).join("\n".join(out).split("\n"))


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(data=st.data())
def test_any_dialect_is_the_same_case(tmp_path_factory, plain, data):
    text = dialect(data.draw, BASE)
    encoding = data.draw(st.sampled_from(["utf-8", "utf-8-sig", "latin-1"]))
    folder = tmp_path_factory.mktemp("odd")
    found = fingerprint(read_text(folder, text.encode(encoding)))
    assert found == plain


@settings(max_examples=30, deadline=None)
@given(st.lists(st.integers(1, 10**9), min_size=16, max_size=16, unique=True), st.randoms())
def test_any_numbers_in_any_order(tmp_path_factory, plain, labels, random):
    """Nodes are told apart by their numbers alone."""
    old = [*range(1, 9), *range(11, 19)]
    new = dict(zip(map(str, old), map(str, labels), strict=True))
    nodes, rest = BASE.split("*ELEMENT", 1)
    head, *rows = lines_of(nodes)
    rows = [",".join([new[row.split(",")[0]], *row.split(",")[1:]]) for row in rows]
    random.shuffle(rows)
    out = ["*ELEMENT" + lines_of("*ELEMENT" + rest)[0].removeprefix("*ELEMENT")]
    renumbered, key = [], ""
    for line in lines_of("*ELEMENT" + rest):
        if line.startswith("*"):
            key = line.split(",")[0]
            renumbered.append(line)
        elif key == "*ELEMENT":
            first, *more = [part.strip() for part in line.split(",")]
            renumbered.append(", ".join([first, *(new[n] for n in more)]))
        elif key in ("*BOUNDARY", "*CLOAD"):
            first, *more = line.split(",")
            renumbered.append(",".join([new[first], *more]))
        else:
            renumbered.append(line)
    assert out
    text = "\n".join([head, *rows, *renumbered])
    found = read_text(tmp_path_factory.mktemp("numbers"), text.encode())
    mesh = found.model.bodies[0].mesh
    assert sorted(mesh.points.tolist()) == sorted(plain["points"])
    assert found.model.assemble().contacts == 4


def test_names_of_latin_1_and_continued_everywhere(tmp_path):
    text = BASE.replace("STEEL", "Fluß\u00e9").replace("TOP", "Deck, oben".replace(",", ""))
    case = read_text(tmp_path, text.encode("latin-1"))
    assert case.model.contacts[0].master == "DECK OBEN"


def test_includes_at_any_depth(tmp_path, plain):
    for k in range(20):
        (tmp_path / f"d{k}.inp").write_text(f"*INCLUDE, INPUT=d{k + 1}.inp\n")
    (tmp_path / "d20.inp").write_text(BASE)
    assert fingerprint(read(tmp_path / "d0.inp")) == plain
    (tmp_path / "d20.inp").write_text("*INCLUDE, INPUT=d5.inp\n")
    with pytest.raises(am.FileFormatError, match="includes itself"):
        read(tmp_path / "d0.inp")


# -------------------------------------------------------------------------------- broken
BROKEN = [
    ("*ELEMENT, TYPE=C3D8, ELSET=LOWER", "*ELEMENT, ELSET=LOWER", 18, "TYPE: missing"),
    ("TYPE=C3D8, ELSET=LOWER", "TYPE=S4R, ELSET=LOWER", 18, "TYPE=S4R: .*shells, are not read"),
    ("*NODE, NSET=NALL", "*NODE, NSET=NALL, SYSTEM=C", 1, "SYSTEM=C: expected R"),
    ("1, 0., 0., 0.", "-1, 0., 0., 0.", 2, "expected a number > 0, got -1"),
    ("1, 0., 0., 0.", "1.5, 0., 0., 0.", 2, "expected a whole number"),
    ("1, 0., 0., 0.", "1, 0., inf, 0.", 2, "finite number"),
    ("1, 0., 0., 0.", "1, 0. 0., 0.", 2, "expected a number, got '0. 0.'"),
    ("1, 1, 2, 3, 4, 5, 6, 7, 8", "1, 1, 2, 3, 4, 5, 6, 7, 8, 8", 19, "8 nodes, got 9"),
    ("1, 1, 2, 3, 4, 5, 6, 7, 8", "1, 1, 2, 3, 4, 5, 6, 7, x", 19, "number, got .x."),
    ("*SURFACE, NAME=TOP", "*SURFACE", 22, "NAME: missing"),
    ("*SURFACE, NAME=BOTTOM", "*SURFACE, NAME=TOP", 24, "surface TOP is there already"),
    ("*SURFACE, NAME=TOP", "*SURFACE, NAME=TOP, TYPE=CUT", 22, "expected ELEMENT, NODE"),
    ("UPPER, S1", "UPPER, S1x", 33, "face S1X: expected S1 to S6"),
    ("*MATERIAL, NAME=STEEL\n", "*MATERIAL\n", 26, "NAME: missing"),
    ("1000., 0.", "1000.", 28, "expected two constants, got 1"),
    ("1000., 0.", "1000., 0.7", 27, "poisson"),
    ("*FRICTION\n0.3,", "*FRICTION\n", 35, "expected one line with a coefficient"),
    ("1, 1, 3\n2, 1, 3", "1, 3, 1\n2, 1, 3", 38, "components from 1 to 6, got 3 to 1"),
    ("1, 1, 3\n2, 1, 3", "NOSET, 1, 3\n2, 1, 3", 38, "node set NOSET: not found"),
    ("*STATIC\n1., 1.", "*STATIC\n-1., 1.", 48, "expected times > 0"),
    ("*STATIC\n1., 1.\n", "", 46, "expected one procedure, .STATIC, got 0"),
    ("*CLOAD\n15, 3, -1.", "*CLOAD\n15, 3", 50, "expected nodes, component, value"),
    ("*CLOAD\n", "*CLOAD, AMPLITUDE=NONE\n", 49, "amplitude NONE: not found"),
]  # fmt: skip


@pytest.mark.parametrize(("old", "new", "line", "words"), BROKEN)
def test_broken_decks_say_where_and_what(tmp_path, old, new, line, words):
    assert old in DECK
    with pytest.raises(am.FileFormatError, match=words) as found:
        read_text(tmp_path, DECK.replace(old, new, 1).encode()).model.assemble()
    at = int(str(found.value).split("deck.inp:")[1].split(":")[0])
    assert abs(at - line) <= 1, str(found.value)


def test_large_tables_are_read_as_small_ones(tmp_path):
    """Blocks of numbers and line by line: elements over two lines, D exponents, remarks."""
    folded = DECK.replace("1, 1, 2, 3, 4, 5, 6, 7, 8", "1, 1, 2, 3, 4,\n5, 6, 7, 8").replace(
        "2, 11, 12, 13, 14, 15, 16, 17, 18", "2, 11, 12, 13, 14,\n15, 16, 17, 18"
    )
    exponents = DECK.replace("2, 1., 0., 0.", "2, 1.D0, 0.d0, 0.")
    remarks = DECK.replace("2, 1., 0., 0.", "** in between, 1, 2\n2, 1., 0., 0.")
    short = DECK.replace("1, 0., 0., 0.\n", "1\n").replace("2, 1., 0., 0.", "2, 1.")
    base = fingerprint(read_text(tmp_path, DECK.encode()))
    for text in (folded, exponents, remarks, short):
        assert fingerprint(read_text(tmp_path, text.encode())) == base
    assert REST in DECK
