"""Every mistake ends in exit code 2, one clear message, and no file."""

import os
import shutil
from pathlib import Path

import h5py
import numpy as np
import pytest
from click.testing import CliRunner

from amontons.app.cli import main
from amontons.io.fclib import write_fclib
from amontons.mechanics.ready.gallery import box_tower

CASE = """
title = "small"
[mesh]
box = [1, 1]
cells = 2
[material.default]
young = 100.0
poisson = 0.3
[[fix]]
on = "top"
value = [0.01, "-0.02 + 0.001*x"]
[[contact]]
slave = "bottom"
obstacle = { plane = { point = [0, 0], normal = [0, 1] } }
friction = { coulomb = 0.3 }
[solver]
method = "auto"
tolerance = 1e-8
"""

# what replaces what in the case above, and words that the message must hold
CASES = {
    "syntax": ("[mesh]", "[mesh", ["case.toml", "line 3"]),
    "duplicate key": ("cells = 2", "cells = 2\ncells = 3", ["case.toml"]),
    "unknown top key": ('title = "small"', 'titel = "small"', ["titel", "mean 'title'"]),
    "unknown mesh key": ("cells = 2", "cels = 2", ["mesh.cels", "did you mean 'cells'"]),
    "unknown material key": ("young", "yung", ["material.default.yung", "young"]),
    "unknown contact key": ("slave", "slav", ["contact[0].slav", "slave"]),
    "unknown friction": ("coulomb", "columb", ["friction.columb", "coulomb"]),
    "no mesh": ("[mesh]\nbox = [1, 1]\ncells = 2\n", "", ["mesh", "missing"]),
    "no material": ("[material.default]\nyoung = 100.0\npoisson = 0.3", "", ["material"]),
    "no young": ("young = 100.0", "", ["young", "missing"]),
    "no contact": ("[[contact]]", "[[fix]]", ["slave"]),
    "box and file": ("cells = 2", 'cells = 2\nfile = "a.msh"', ["mesh", "either"]),
    "missing mesh file": ("box = [1, 1]\ncells = 2", 'file = "gone.msh"', ["mesh.file"]),
    "box of one number": ("[1, 1]", "[1]", ["mesh.box", "2 or 3"]),
    "box of texts": ("[1, 1]", '["1", "1"]', ["mesh.box[0]"]),
    "tiny box": ("[1, 1]", "[1e-309, 1e-309]", ["mesh.box", "1e-309"]),
    "negative box": ("[1, 1]", "[1, -1]", ["mesh"]),
    "cells zero": ("cells = 2", "cells = 0", ["mesh.cells"]),
    "cells fraction": ("cells = 2", "cells = 2.5", ["mesh.cells", "2.5"]),
    "cells true": ("cells = 2", "cells = true", ["mesh.cells"]),
    "too many cells": ("cells = 2", "cells = 1000000", ["mesh.cells", "20000000"]),
    "wrong kind": ("cells = 2", 'cells = 2\nkind = "hex"', ["mesh", "quad"]),
    "young negative": ("100.0", "-100.0", ["material.default", "young"]),
    "young text": ("100.0", '"hard"', ["young", "hard"]),
    "young nan": ("100.0", "nan", ["young", "nan"]),
    "poisson half": ("0.3\n[[fix", "0.5\n[[fix", ["poisson", "0.5"]),
    "law misspelt": ("young", 'law = "neo-hokean"\nyoung', ["neo-hookean", "law"]),
    "law without it": ("young", 'law = "elasto-plastic"\nplane = "strain"\nyoung', ["plane"]),
    "law unknown": ("young", 'law = "linear"\nyoung', ["law", "linear-elastic"]),
    "region unknown": ("material.default", "material.steel", ["material", "steel"]),
    "plane unknown": ("poisson", 'plane = "stresses"\npoisson', ["plane", "stress"]),
    "surface unknown": ('"top"', '"tip"', ["fix[0].on", "tip", "top"]),
    "slave unknown": ('"bottom"', '"botom"', ["contact[0].slave", "botom", "bottom"]),
    "value too short": ('[0.01, "-0.02 + 0.001*x"]', "[0.01]", ["fix[0].value", "2"]),
    "value no list": ('[0.01, "-0.02 + 0.001*x"]', "0.01", ["fix[0].value"]),
    "value true": ("0.01,", "true,", ["fix[0].value[0]"]),
    "expression import": ("-0.02 +", "__import__('os') +", ["fix[0].value[1]", "__import__"]),
    "expression syntax": ("0.001*x", "0.001*", ["fix[0].value[1]"]),
    "expression name": ("0.001*x", "0.001*q", ["'q'"]),
    "expression z": ("0.001*x", "0.001*z", ["'z'", "2D"]),
    "expression infinite": ("0.001*x", "0.001/x", ["fix[0].value", "0.001/x", "inf"]),
    "expression huge": ("0.001*x", "9**9**9", ["9**9**9", "inf"]),
    "friction negative": ("coulomb = 0.3", "coulomb = -0.3", ["coulomb", "-0.3"]),
    "friction negative somewhere": ("= 0.3 }", '= "x - 0.5" }',
                                    ["contact[0].friction.coulomb", "-0.5"]),
    "friction text": ("coulomb = 0.3", 'coulomb = "rough"', ["rough"]),
    "friction both": ("coulomb = 0.3", "coulomb = 0.3, tresca = 1", ["friction", "either"]),
    "no friction": ("friction = { coulomb = 0.3 }", "", ["friction", "missing"]),
    "no obstacle": ("obstacle = { plane = { point = [0, 0], normal = [0, 1] } }", "",
                    ["contact[0]", "obstacle"]),
    "master": ("obstacle = { plane = { point = [0, 0], normal = [0, 1] } }", 'master = "topp"',
               ["contact[0].master", "'topp'", "did you mean"]),
    "contact method": ('slave = "bottom"', 'slave = "bottom"\nmethod = "nitsch"',
                       ["contact[0].method", "'nitsch'", "did you mean 'nitsche'"]),
    "nitsche option": ('slave = "bottom"',
                       'slave = "bottom"\nmethod = { kind = "nitsche", kapa = 3 }',
                       ["contact[0].method.kapa", "kappa"]),
    "nitsche kappa": ('slave = "bottom"',
                      'slave = "bottom"\nmethod = { kind = "nitsche", kappa = -3 }',
                      ["contact[0].method", "kappa", "-3"]),
    "nitsche solver": (
        '[solver]\nmethod = "auto"',
        'method = "nitsche"\n[solver]\nmethod = "gauss-seidel"',
        ["gauss-seidel", "nodal"],
    ),
    "obstacle unknown": ("plane = {", "plain = {", ["obstacle.plain", "plane"]),
    "normal zero": ("[0, 1] }", "[0, 0] }", ["normal"]),
    "normal in 3D": ("[0, 1] }", "[0, 0, 1] }", ["normal", "2 numbers"]),
    "level set constant": ("plane = { point = [0, 0], normal = [0, 1] }", "level_set = 1.0",
                           ["level_set"]),
    "level set flat": ("plane = { point = [0, 0], normal = [0, 1] }", 'level_set = "0*x"',
                       ["contact[0].obstacle", "gradient"]),
    "radius": ("plane = { point = [0, 0], normal = [0, 1] }",
               "sphere = { center = [0, -1], radius = -1 }", ["radius"]),
    "method unknown": ('"auto"', '"gauss"', ["solver.method", "gauss-seidel"]),
    "solver key unknown": ("tolerance", "tolerence", ["solver.tolerence", "auto has no"]),
    "tolerance zero": ("1e-8", "0", ["tolerance"]),
    "tolerance text": ("1e-8", '"small"', ["tolerance", "small"]),
    "table is a value": ("[solver]", "[other]", ["other", "unknown key"]),
    "fix is a table": ("[[fix]]", "[fix]", ["[[fix]]"]),
}  # fmt: skip


