"""The hook that compiles while a wheel is built: where that fails, there is a wheel as well."""

import json
import subprocess
import sys
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

import pytest

from amontons.core.shipped import START, Shipped

ROOT = Path(__file__).parents[3]
HOOK = ROOT / "packaging/hook.py"


class App:
    """What hatchling gives a hook to speak with."""

    def __init__(self):
        self.warnings = []

    def display_warning(self, text):
        self.warnings.append(text)

    def display_info(self, text):
        pass


@pytest.fixture
def made():
    spec = spec_from_file_location("hook", HOOK)
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    app = App()
    hook = module.CompiledFunctions(str(ROOT), {}, None, None, str(ROOT), "wheel", app)
    return module, hook, app


def answer(module, monkeypatch, build):
    """Put `build(path)` in the place of the process that compiles."""

    def run(command, limit):
        return build(Path(command[2]), command, limit)

    monkeypatch.setattr(module, "finished", run)


def fails(path, command, limit):
    return subprocess.CompletedProcess(command, 1, "", "Traceback\nOSError: no room left\n")


def hangs(path, command, limit):
    assert 60 < limit < 3600
    raise subprocess.TimeoutExpired(command, limit)


def is_missing(path, command, limit):
    raise FileNotFoundError("no python")


@pytest.mark.parametrize(("build", "reason"), [
    (fails, "OSError: no room left"), (hangs, "TimeoutExpired"), (is_missing, "no python"),
])  # fmt: skip
def test_where_compiling_fails_the_wheel_is_a_pure_one_that_says_why(
    made, monkeypatch, build, reason
):
    module, hook, app = made
    answer(module, monkeypatch, build)
    data = {"force_include": {}}
    hook.initialize("standard", data)
    (path,) = data["force_include"]
    assert data["force_include"] == {path: "amontons/kernels.bin"}
    assert "pure_python" not in data and "infer_tag" not in data
    assert len(app.warnings) == 1 and reason in app.warnings[0]
    shipped = Shipped(Path(path))
    assert reason in shipped.why_not and not shipped.names
    hook.finalize("standard", data, "")
    assert not Path(path).exists()


def test_where_it_succeeds_the_wheel_is_one_of_this_platform(made, monkeypatch):
    module, hook, app = made

    def succeeds(path, command, limit):
        path.write_bytes(START)
        return subprocess.CompletedProcess(command, 0, "", "")

    answer(module, monkeypatch, succeeds)
    monkeypatch.delenv("AUDITWHEEL_PLAT", raising=False)
    data = {"force_include": {}}
    hook.initialize("standard", data)
    hook.finalize("standard", data, "")
    assert data["pure_python"] is False and data["infer_tag"] is True
    assert not app.warnings
    monkeypatch.setenv("AUDITWHEEL_PLAT", "manylinux_2_28_x86_64")
    data = {"force_include": {}}
    hook.initialize("standard", data)
    hook.finalize("standard", data, "")
    tag = f"cp{sys.version_info.major}{sys.version_info.minor}"
    assert data["tag"] == f"{tag}-{tag}-manylinux_2_28_x86_64"


@pytest.mark.parametrize(("version", "kernels"), [("editable", ""), ("standard", "none")])
def test_editable_installs_and_those_who_say_so_compile_nothing(
    made, monkeypatch, version, kernels
):
    module, hook, app = made
    answer(module, monkeypatch, lambda *_: pytest.fail("asked to compile"))
    monkeypatch.setenv("AMONTONS_KERNELS", kernels)
    data = {"force_include": {}}
    hook.initialize(version, data)
    hook.finalize(version, data, "")
    assert data == {"force_include": {}}


def test_a_file_that_can_not_be_loaded_back_fails_the_build(tmp_path):
    path = tmp_path / "kernels.bin"
    head = json.dumps({"why_not": "they are for another"}).encode()
    path.write_bytes(START + len(head).to_bytes(8, "little") + head)
    done = subprocess.run(
        [sys.executable, ROOT / "packaging/compile.py", path, ROOT / "src", "--load"],
        capture_output=True, text=True,
    )  # fmt: skip
    assert done.returncode == 1
    assert done.stderr.splitlines()[-1] == "ValueError: they are for another"
