"""Typical mistakes: every answer names the right word or says what to do."""

import re

import pytest
from click.testing import CliRunner

import amontons as am
from amontons.app.cli import main

BOX = am.box((1, 1, 1), 2)
BODY = am.Body(BOX, am.LinearElastic(200.0, 0.3))
PLANE = am.Plane(normal=(0, 0, 1))
CONTACT = am.Contact("bottom", PLANE, mu=0.3)
PRESS = am.Fix("top", (0, 0, -0.1))


def model(**parts):
    given = {"bodies": [BODY], "supports": [PRESS], "contacts": [CONTACT], "loads": ()}
    return am.Model(**(given | parts))


PYTHON = {  # what is written: (what is done, the answer)
    "solver as a word": (lambda: am.solve(model(), "gauss-seidel"), r"write GaussSeidel\(\)"),
    "solver misspelt": (lambda: am.solve(model(), "gauss-siedel"), r"write GaussSeidel\(\)"),
    "solver as a class": (lambda: am.solve(model(), am.GaussSeidel), r"write GaussSeidel\(\)"),
    "one number for a support": (lambda: am.Fix("top", -0.1), r"write \(0, 0, -0.1\)"),
    "surface misspelt": (lambda: model(supports=[am.Fix("tpo", 0)]), "did you mean 'top'"),
    "slave misspelt": (lambda: model(contacts=[am.Contact("botom", PLANE, mu=0)]),
                       "did you mean 'bottom'"),
    "mu below zero": (lambda: am.Contact("bottom", PLANE, mu=-0.3), "expected numbers >= 0"),
    "mu as text": (lambda: am.Contact("bottom", PLANE, mu="0.3"),
                   "expected a number or a function, got the text '0.3'"),
    "friction for mu": (lambda: am.Contact("bottom", PLANE, friction=0.3),
                        "no argument 'friction'; did you mean 'mu'"),
    "no friction law": (lambda: am.Contact("bottom", PLANE), "mu=0: no friction"),
    "obstacle and master": (lambda: am.Contact("bottom", PLANE, mu=0, master="top"),
                            "either an obstacle or a master"),
    "method misspelt": (lambda: am.Contact("bottom", PLANE, mu=0, method="morter"),
                        "one of nodal, mortar, nitsche"),
    "a body without a list": (lambda: am.Model(BODY), r"one alone; write \[it"),
    "a contact without a list": (lambda: model(contacts=CONTACT), r"write \[it\]"),
    "E for young": (lambda: am.LinearElastic(E=200.0, nu=0.3), "did you mean 'young'"),
    "nu for poisson": (lambda: am.LinearElastic(200.0, nu=0.3), "did you mean 'poisson'"),
    "incompressible": (lambda: am.LinearElastic(200.0, 0.5), "take 0.49 or less"),
    "young below zero": (lambda: am.LinearElastic(-200.0, 0.3), "expected a finite stress > 0"),
    "rho for density": (lambda: am.LinearElastic(200.0, 0.3, rho=1.0), "mean 'density'"),
    "a plane load in 3D": (lambda: model(loads=[am.Traction("top", (0, -1))]).assemble(),
                           "expected 3 components, got 2"),
    "a load that is no number": (
        lambda: model(loads=[am.Traction("top", (0, 0, float("nan")))]).assemble(), "finite"),
    "cells of another name": (lambda: am.box((1, 1, 1), 2, "hexa"), "expected hex or tet"),
    "n for cells": (lambda: am.box((1, 1, 1), n=2), "did you mean 'cells'"),
    "no cells": (lambda: am.box((1, 1, 1), 0), "whole number >= 1"),
    "a file for a mesh": (lambda: am.Body("part.msh", BODY.material), "read_mesh"),
    "a word for a material": (lambda: am.Body(BOX, "steel"), "expected LinearElastic"),
    "tol for tolerance": (lambda: am.solve(model(), tol=1e-6), "did you mean 'tolerance'"),
    "maxiter": (lambda: am.solve(model(), maxiter=9), "did you mean 'max_iterations'"),
    "tolerance below zero": (lambda: am.solve(model(), tolerance=-1), "between 0 and 1"),
    "a name misspelt": (lambda: am.Sovle, "has no attribute 'Sovle'; did you mean 'solve'"),
    "another style of name": (lambda: am.gauss_seidel, "did you mean 'GaussSeidel'"),
    "a case file for a problem": (lambda: am.solve("case.toml"), "expected a Model"),
    "time before the start": (lambda: list(am.evolve(model(), am.QuasiStatic(0.1), until=-1)),
                              "a time after 0"),
    "no step": (lambda: am.QuasiStatic(0), "step: expected a number > 0"),
    "dt for step": (lambda: am.QuasiStatic(dt=0.1), "did you mean 'step'"),
    "a plane without a normal": (lambda: am.Plane((0, 0, 0)), "length > 0"),
}  # fmt: skip


@pytest.mark.parametrize("name", PYTHON)
def test_in_python(name):
    done, words = PYTHON[name]
    with pytest.raises((am.AmontonsError, TypeError, AttributeError), match=words):
        done()