def run(arguments, folder, monkeypatch):
    """The result of a command in a folder, and the files that it left there."""
    monkeypatch.chdir(folder)
    before = {path for path in Path().rglob("*")}
    result = CliRunner().invoke(main, [str(a) for a in arguments])
    return result, {path for path in Path().rglob("*")} - before


def check_refused(result, new, words):
    assert result.exit_code == 2, result.output
    assert "Traceback" not in result.output
    assert result.exception is None or isinstance(result.exception, SystemExit)
    assert not new
    for word in words:
        assert word in result.stderr
    assert len(result.stderr) < 1200


@pytest.mark.parametrize("name", CASES)
def test_broken_case(name, tmp_path, monkeypatch):
    old, replacement, words = CASES[name]
    assert old in CASE
    (tmp_path / "case.toml").write_text(CASE.replace(old, replacement))
    result, new = run(["solve", "case.toml"], tmp_path, monkeypatch)
    check_refused(result, new, [*words, "case.toml"])


def test_contact_given_twice(tmp_path, monkeypatch):
    contact = CASE[CASE.index("[[contact]]") : CASE.index("[solver]")]
    (tmp_path / "case.toml").write_text(CASE.replace(contact, 2 * contact))
    result, new = run(["solve", "case.toml"], tmp_path, monkeypatch)
    check_refused(result, new, ["contact[0]", "contact[1]"])


