"""Standard output that is full, closed or read by nobody; messages with an end."""

import os
import subprocess
import sys
from itertools import product

import pytest

import amontons as am
from amontons.core.errors import LONGEST, clipped, shown

FULL = "/dev/full"
pytestmark = pytest.mark.skipif(not os.path.exists(FULL), reason="no /dev/full")
COMMANDS = {
    "examples": "examples",
    "help": "solve --help",
    "solve": "solve example:hild -o out",
    "json": "solve example:hild -o out --json -",
    "info": "info example:hild",
    "mistake": "solve nosuch.toml",
}
FAST = [
    pytest.param(name, marks=[] if name in ("help", "json") else pytest.mark.slow_faults)
    for name in COMMANDS
]


def shell(command, streams, folder, **variables):
    """Exit code and what is said on stdout and stderr."""
    done = subprocess.run(
        ["bash", "-c", f"{sys.executable} -m amontons {command} {streams}"],
        capture_output=True, text=True, cwd=folder, timeout=120,
        env={**os.environ, **variables},
    )  # fmt: skip
    assert "Traceback" not in done.stderr
    assert "ignored" not in done.stderr
    return done.returncode, done.stdout, done.stderr


@pytest.mark.parametrize("name", FAST)
def test_a_full_output_is_told(tmp_path, name):
    code, _, said = shell(COMMANDS[name], f"> {FULL}", tmp_path)
    assert code == 2
    assert ("no such file" if name == "mistake" else "No space left on device") in said
    assert (tmp_path / "out" / "solution.json").exists() == (name in ("solve", "json"))


@pytest.mark.parametrize("name", FAST)
def test_an_output_that_nobody_reads_is_no_mistake(tmp_path, name):
    code, found, said = shell(COMMANDS[name], "| head -0; echo ${PIPESTATUS[0]}", tmp_path)
    assert found.strip() == ("2" if name == "mistake" else "0")
    assert said == "" or name == "mistake"


@pytest.mark.parametrize(("name", "streams"), [
    ("json", ">&-"), ("solve", ">&- 2>&- <&-"), ("mistake", f"2> {FULL}"),
    *(pytest.param(*both, marks=pytest.mark.slow_faults)
      for both in product(COMMANDS, (">&-", "2>&-", ">&- 2>&- <&-", f"2> {FULL}"))),
])  # fmt: skip
def test_closed_streams_are_no_mistake(tmp_path, name, streams):
    code, _, said = shell(COMMANDS[name], streams, tmp_path)
    assert code == (2 if name == "mistake" or (name == "json" and ">&-" in streams[:3]) else 0)
    if name == "json" and streams == ">&-":
        assert "standard output is closed" in said


def test_letters_that_the_encoding_lacks_are_replaced(tmp_path):
    code, found, _ = shell("info example:hild", "", tmp_path, PYTHONIOENCODING="ascii")
    assert code == 0
    assert "contacts" in found


CASE = """title = "a"
[mesh]
box = [1, 1]
cells = 2
[material.default]
young = 1.0
poisson = 0.3
[[fix]]
on = "top"
value = [0, -0.01]
[[contact]]
slave = "bottom"
obstacle = { plane = { normal = [0, 1] } }
friction = { coulomb = 0.3 }
"""
LONG = "y" * 100_000
HOSTILE = {
    "text": ("young = 1.0", f'young = "{LONG}"'),
    "key": ("young = 1.0", f"{LONG} = 1.0"),
    "list": ("young = 1.0", f"young = {[1] * 50_000}"),
    "hexadecimal": ("young = 1.0", f"young = 0x{'f' * 9000}"),
    "expression": ("value = [0, -0.01]", f'value = [0, "{"x+" * 50_000}x"]'),
    "surface": ('on = "top"', f'on = "{LONG}"'),
    "title": ('"a"', f'"{LONG}"'),
    "method": ('title = "a"', f'title = "a"\nsolver.method = "{LONG}"'),
    "file": ("box = [1, 1]\ncells = 2", f'file = "{LONG}"'),
    "parts of a key": ('title = "a"', f'title = "a"\na{".a" * 3000} = 1'),
    "nested tables": ("young = 1.0", f"young.a{'.a' * 3000} = 1"),
    "nested lists": ("young = 1.0", f"young = {'[' * 3000}{']' * 3000}"),
    "nested inline": ("young = 1.0", f"young = {'{a=' * 300}1{'}' * 300}"),
    "brackets": ("young = 1.0", f"young = {'[' * 90_000}"),
}


@pytest.mark.parametrize("name", HOSTILE)
def test_messages_have_an_end(tmp_path, name):
    path = tmp_path / "c.toml"
    old, new = HOSTILE[name]
    assert old in CASE
    path.write_text(CASE.replace(old, new))
    for overrides in ((), ("mesh.kind=tri",)):
        with pytest.raises(am.AmontonsError) as caught:
            am.read_case(path, overrides)
        assert len(str(caught.value)) <= LONGEST
        assert str(path) in str(caught.value)


@pytest.mark.parametrize("override", [
    f"{LONG}=1", LONG, f"material.default.young={LONG}", "a" + ".a" * 3000 + "=1",
    "mesh.cells=" + "[" * 3000, f"solver.{'a.' * 3000}b=1", "fix[" + "9" * 5000 + "].on=top",
])  # fmt: skip
def test_overrides_have_an_end_too(tmp_path, override):
    path = tmp_path / "c.toml"
    path.write_text(CASE)
    with pytest.raises(am.AmontonsError) as caught:
        am.read_case(path, (override,))
    assert len(str(caught.value)) <= LONGEST


def test_values_are_shown_with_an_end():
    deep = []
    for _ in range(100_000):
        deep = [deep]
    for value in (LONG, "0x" + LONG, 16**9000, list(range(10**5)), deep, {"a": LONG}):
        assert len(shown(value)) < 200
    assert shown(1.5) == "1.5"
    assert clipped("abc", 3) == "abc"
    assert "(99" in clipped(LONG, 100)
    while deep:  # not by the interpreter, which would go down as deep
        deep = deep.pop()
