"""Typical mistakes of new users, and how docs/mistakes.md shows them with their answers.

`python tests/examples/mistakes.py` writes the page anew; read the difference before keeping it.
"""

import os
import re
import tempfile
from pathlib import Path

from click.testing import CliRunner

import amontons as am
from amontons.app.cli import main

PAGE = Path(__file__).parents[2] / "docs" / "mistakes.md"
HEAD = """# Typical mistakes, and what amontons says

Each answer names the nearest right word or what to do. A test checks this page, word for word.
"""
CASE = """[mesh]
box = [2, 1]
cells = [4, 2]
[material.default]
young = 1000
poisson = 0.3
[[fix]]
on = "top"
value = [0, -0.01]
[[contact]]
slave = "bottom"
obstacle = { plane = { normal = [0, 1] } }
friction = { coulomb = 0.3 }
"""
START = """
mesh = am.box((2, 1), cells=(4, 2))
steel = am.LinearElastic(young=1000, poisson=0.3)
body = am.Body(mesh, steel)
ground = am.Plane((0, 1))
push = am.Fix("top", (0, -0.01))
rub = am.Contact("bottom", ground, mu=0.3)
model = am.Model([body], supports=[push], contacts=[rub])
brick = am.Body(am.box((1, 1, 1), cells=2), steel)
floor = am.Contact("bottom", am.Plane((0, 0, 1)), mu=0.3)
"""
PYTHON = """
am.LinearElastic(E=210e9, nu=0.3)
am.LinearElastic(young="210 GPa", poisson=0.3)
am.LinearElastic(young=1000, poisson="0,3")
am.LinearElastic(young=1000, poisson=0.5)
am.LinearElastic(young=-1000, poisson=0.3)
am.LinearElastic(young=1000, poisson=0.3, density=-1)
am.LinearElastic(young=1000, poisson=0.3, plane="stres")
am.Body(mesh, "steel")
am.Body("part.msh", steel)
am.Body(mesh, {"steel": steel})
am.Body(mesh, steel, order=3)
am.box((1, -1), cells=4)
am.box((1, 1), cells=2.5)
am.box((1, 1), cells=2, kind="triangle")
am.Fix("top", -0.1)
am.Fix("top", ("free", -0.1))
am.Fix("top", (0, "-0,1"))
am.Fix("top", (0, float("nan")))
am.Model([body], supports=[am.Fix("tpo", (0, 0))], contacts=[rub])
am.Model([body], supports=[am.Fix(["top", "left"], (0, 0))], contacts=[rub])
am.Traction("top", 1.0)
am.Pressure("top", (0, -1))
am.Contact("bottom", ground, friction=0.3)
am.Contact("bottom", ground, mu=-0.3)
am.Contact("bottom", ground, mu="30%")
am.Contact("bottom", ground, mu=float("nan"))
am.Contact("bottom", ground)
am.Contact("bottom", mu=0.3)
am.Contact("bottom", "plane", mu=0.3)
am.Contact("bottom", ground, mu=0.3, method="mortr")
am.Model([body], contacts=[am.Contact("botom", ground, mu=0.3)])
am.Model(body, contacts=[rub])
am.Model([body], contacts=rub)
am.solve(am.Model([body]))
am.Model([body], contact=[rub])
am.solve(am.Model([brick], supports=[am.Fix("top", (0, -0.1))], contacts=[floor]))
am.solve(am.Model([brick], contacts=[am.Contact("bottom", ground, mu=0.3)]))
am.solve(model, solver="gauss-seidel")
am.solve(model, solver="gaus-seidel")
am.solve(model, solver=am.GaussSeidel)
am.solve(model, tol=1e-6)
am.solve(model, tolerance=0)
am.solve("case.toml")
am.solve(mesh)
am.evolve(model, "quasi-static", until=1)
am.evolve(model, am.QuasiStatic(0), until=1)
am.evolve(model, am.MoreauJean(0.1), until=1)
am.read_mesh("prat.msh")
am.read_mesh("part.step")
am.read_mesh("part.msh", glue="no")
am.read_case("cse.toml")
"""
FILES = [  # what stands in the case, what the user writes
    ("[mesh]", "[mehs]"),
    ("young = 1000", "E = 1000"),
    ("young = 1000", 'young = "210 GPa"'),
    ("poisson = 0.3", "poison = 0.3"),
    ("poisson = 0.3", "nu = 0.3"),
    ("poisson = 0.3", "poisson = 0,3"),
    ("poisson = 0.3", 'poisson = "0,3"'),
    ("[material.default]", "[material]"),
    ("[material.default]", "[material.steel]"),
    ("young = 1000", 'law = "elastic"\nyoung = 1000'),
    ("cells = [4, 2]", "cells = 4.5"),
    ("box = [2, 1]\ncells = [4, 2]", 'file = "prat.msh"'),
    ("box = [2, 1]\ncells = [4, 2]", 'file = "part.step"'),
    ("[[fix]]", "[fix]"),
    ('on = "top"', "on = top"),
    ('on = "top"', 'on = "tpo"'),
    ("value = [0, -0.01]", "value = -0.01"),
    ("value = [0, -0.01]", 'value = "0, -0.01"'),
    ("value = [0, -0.01]", 'value = ["none", -0.01]'),
    ("value = [0, -0.01]", 'value = [0, "x^2"]'),
    ("value = [0, -0.01]", "value = [0, 0, -0.01]"),
    ("[[contact]]", "[[contacts]]"),
    ("[[contact]]", "[contact]"),
    ('slave = "bottom"', 'slave = "botom"'),
    ('slave = "bottom"', 'slave = ["bottom", "left"]'),
    ("obstacle = { plane = { normal = [0, 1] } }", ""),
    ("obstacle = { plane = { normal = [0, 1] } }", 'obstacle = "plane"'),
    ("{ plane = { normal = [0, 1] } }", "{ plain = { normal = [0, 1] } }"),
    ("friction = { coulomb = 0.3 }", "friction = 0.3"),
    ("friction = { coulomb = 0.3 }", "friction = { mu = 0.3 }"),
    ("friction = { coulomb = 0.3 }", "friction = { coulomb = -0.3 }"),
    ("friction = { coulomb = 0.3 }", 'friction = { coulomb = "30%" }'),
    ("friction = { coulomb = 0.3 }", "friction = { coulomb = nan }"),
    ("[mesh]", "[gravity]\nvalue = [0, -9.81]\n[mesh]"),
    ("[mesh]", '[solver]\nmethod = "gaus-seidel"\n[mesh]'),
    ("[mesh]", "[solver]\ntol = 1e-6\n[mesh]"),
    ("[mesh]", '[evolution]\nkind = "quasistatic"\nstep = 0.1\nuntil = 1\n[mesh]'),
    ("[mesh]", '[evolution]\nkind = "quasi-static"\nstep = 0\nuntil = 1\n[mesh]'),
    ("[mesh]", '[evolution]\nkind = "quasi-static"\nstep = 1\nuntil = 0.5\n[mesh]'),
]
COMMANDS = """
slove case.toml
solve case.toml --tolerence 1e-3
solve csae.toml
solve cube
solve example:cub
solve part.msh
solve part.step
solve case.toml.gz
solve empty.hdf5
solve .
solve case.toml --method GaussSeidel
solve case.toml --tolerance 0
solve case.toml --time-limit -1
solve case.toml --set mesh.cells
solve case.toml --set mesh.cell=3
solve case.toml -o case.toml
solve case.toml --json no/such/folder.json
run case.toml
bench .
bench *.hdf5
convert case.toml out.txt
convert case.toml out.hdf5 --form lokal
enumerate example:hild --picture a.gif
enumerate case.toml --mu -1
"""