PARTS = {  # what is added to the case, and the key that the message must name
    "supports clash": ('[[fix]]\non = "left"\nvalue = [0, 0.5]', "fix[1].value"),
    "all fixed": ('[[fix]]\non = "bottom"\nvalue = [0, 0]', "contact"),
    "traction": ('[[traction]]\non = "left"\nvalue = [0, "log(x - 1)"]', "traction[0].value"),
    "no large deformation": ('[[traction]]\non = "left"\nvalue = [0, 1]\n'
                             'configuration = "current"', "traction[0].configuration"),
    "second force": ("[[body_force]]\nvalue = [0, 1]\n[[body_force]]\nvalue = [0, '1/y']",
                     "body_force[1].value"),
    "force region": ('[[body_force]]\nvalue = [0, 1]\nregion = "foo"', "body_force[0].region"),
    "second friction": ('[[contact]]\nslave = "right"\nfriction = { coulomb = "0.5 - y" }\n'
                        "obstacle = { plane = { point = [2, 0], normal = [-1, 0] } }",
                        "contact[1].friction.coulomb"),
    "second law": ('[[contact]]\nslave = "right"\nfriction = { tresca = 1, cap = 2 }\n'
                   "obstacle = { plane = { point = [2, 0], normal = [-1, 0] } }",
                   "contact[1].friction.cap"),
    "pushed": ('[[contact]]\nslave = "right"\nfriction = { coulomb = 1 }\n'
               "obstacle = { plane = { point = [1, 0], normal = [-1, 0] } }", "contact[1]"),
}  # fmt: skip


@pytest.mark.parametrize("name", PARTS)
def test_key_of_what_shows_when_assembling(name, tmp_path, monkeypatch):
    text, key = PARTS[name]
    (tmp_path / "case.toml").write_text(CASE + "\n" + text)
    result, new = run(["solve", "case.toml"], tmp_path, monkeypatch)
    check_refused(result, new, [f"case.toml: {key}: "])


def test_body_that_nothing_holds(tmp_path, monkeypatch):
    text = CASE.replace("value = [0.01", 'value = ["free"').replace(
        "coulomb = 0.3", "coulomb = 0"
    )
    (tmp_path / "case.toml").write_text(text)
    result, new = run(["solve", "case.toml"], tmp_path, monkeypatch)
    check_refused(result, new, ["case.toml: fix", "translation along x"])