CASE = """[mesh]
box = [1, 1, 1]
cells = 2
[material.default]
young = 200
poisson = 0.3
[[fix]]
on = "top"
value = [0, 0, -0.1]
[[contact]]
slave = "bottom"
obstacle = { plane = { normal = [0, 0, 1] } }
friction = { coulomb = 0.3 }
"""
FRICTION = "friction = { coulomb = 0.3 }"
IN_TIME = '[evolution]\nkind = "quasi-static"\nstep = 0.1\nuntil = 1\n'
FILES = {  # what is written: (in the place of, in the file), the answer
    "material without a region": ("[material.default]", "[material]", r"\[material.default\]"),
    "yung": ("young", "yung", "did you mean 'young'"),
    "E": ("young", "E", "did you mean 'young'"),
    "nu": ("poisson", "nu", "did you mean 'poisson'"),
    "a comma": ("0.3\n[[fix", "0,3\n[[fix", "numbers have a point, not a comma"),
    "a number in quotes": ("= 200", '= "200"', "without quotes"),
    "a unit": ("= 200", '= "200 GPa"', "without quotes, units"),
    "a word without quotes": ('"bottom"', "bottom", "words stand in quotes"),
    "no digit before the point": ("poisson = 0.3", "poisson = .3", "0.1 and not .1"),
    "incompressible": ("poisson = 0.3", "poisson = 0.5", "take 0.49 or less"),
    "surface misspelt": ('"bottom"', '"botom"', "did you mean 'bottom'"),
    "[contact]": ("[[contact]]", "[contact]", r"written \[\[contact\]\]"),
    "[[contacts]]": ("[[contact]]", "[[contacts]]", "did you mean 'contact'"),
    "[fix]": ("[[fix]]", "[fix]", r"written \[\[fix\]\]"),
    "[[load]]": ("[[fix]]", "[[load]]", "did you mean 'traction'"),
    "[[force]]": ("[[fix]]", "[[force]]", "did you mean 'traction'"),
    "[[boundary]]": ("[[fix]]", "[[boundary]]", "did you mean 'fix'"),
    "plane outside": ("obstacle = { plane = { normal = [0, 0, 1] } }",
                      "plane = { normal = [0, 0, 1] }", "did you mean 'obstacle'"),
    "normal of a plane problem": ("[0, 0, 1]", "[0, 1]", "3 numbers"),
    "normal of no length": ("[0, 0, 1]", "[0, 0, 0]", "length > 0"),
    "friction as a number": (FRICTION, "friction = 0.3", r"write \{ coulomb = 0.3 \}"),
    "mu for friction": ("friction =", "mu =", "did you mean 'friction'"),
    "friction below zero": ("coulomb = 0.3", "coulomb = -0.3", ">= 0"),
    "no cells": ("cells = 2", "cells = 0", "whole number >= 1"),
    "two components": ("[0, 0, -0.1]", "[0, -0.1]", "a list of 3 numbers"),
    "one component": ("[0, 0, -0.1]", "-0.1", r"write \[0, 0, -0.1\]"),
    "time for t": ("-0.1]", '"-0.1*time"]', "did you mean 't'"),
    "a function misspelt": ("-0.1]", '"sine(x)"]', "did you mean 'sin'"),
    "a mesh that is not there": ("box = [1, 1, 1]\ncells = 2", 'file = "prt.msh"',
                                 "did you mean '.*part.msh'"),
    "a method misspelt": ("[mesh]", '[solver]\nmethod = "gauss-siedel"\n[mesh]',
                          "did you mean 'gauss-seidel'"),
    "tol": ("[mesh]", "[solver]\ntol = 1e-6\n[mesh]", "did you mean 'tolerance'"),
    "a case in time": ("[mesh]", IN_TIME + "[mesh]", "use: amontons run"),
}  # fmt: skip


@pytest.mark.parametrize("name", FILES)
def test_in_case_files(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "part.msh").write_text("")
    old, new, words = FILES[name]
    assert old in CASE
    (tmp_path / "case.toml").write_text(CASE.replace(old, new, 1))
    answer_of(["solve", "case.toml"], words)


def answer_of(arguments, words):
    """The answer of the command line: two lines at most after the usage, and exit code 2."""
    done = CliRunner().invoke(main, arguments)
    assert done.exit_code == 2, done.output
    assert re.search(words, " ".join(done.output.split())), done.output
    assert "Traceback" not in done.output


WORDS = {
    "a verb misspelt": (["slove", "case.toml"], "did you mean 'solve'"),
    "another word for a verb": (["export", "case.toml"], "did you mean 'convert'"),
    "an option misspelt": (["solve", "case.toml", "--tolerence", "1"], "--tolerance"),
    "a file misspelt": (["solve", "caes.toml"], "did you mean 'case.toml'"),
    "an example misspelt": (["solve", "example:cub"], "did you mean 'cube'"),
    "an example without example:": (["solve", "cube"], "written example:NAME"),
    "no file": (["solve"], "Missing argument 'SOURCE'"),
    "a mesh for a case": (["solve", "part.msh"], r"\[mesh\] file = \"part.msh\""),
    "a method misspelt": (["solve", "case.toml", "--method", "gaus-seidel"],
                          "did you mean 'gauss-seidel'"),
    "a method by a family": (["solve", "case.toml", "--method", "newton"],
                             "did you mean 'semismooth-newton'"),
    "a tolerance of 10": (["solve", "case.toml", "--tolerance", "10"], "between 0 and 1"),
    "--set without its table": (["solve", "case.toml", "--set", "tolerance=1e-3"],
                                "did you mean 'solver.tolerance'"),
    "run without steps": (["run", "case.toml"], r"amontons solve"),
    "a parameter": (["follow", "case.toml", "--parameter", "mu"], "'friction'"),
}  # fmt: skip


@pytest.mark.parametrize("name", WORDS)
def test_on_the_command_line(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "part.msh").write_text("")
    (tmp_path / "case.toml").write_text(CASE)
    answer_of(*WORDS[name])


def test_the_right_case_is_solved(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "case.toml").write_text(CASE)
    assert CliRunner().invoke(main, ["solve", "case.toml"]).exit_code == 0


def test_fifty_mistakes():
    assert len(PYTHON) + len(FILES) + len(WORDS) >= 50
