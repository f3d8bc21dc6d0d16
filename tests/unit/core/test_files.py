"""Replacing files: complete or not at all; links, pipes and devices stay what they are."""

import os
import re
import stat
import subprocess
import sys
import threading

import pytest

from amontons.core.errors import InvalidInput, NotWritten
from amontons.core.files import make_folder, remove_parts, replacing, write_bytes


def write(path, text="new"):
    with replacing(path) as temporary:
        temporary.write_text(text)


def test_replaces_a_file_and_leaves_nothing_else(tmp_path):
    path = tmp_path / "a.json"
    path.write_text("old")
    write(path)
    assert path.read_text() == "new"
    assert list(tmp_path.iterdir()) == [path]


def test_the_suffix_is_kept(tmp_path):
    with replacing(tmp_path / "a.png") as temporary:
        assert temporary.suffix == ".png"
        temporary.write_text("")


@pytest.mark.parametrize("exists", [True, False])
def test_a_link_stays_and_its_target_is_replaced(tmp_path, exists):
    (tmp_path / "deep").mkdir()
    target, link = tmp_path / "deep" / "real.json", tmp_path / "link.json"
    if exists:
        target.write_text("old")
    link.symlink_to("deep/real.json")
    write(link)
    assert link.is_symlink()
    assert target.read_text() == "new"


def test_links_in_a_circle(tmp_path):
    link = tmp_path / "a.json"
    link.symlink_to("a.json")
    with pytest.raises(InvalidInput, match=r"a\.json"):
        write(link)
    assert link.is_symlink()


def test_a_pipe_gets_the_bytes_and_stays(tmp_path):
    pipe = tmp_path / "pipe.json"
    os.mkfifo(pipe)
    read = []
    reader = threading.Thread(target=lambda: read.append(pipe.read_text()))
    reader.start()
    write(pipe)
    reader.join(10)
    assert read == ["new"]
    assert stat.S_ISFIFO(pipe.stat().st_mode)
    assert list(tmp_path.iterdir()) == [pipe]


def test_a_device_stays():
    write("/dev/null")
    assert stat.S_ISCHR(os.stat("/dev/null").st_mode)


@pytest.mark.parametrize("to_file", [True, False])
def test_standard_output(tmp_path, to_file):
    code = (
        "from amontons.core.files import make_folder, remove_parts, replacing, write_bytes\n"
        "with replacing('/dev/stdout') as path: path.write_text('new')\n"
        "print(' after')"
    )
    command, out = [sys.executable, "-c", code], tmp_path / "out"
    if to_file:
        with out.open("w") as stream:
            subprocess.run(command, check=True, stdout=stream)
    else:
        out.write_bytes(subprocess.run(command, check=True, capture_output=True).stdout)
    assert out.read_text() == "new after\n"


def test_an_error_leaves_the_old_file(tmp_path):
    path = tmp_path / "a.json"
    path.write_text("old")
    with pytest.raises(RuntimeError), replacing(path) as temporary:  # noqa: PT012
        temporary.write_text("half")
        raise RuntimeError("no more")
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("name", ["", "no/a.json", "a" * 300 + ".json"])
def test_what_can_not_be_written(tmp_path, name):
    with pytest.raises(InvalidInput):
        write(tmp_path / name)
    assert not list(tmp_path.iterdir())


def test_a_link_to_a_folder_that_is_missing_is_named(tmp_path):
    (tmp_path / "a.json").symlink_to(tmp_path / "no" / "a.json")
    with pytest.raises(NotWritten, match=rf"{tmp_path}/no does not exist"):
        write(tmp_path / "a.json")
    with pytest.raises(NotWritten, match=rf"the folder {tmp_path}/none does not exist"):
        write_bytes(tmp_path / "none" / "a.json", b"")


@pytest.mark.parametrize("below", [".", "deep/er"])
def test_a_folder_that_is_a_link_to_nothing(tmp_path, below):
    (tmp_path / "out").symlink_to("nowhere")
    with pytest.raises(NotWritten, match="out is a symbolic link to nowhere, which does not"):
        make_folder(tmp_path / "out" / below)
    assert (tmp_path / "out").is_symlink()


def test_a_folder_in_the_way(tmp_path):
    (tmp_path / "a.json").mkdir()
    with pytest.raises(NotWritten, match=r"a\.json: expected the name of a file"):
        write_bytes(tmp_path / "a.json", b"")


def test_only_parts_of_named_files_are_removed(tmp_path):
    parts = [".a-01234567.json", ".b-01234567.json", ".a-0123456.json", ".a-01234567", ".a"]
    for name in parts:
        (tmp_path / name).write_text("")
    remove_parts(tmp_path, [re.compile(r"a\.json")])
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(parts[1:])