FLAGS = {
    "no source": (["solve"], ["SOURCE"]),
    "hard, no deck": (["solve", "example:cube", "--hard"], ["--hard: it is for decks"]),
    "allow, no deck": (["info", "good.hdf5", "--allow", "X"], ["--allow: it is for decks"]),
    "no file": (["solve", "gone.hdf5"], ["gone.hdf5", "no such file"]),
    "no example": (["solve", "example:cub"], ["cub", "did you mean 'cube'"]),
    "folder": (["solve", "folder"], ["folder"]),
    "text": (["solve", "text.txt"], ["text.txt", "none of them"]),
    "empty": (["solve", "empty.hdf5"], ["empty"]),
    "no command": (["slove", "good.hdf5"], ["slove"]),
    "unknown flag": (["solve", "good.hdf5", "--tolerence", "1"], ["--tolerence"]),
    "tolerance word": (["solve", "good.hdf5", "--tolerance", "low"], ["low"]),
    "tolerance negative": (["solve", "good.hdf5", "--tolerance", "-1"], ["-1"]),
    "tolerance nan": (["solve", "good.hdf5", "--tolerance", "nan"], ["nan"]),
    "method": (
        ["solve", "good.hdf5", "--method", "gauss-siedel"],
        ["--method", "gauss-seidel"],
    ),
    "method class": (["solve", "good.hdf5", "--method", "Auto"], ["'Auto'", "auto"]),
    "time": (["solve", "good.hdf5", "--time-limit", "0"], ["time-limit"]),
    "iterations": (["solve", "good.hdf5", "--max-iterations", "0"], ["max-iterations"]),
    "set without value": (["solve", "good.hdf5", "--set", "solver.batch"], ["key=value"]),
    "set no case": (["solve", "good.hdf5", "--set", "mesh.cells=3"], ["mesh.cells=3"]),
    "set field": (
        ["solve", "good.hdf5", "--method", "gauss-seidel", "--set", "solver.bach=3"],
        ["solver.bach", "batch"],
    ),
    "set field of no method": (
        ["solve", "case.toml", "--set", "solver.batch=10"],
        ["case.toml: solver.batch: auto", "gauss-seidel", "--method"],
    ),
    "set type": (
        ["solve", "good.hdf5", "--method", "gauss-seidel", "--set", "solver.batch=x"],
        ["solver.batch", "whole number"],
    ),
    "set range": (
        ["solve", "good.hdf5", "--method", "gauss-seidel", "--set", "solver.batch=0"],
        ["batch", "0"],
    ),
    "set through a value": (
        ["solve", "case.toml", "--set", "mesh.cells.x=1"],
        ["cells", "value"],
    ),
    "set index": (["solve", "case.toml", "--set", "fix.7.on=top"], ["index", "7"]),
    "output is a file": (["solve", "good.hdf5", "-o", "text.txt"], ["text.txt", "file"]),
    "json folder": (["solve", "good.hdf5", "--json", "no/x.json"], ["no", "does not exist"]),
    "json is a folder": (["solve", "good.hdf5", "--json", "folder"], ["folder"]),
    "form": (["convert", "good.hdf5", "b.hdf5", "--form", "both"], ["both"]),
    "convert up": (["convert", "local.hdf5", "b.hdf5", "--form", "global"], ["W and q only"]),
    "convert nowhere": (["convert", "good.hdf5", "no/b.hdf5"], ["no", "does not exist"]),
    "bench nothing": (["bench"], ["FILES"]),
    "bench method": (["bench", "good.hdf5", "--methods", "auto,newton"], ["newton"]),
    "bench tolerance": (["bench", "good.hdf5", "--tolerances", "1e-3,2"], ["2"]),
    "bench no methods": (["bench", "good.hdf5", "--methods", ","], ["methods"]),
    "empty source": (["solve", ""], ["SOURCE", "empty"]),
    "empty output": (["solve", "good.hdf5", "-o", ""], ["--output", "empty"]),
    "empty json": (["solve", "good.hdf5", "--json", ""], ["--json", "empty"]),
    "empty target": (["convert", "good.hdf5", ""], ["target", "empty"]),
    "long source": (["solve", "a" * 5000 + ".toml"], ["aaa", "too long"]),
    "long part": (["info", "a" * 300], ["aaa", "too long"]),
    "long output": (["solve", "good.hdf5", "-o", "a" * 300], ["aaa", "too long"]),
    "device": (["solve", "/dev/null"], ["/dev/null", "not a regular file"]),
    "convert to itself": (["convert", "good.hdf5", "./good.hdf5"], ["this is the source"]),
    "convert to a link": (["convert", "good.hdf5", "link.hdf5"], ["this is the source"]),
    "convert to json": (["convert", "good.hdf5", "a.json"], ["a.json", ".hdf5"]),
    "convert to vtu": (["convert", "case.toml", "a.vtu"], ["a.vtu", ".hdf5"]),
    "convert to a case": (["convert", "case.toml", "case.toml"], ["case.toml", ".hdf5"]),
    "bench suffix": (["bench", "good.hdf5", "--profile", "x.foo"], ["x.foo", ".png"]),
    "info": (["info", "gone.toml"], ["gone.toml"]),
}


