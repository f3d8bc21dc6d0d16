"""The Python blocks of README and tutorial run as they stand, and the shell commands exist."""

import re
from pathlib import Path

import pytest
from click.testing import CliRunner

from amontons.app.cli import main

ROOT = Path(__file__).parents[2]
PAGES = ("README.md", "docs/tutorial.md", "docs/extending.md")


def blocks(language):
    for page in PAGES:
        text = (ROOT / page).read_text()
        for k, block in enumerate(re.findall(rf"```{language}\n(.*?)```", text, re.DOTALL)):
            yield pytest.param(block, id=f"{page}-{k}")


@pytest.mark.parametrize("block", list(blocks("python")))
def test_python_block_runs(block, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    exec(compile(block, "block", "exec"), {})  # noqa: S102


def commands():
    lines = "\n".join(p.values[0] for p in blocks("bash"))
    return sorted(set(re.findall(r"amontons (\w+)", lines)) - {"install"})


def test_documented_commands_are_found():
    assert {"solve", "info", "convert", "bench"} <= set(commands())


@pytest.mark.parametrize("name", commands())
def test_documented_command_has_help(name):
    result = CliRunner().invoke(main, [name, "--help"])
    assert result.exit_code == 0
    assert "Usage" in result.output


def test_links_of_the_pages_exist():
    for page in (*PAGES, "docs/choosing-a-solver.md", "docs/theory.md", "docs/architecture.md"):
        folder = (ROOT / page).parent
        for target in re.findall(r"\]\((?!http)([^)#]+)\)", (ROOT / page).read_text()):
            assert (folder / target).exists(), f"{page}: {target}"
