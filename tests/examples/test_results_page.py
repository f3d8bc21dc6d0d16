"""docs/results.md tells exactly the fields that are written, and no others."""

import csv
import json
import re
from dataclasses import fields
from pathlib import Path

import h5py
import meshio
import numpy as np
import pytest
from click.testing import CliRunner
from numpy.testing import assert_allclose

import amontons as am
from amontons.app.cli import main
from amontons.app.cli.run_folder import COLUMNS
from amontons.app.cli.sources import open_source

PAGE = (Path(__file__).parents[2] / "docs" / "results.md").read_text()
CASE = """
[mesh]
box = [1, 1, 1]
cells = 2
[material.default]
young = 100
poisson = 0.2
density = 1
[[fix]]
on = "top"
value = ["0.01*t", "0", "-0.02*t"]
[[contact]]
name = "PAIR"
slave = "bottom"
obstacle = { plane = { normal = [0, 0, 1] } }
friction = { coulomb = 0.3 }
[evolution]
kind = "quasi-static"
step = 0.5
until = 1
"""


def told(title, table=0):
    """The names in the first column of a table below a heading."""
    section = PAGE.split(f"\n## {title}\n")[1].split("\n## ")[0]
    tables = re.findall(r"(?:^\|.*\n)+", section, re.MULTILINE)
    rows = tables[table].splitlines()[2:]
    return [name for row in rows for name in re.findall(r"`([^`]+)`", row.split("|")[1])]


def flat(data, inside=("seconds", "contacts", "slip", "load", "works"), lists=()):
    """Dotted keys of a record, lists by their first entry."""
    out = []
    for key, value in data.items():
        if key in inside and isinstance(value, dict):
            out += [f"{key}.{name}" for name in flat(value, inside, lists)]
        elif key in lists:
            out += [f"{key}[].{name}" for name in flat(value[0], inside, lists)]
        else:
            out.append(key)
    return out


def same(names, written):
    assert len(names) == len(set(names))
    assert set(names) == set(written)


@pytest.fixture(scope="module")
def solved(tmp_path_factory):
    folder = tmp_path_factory.mktemp("solved")
    (folder / "case.toml").write_text(CASE.split("[evolution]")[0].replace("*t", ""))
    done = CliRunner().invoke(main, ["solve", str(folder / "case.toml"), "-o", str(folder)])
    assert done.exit_code == 0, done.output
    return folder


@pytest.fixture(scope="module")
def ran(tmp_path_factory):
    folder = tmp_path_factory.mktemp("ran")
    (folder / "case.toml").write_text(CASE)
    arguments = ["run", folder / "case.toml", "-o", folder, "--every", 1, "--xdmf", "--rates"]
    done = CliRunner().invoke(main, list(map(str, arguments)))
    assert done.exit_code == 0, done.output
    return folder


def test_the_record_of_a_solve(solved):
    data = json.loads((solved / "solution.json").read_text())
    same(told("solution.json of `solve`"), flat(data, lists=("pairs", "supports")))


def test_the_record_of_a_run(ran):
    data = json.loads((ran / "solution.json").read_text())
    same(told("solution.json of `run`"), flat(data, inside=("contacts", "works")))


def test_the_tables(solved, ran):
    with (ran / "steps.csv").open(newline="") as file:
        columns = next(csv.reader(file))
    names = [name.replace("SUPPORT", "top") for name in told("steps.csv")]
    same(names, columns)
    assert set(COLUMNS) < set(columns)
    with (solved / "pairs.csv").open(newline="") as file:
        same(told("pairs.csv"), next(csv.reader(file)))


def test_the_table_of_all_solutions(tmp_path):
    written = set()
    for source in ("example:brake", "example:cube"):
        smaller = ["--set", "mesh.cells=1"] if source == "example:cube" else []
        done = CliRunner().invoke(main, ["enumerate", source, *smaller, "-o", str(tmp_path)])
        assert done.exit_code == 0, done.output
        with (tmp_path / "solutions.csv").open(newline="") as file:
            rows = list(csv.DictReader(file))
        problem = open_source(source, [*smaller[1:]]).discrete()
        for number in {row["solution"] for row in rows}:
            own = [row for row in rows if row["solution"] == number]
            assert [row["contact"] for row in own] == [str(k) for k in range(len(own))]
            r = np.array([[float(v) for k, v in row.items() if k.startswith("r_")]
                          for row in own])  # fmt: skip
            assert problem.error(r) < 1e-8
            u = np.array([[float(v) for k, v in row.items() if k.startswith("u_")]
                          for row in own])  # fmt: skip
            assert_allclose(u, problem.velocity(r)[0], atol=1e-9 * np.abs(u).max())
            assert {row["status"].split()[0] for row in own} <= {"open", "stick", "slip"}
            assert [row["status"] == "open" for row in own] == [not any(x) for x in r]
        written |= set(rows[0])
    same(told("solutions.csv"), written)


def test_the_arrays(solved):
    arrays = []
    with h5py.File(solved / "solution.h5") as file:
        file.visititems(
            lambda name, node: arrays.append(name) if isinstance(node, h5py.Dataset) else None
        )
        attributes = set(file.attrs)
    same([name.replace("BODY", "body") for name in told("solution.h5")], arrays)
    line = PAGE.split("Attributes of the file: ")[1].split(". ")[0]
    assert set(re.findall(r"`(\w+)`", line)) == attributes


def test_the_fields_for_viewers(solved, ran):
    title = "solution.vtu, step-NNNNN.vtu"
    found = meshio.read(ran / "step-00001.vtu")
    same(told(title), found.point_data)
    same(told(title, 1), found.cell_data)
    named = {re.sub(r" \d+: .*", " K: NAME", re.sub(r"(title|version): .*", r"\1", name))
             for name in found.field_data}  # fmt: skip
    names = {name.split(": ")[0] if name[0] in "tv" else name for name in told(title, 2)}
    assert named | {"title"} == names
    assert meshio.read(solved / "solution.vtu").point_data.keys() == found.point_data.keys()
    with h5py.File(ran / "step-00001.h5") as file:
        assert set(file["point"]) == set(found.point_data)
        assert set(file["cell"]) == set(found.cell_data)


def test_the_keys_of_evolution():
    known = {field.name for kind in (am.QuasiStatic, am.MoreauJean) for field in fields(kind)}
    same(told("[evolution]"), known | {"kind", "until"})