@pytest.mark.parametrize("name", FLAGS)
def test_broken_command(name, tmp_path, monkeypatch):
    (tmp_path / "case.toml").write_text(CASE)
    (tmp_path / "text.txt").write_text("hello")
    (tmp_path / "empty.hdf5").write_bytes(b"")
    (tmp_path / "folder").mkdir()
    write_fclib(box_tower(1), tmp_path / "good.hdf5")
    write_fclib(box_tower(1).condensed(), tmp_path / "local.hdf5")
    (tmp_path / "link.hdf5").symlink_to("good.hdf5")
    old = (tmp_path / "good.hdf5").read_bytes()
    arguments, words = FLAGS[name]
    check_refused(*run(arguments, tmp_path, monkeypatch), words)
    assert (tmp_path / "good.hdf5").read_bytes() == old


@pytest.mark.parametrize(
    "arguments", [["solve", "case.toml"], ["run", "example:release"],
                  ["follow", "case.toml", "--parameter", "friction", "--to", "0.2"]],
)  # fmt: skip
def test_a_folder_that_can_not_be_made(arguments, tmp_path, monkeypatch):
    """The disk says no after the name looked right."""
    (tmp_path / "case.toml").write_text(CASE)

    def refuse(self, *arguments, **options):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "mkdir", refuse)
    check_refused(*run([*arguments, "-o", "new"], tmp_path, monkeypatch), ["new", "denied"])


@pytest.mark.parametrize("name", ["pipe.toml", "pipe.hdf5"])
def test_pipe_as_source(name, tmp_path, monkeypatch):
    os.mkfifo(tmp_path / name)
    check_refused(*run(["solve", name], tmp_path, monkeypatch), [name, "not a regular file"])


def replaced(path, where, values):
    with h5py.File(path, "a") as file:
        del file[where]
        if values is not None:
            file[where] = values


G = "fclib_global"
FILES = {
    "no problem": (G, None, ["fclib_local or fclib_global"]),
    "no spacedim": (f"{G}/spacedim", None, ["spacedim", "missing"]),
    "spacedim 4": (f"{G}/spacedim", np.array([4]), ["spacedim", "got 4"]),
    "spacedim real": (f"{G}/spacedim", np.array([3.0]), ["spacedim", "integer"]),
    "spacedim two": (f"{G}/spacedim", np.array([3, 3]), ["spacedim"]),
    "spacedim 2": (f"{G}/spacedim", np.array([2]), ["vectors/w"]),
    "no vectors": (f"{G}/vectors", None, ["vectors", "missing"]),
    "no mu": (f"{G}/vectors/mu", None, ["mu", "missing"]),
    "mu negative": (f"{G}/vectors/mu", np.array([0.1, -0.2, 0.3, 0.4]), ["mu", "-0.2"]),
    "mu nan": (f"{G}/vectors/mu", np.array([0.1, np.nan, 0.3, 0.4]), ["mu", "nan"]),
    "mu short": (f"{G}/vectors/mu", np.array([0.1]), ["vectors/w", "got 12"]),
    "mu texts": (f"{G}/vectors/mu", np.array([b"a", b"b", b"c", b"d"]), ["mu", "|S1"]),
    "f infinite": (f"{G}/vectors/f", np.full(6, np.inf), ["vectors/f", "inf"]),
    "f long": (f"{G}/vectors/f", np.zeros(7), ["/M", "7"]),
    "f square": (f"{G}/vectors/f", np.zeros((2, 3)), ["vectors/f", "(2, 3)"]),
    "w complex": (f"{G}/vectors/w", np.zeros(12, complex), ["vectors/w", "complex"]),
    "no M": (f"{G}/M", None, ["/M", "missing"]),
    "M dataset": (f"{G}/M", np.eye(6), ["/M", "group"]),
    "no H": (f"{G}/H", None, ["/H", "missing"]),
    "no nz": (f"{G}/H/nz", None, ["H/nz", "missing"]),
    "nz -3": (f"{G}/H/nz", np.array([-3]), ["H/nz", "-3"]),
    "nz over nzmax": (f"{G}/H/nz", np.array([999]), ["H/nz", "999", "nzmax"]),
    "nz triplets too few": (f"{G}/H/nz", np.array([30]), ["H/p", "30"]),
    "m wrong": (f"{G}/H/m", np.array([5]), ["H", "5"]),
    "no p": (f"{G}/H/p", None, ["H/p", "missing"]),
    "p short": (f"{G}/H/p", np.array([0, 1], np.int32), ["H/p", "13"]),
    "p falls": (f"{G}/H/p", np.array([0, 9, *[8] * 11], np.int32), ["H/p", "fall"]),
    "p begins late": (f"{G}/H/p", np.array([1, *[9] * 12], np.int32), ["H/p", "got 1"]),
    "p beyond": (f"{G}/H/p", np.array([0, *[10**6] * 12], np.int32), ["H/p", "1000000"]),
    "p real": (f"{G}/H/p", np.zeros(13), ["H/p", "integers"]),
    "i out of range": (f"{G}/H/i", np.full(36, 6, np.int32), ["H/i", "got 6"]),
    "i negative": (f"{G}/H/i", np.full(36, -1, np.int32), ["H/i", "got -1"]),
    "i short": (f"{G}/H/i", np.zeros(3, np.int32), ["H/i", "got 3"]),
    "x nan": (f"{G}/H/x", np.full(36, np.nan), ["H/x", "nan"]),
    "x short": (f"{G}/H/x", np.zeros(3), ["H/x", "got 3"]),
    "title number": (f"{G}/info/title", np.array([1.0]), ["info/title"]),
}


