"""Every code block of README and docs runs as it stands, blocks of a page in their order."""

import glob
import os
import re
import shlex
import subprocess
import sys
import tomllib
from importlib.util import find_spec
from pathlib import Path

import pytest
from click.testing import CliRunner

import amontons as am
from amontons.app.cli import main
from amontons.io.readers import read
from amontons.mechanics.ready.gallery import random_delassus

ROOT = Path(__file__).parents[2]
MADE = {"_build", "api", "made", "outside"}  # what a build of the site leaves in docs
PAGES = sorted(
    path
    for path in (*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md"), *ROOT.glob("examples/*.md"))
    if not MADE & set(path.relative_to(ROOT / "docs").parts[:1] if "docs" in path.parts else ())
)
NEEDS = {"docs/distributed.md": ["petsc4py"], "docs/notebooks.md": ["xarray"],
         "docs/other-libraries.md": ["skfem", "ngsolve"]}  # fmt: skip
SLOW = {"docs/choosing-a-solver.md", "docs/tutorial.md"}  # commands of more than a minute
ELSEWHERE = re.compile(  # other programs, and what .ci/run and .ci/full do themselves
    r"^(\w+=\S+ +)*(python -m (pip|pytest|venv|sphinx|reproduce)|mpirun|ruff|\.ci/|MPICC=)"
    r"|^\S*PETSC|^apt-get"
)
FENCE = re.compile(r"^```(\w*)[^\n]*\n(.*?)^```", re.DOTALL | re.MULTILINE)


def blocks(path, *languages):
    return [text for name, text in FENCE.findall(path.read_text()) if name in languages]


def pages(*languages):
    for page in PAGES:
        name = str(page.relative_to(ROOT))
        slow = [pytest.mark.slow_docs] if name in SLOW and "bash" in languages else []
        if blocks(page, *languages):
            yield pytest.param(page, id=name, marks=slow)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """An empty folder with the files that pages speak of, a user's own."""
    for seed, name in enumerate(("problem", "local")):
        am.write_fclib(random_delassus(seed, 4), tmp_path / f"{name}.hdf5", title=name)
    (tmp_path / "local.hdf5").unlink()
    page = blocks(ROOT / "docs" / "extending.md", "python")
    (tmp_path / "fixed_point.py").write_text(page[0].partition("\n\nmodel = ")[0] + "\n")
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    return tmp_path


@pytest.mark.parametrize("page", list(pages("python")))
def test_python_blocks_run(page, folder):
    for needed in NEEDS.get(str(page.relative_to(ROOT)), ()):
        if find_spec(needed) is None:
            pytest.skip(f"needs {needed}")
    names = {"__name__": "block"}
    for k, block in enumerate(blocks(page, "python")):
        exec(compile(block, f"{page.name}, block {k}", "exec"), names)  # noqa: S102


def commands(page):
    """The commands of a page that are ours, long lines joined, without what installs."""
    for block in blocks(page, "bash", "console", "sh"):
        for line in block.replace("\\\n", " ").splitlines():
            for part in line.split("&&"):
                command = part.strip().removeprefix("$ ")
                if command and not command.startswith("#") and not ELSEWHERE.match(command):
                    yield command


def test_all_that_is_not_ours_is_known():
    found = {c.split()[0] for page in PAGES for c in commands(page)}
    assert found <= {"amontons", "python", ".", "cd", "export"}, found


def ended(command, folder):
    """How a command ended and what it printed: in a shell where it needs one, else here.

    Starting a process takes longer than most commands do.
    """
    words = shlex.split(command, comments=True)
    if not {"|", ">", "<", ";", "&"} & set(words):
        words = [w for word in words[1:] for w in sorted(glob.glob(word)) or [word]]
        done = CliRunner().invoke(main, words)
        return done.exit_code, done.output
    shell = f'amontons() {{ "{sys.executable}" -m amontons "$@"; }}\n'
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(folder), *sys.path])}
    done = subprocess.run(
        ["bash", "-c", shell + command], cwd=folder, env=environment, capture_output=True,
        text=True, timeout=570, check=False,
    )  # fmt: skip
    return done.returncode, done.stdout + done.stderr


@pytest.mark.parametrize("page", list(pages("bash", "console", "sh")))
def test_commands_run(page, folder):
    for command in commands(page):
        if command.startswith("amontons "):
            code, output = ended(command, folder)
            assert code in answers(command), f"{command}\n{output}"


def test_a_command_of_the_readme_runs_in_a_shell(folder):
    command = next(c for c in commands(ROOT / "README.md") if c.startswith("amontons info"))
    code, output = ended(f"set -e ; {command}", folder)
    assert code == 0, output


def answers(command):
    """0, and for questions whose answer is no, or a race that some method loses, 1."""
    return (0, 1) if re.match(r"amontons (uniqueness|bench|basins)", command) else (0,)


@pytest.mark.parametrize("page", list(pages("toml")))
def test_toml_blocks_are_toml(page):
    for block in blocks(page, "toml"):
        tomllib.loads(block)


def test_whole_case_files_are_read(folder):
    whole = 0
    for page in PAGES:
        for k, block in enumerate(blocks(page, "toml")):
            if {"mesh", "material", "contact"} <= set(tomllib.loads(block)):
                if "box" not in tomllib.loads(block)["mesh"]:
                    continue  # parts of a case, about a mesh of the user's
                path = folder / f"case{k}.toml"
                path.write_text(block)
                assert read(path).model.contacts
                whole += 1
    assert whole >= 2


@pytest.mark.parametrize("name", ["solve", "info", "convert", "bench", "run", "follow"])
def test_documented_command_has_help(name):
    result = CliRunner().invoke(main, [name, "--help"])
    assert result.exit_code == 0
    assert "Usage" in result.output


def test_links_of_the_pages_exist():
    for page in PAGES:
        text = FENCE.sub("", page.read_text())
        for target in re.findall(r"\]\((?!\w+:)([^)#\s]+)", text):
            made = target.startswith(("made/", "api/"))  # pages of the site only
            assert made or (page.parent / target).exists(), f"{page}: {target}"
