"""Every example of every --help runs as it is printed, in a folder with the files it names."""

import glob
import importlib.util
import json
import re
import shlex
import shutil

import click
import pytest
from click.testing import CliRunner

import amontons as am
from amontons.app.cli import main
from amontons.io.case import DATA
from amontons.mechanics.ready.gallery import box_tower, random_delassus

CASE = """
title = "press"
[mesh]
box = [1, 1]
cells = 3
[material.default]
young = 1.0
poisson = 0.3
density = 1.0
[[fix]]
on = "top"
value = [0.05, -0.1]
[[contact]]
slave = "bottom"
obstacle = { plane = { normal = [0, 1] } }
friction = { coulomb = 0.5 }
"""
SOONER = {"evolution.until=2": "evolution.until=0.1"}  # the same run, which takes 12 seconds
GOOD = {"enumerate": (0, 1), "uniqueness": (0, 1), "jam": (0, 1),  # exit codes; 1: undecided
        "collapse": (0, 1), "modes": (0, 1)}  # 1: wide; one grows  # fmt: skip


def commands():
    """The group and its commands, by what is typed."""
    found = {"amontons": main}
    found |= {f"amontons {name}": command for name, command in main.commands.items()}
    return found


def examples():
    """(what is typed, command) of all epilogs: lines that begin with the program."""
    for name, command in commands().items():
        text = command.epilog or ""
        for line in text.splitlines():
            if line.strip().startswith("amontons "):
                yield pytest.param(re.split(r"\s{2,}", line.strip())[0], id=line.strip()[:60])
        if name != "amontons" and text:
            assert "Example" in text, name


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """A folder with a file of every name that the examples use."""
    made = tmp_path_factory.mktemp("files")
    (made / "case.toml").write_text(CASE)
    am.write_fclib(random_delassus(0, 4), made / "problem.hdf5")
    am.write_fclib(box_tower(3), made / "KaplasTower.hdf5")
    single = am.FrictionProblem.from_delassus(W=[[1, 0.2], [0.2, 1]], q=[[-1, 0.5]], mu=[0.3])
    am.write_certificate(single, am.uniqueness(single), made / "c.h5")
    am.write_fclib(am.read_case(made / "case.toml").model.assemble(), made / "global.hdf5")
    if importlib.util.find_spec("netgen") is not None:
        from netgen.occ import Box

        Box((0, 0, 0), (2, 1, 1)).WriteStep(str(made / "part.step"))
    wall = re.sub(r"cells = .*", "cells = [2, 1, 1]", (DATA / "wall.toml").read_text())
    (made / "wall.toml").write_text(re.sub(r"until = .*", "until = 0.05", wall))
    return made


@pytest.fixture
def folder(files, tmp_path, monkeypatch):
    """The same files, to work on."""
    shutil.copytree(files, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "120")
    return tmp_path


DECK = """*NODE
1, 0, 0
2, 1, 0
3, 1, 1
4, 0, 1
5, 0, 1
6, 1, 1
7, 1, 2
8, 0, 2
*ELEMENT, TYPE=CPE4, ELSET=ALL
1, 1, 2, 3, 4
2, 5, 6, 7, 8
*MATERIAL, NAME=M
*ELASTIC
100, 0
*SOLID SECTION, ELSET=ALL, MATERIAL=M
*SURFACE, NAME=LOW
1, S3
*SURFACE, NAME=HIGH
2, S1
*SURFACE INTERACTION, NAME=I
*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=HARD
*FRICTION
0.3
*CONTACT PAIR, INTERACTION=I, TYPE=SURFACE TO SURFACE
HIGH, LOW
*BOUNDARY
1, 1, 2
2, 1, 2
8, 1, 1
*STEP
*STATIC
*CLOAD
7, 2, -1
8, 2, -1
*END STEP
"""


def with_results(line, folder):
    """The results that an example begins with."""
    words = line.split()
    if "model.frd" in words:
        (folder / "model.inp").write_text(DECK)
        asked = ["solve", "model.inp", "--frd", "--no-figures", "-o", "model"]
        assert CliRunner().invoke(main, asked).exit_code == 0
        (folder / "model" / "solution.frd").rename("model.frd")
    sources = {"case-results": "case.toml", "cube-results": "example:cube --set mesh.cells=2"}
    for name, source in sources.items():
        if name in words:
            asked = ["solve", *source.split(), "--no-figures", "-o", name]
            assert CliRunner().invoke(main, asked).exit_code == 0


@pytest.mark.parametrize("line", list(examples()))
def test_example_of_the_help_runs(line, folder):
    with_results(line, folder)
    if "part.step" in line:
        pytest.importorskip("netgen.occ")
    typed, _, reader = line.partition("|")
    words = [w for word in shlex.split(typed)[1:] for w in sorted(glob.glob(word)) or [word]]
    words = [SOONER.get(word, word) for word in words]
    if "--restart" in words:  # it goes on with the run of the example before
        first = words[: words.index("--restart")]
        assert CliRunner().invoke(main, first).exit_code == 0
    done = CliRunner().invoke(main, words)
    assert done.exit_code in GOOD.get(words[0], (0,)), done.output
    if reader:
        key = reader.split(".")[-1].strip()
        assert key in json.loads(done.stdout)


def test_every_command_that_takes_options_has_examples():
    for name, command in commands().items():
        if isinstance(command, click.Group) or len(command.params) < 2:
            continue
        assert "amontons " in (command.epilog or ""), name