@pytest.mark.parametrize("name", FILES)
def test_broken_fclib_file(name, tmp_path, monkeypatch):
    path = tmp_path / "bad.hdf5"
    write_fclib(box_tower(1), path)
    where, values, words = FILES[name]
    replaced(path, where, values)
    check_refused(*run(["solve", "bad.hdf5"], tmp_path, monkeypatch), [*words, "bad.hdf5"])


def test_file_with_both_groups(tmp_path, monkeypatch):
    path = tmp_path / "both.hdf5"
    write_fclib(box_tower(1), path)
    write_fclib(box_tower(1).condensed(), tmp_path / "local.hdf5")
    with h5py.File(path, "a") as file, h5py.File(tmp_path / "local.hdf5") as other:
        other.copy("fclib_local", file)
    check_refused(*run(["solve", "both.hdf5"], tmp_path, monkeypatch), ["both"])


def test_file_with_constraints_that_contradict(tmp_path, monkeypatch):
    path = tmp_path / "rod.hdf5"
    write_fclib(box_tower(1), path)
    with h5py.File(path, "a") as file:
        file.copy("fclib_global/H", "fclib_global/G")
        file["fclib_global/vectors/b"] = np.arange(12.0)
    words = ["fclib_global/vectors/b", "contradict"]
    check_refused(*run(["solve", "rod.hdf5"], tmp_path, monkeypatch), words)


@pytest.mark.parametrize("kept", [0.1, 0.5, 0.9, 0.99])
def test_truncated_file(kept, tmp_path, monkeypatch):
    path = tmp_path / "cut.hdf5"
    write_fclib(box_tower(1), path)
    data = path.read_bytes()
    path.write_bytes(data[: int(kept * len(data))])
    check_refused(*run(["solve", "cut.hdf5"], tmp_path, monkeypatch), ["cut.hdf5"])


def test_message_is_one_line_on_stderr(tmp_path, monkeypatch):
    result, _ = run(["solve", "gone.hdf5"], tmp_path, monkeypatch)
    assert result.stdout == ""
    assert result.stderr == "Error: gone.hdf5: no such file\n"


def test_old_results_survive_a_mistake(tmp_path, monkeypatch):
    write_fclib(box_tower(1), tmp_path / "good.hdf5")
    result, _ = run(["solve", "good.hdf5"], tmp_path, monkeypatch)
    assert result.exit_code == 0, result.output
    old = {p: p.read_bytes() for p in (tmp_path / "good-results").iterdir()}
    replaced(tmp_path / "good.hdf5", "fclib_global/vectors/mu", np.array([-1.0] * 4))
    result, new = run(["solve", "good.hdf5"], tmp_path, monkeypatch)
    check_refused(result, new, ["mu"])
    assert {p: p.read_bytes() for p in (tmp_path / "good-results").iterdir()} == old
    shutil.rmtree(tmp_path / "good-results")