def made(folder: Path) -> Path:
    """A folder with the files that the mistakes are about."""
    (folder / "case.toml").write_text(CASE)
    (folder / "case.toml.gz").write_bytes(b"\x1f\x8b")
    (folder / "empty.hdf5").write_bytes(b"")
    (folder / "part.msh").write_text("$MeshFormat\n")
    (folder / "part.step").write_text("ISO-10303-21;\n")
    return folder


def python_answer(code: str) -> str:
    """What the user reads as the last line; "" where nothing is refused."""
    names: dict[str, object] = {"am": am}
    exec(START, names)  # noqa: S102
    try:
        eval(code, names)  # noqa: S307
    except (am.AmontonsError, TypeError, AttributeError) as error:
        return str(error)
    return ""


def file_answer(change: tuple[str, str]) -> str:
    old, new = change
    assert old in CASE
    Path("case.toml").write_text(CASE.replace(old, new, 1))
    return command_answer("info case.toml")


def command_answer(line: str) -> str:
    result = CliRunner().invoke(main, line.split())
    assert result.exit_code in (0, 2), result.exception
    text = result.stderr if result.exit_code else ""
    return " ".join(text[text.find("Error: ") + 7 :].split()) if text else ""


def mistakes():
    """(heading, what was written, answer) of all, made as they are asked for."""
    for code in PYTHON.strip().splitlines():
        yield "In Python", code, lambda code=code: python_answer(code)
    for old, new in FILES:
        title = "\n".join((new or f"(without {old.splitlines()[0]})").splitlines())
        title = " ⏎ ".join(title.split("\n"))
        yield "In a case file", title, lambda change=(old, new): file_answer(change)
    for line in COMMANDS.strip().splitlines():
        yield "On the command line", f"amontons {line}", lambda line=line: command_answer(line)


def page_entries() -> dict[str, str]:
    """Answers of the page by what was written."""
    text = PAGE.read_text(encoding="utf-8")
    return dict(re.findall(r"^- `(.+)`\n  > (.+)$", text, re.MULTILINE))


def write_page() -> None:
    lines, heading = [HEAD], ""
    for group, written, answer in mistakes():
        if group != heading:
            lines.append(f"\n## {group}" if heading else f"## {group}")
            heading = group
        lines.append(f"- `{written}`\n  > {answer()}")
        os.path.exists("case.toml") and Path("case.toml").write_text(CASE)
    PAGE.write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    os.chdir(made(Path(tempfile.mkdtemp())))
    write_page()
