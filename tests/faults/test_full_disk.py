"""Real disks of 4 to 80 kB: our words and exit code 2, or all is written."""

import subprocess

import pytest
from kills import CASE
from whole import check_whole, left_over
from worker import Worker

import amontons as am
from amontons.mechanics.ready.gallery import box_tower

SIZES = (4, 8, 12, 16, 20, 24, 28, 32, 40, 48, 60, 80)  # kB


@pytest.fixture(scope="module")
def worker(tmp_path_factory):
    folder = tmp_path_factory.mktemp("source")
    am.write_fclib(box_tower(6), folder / "tower.hdf5")
    (folder / "case.toml").write_text(CASE)
    (folder / "disk").mkdir()
    with Worker(folder) as found:
        yield found


@pytest.fixture
def disk(worker, request):
    place, size = worker.folder / "disk", request.param
    mount = ["mount", "-t", "tmpfs", "-o", f"size={size}k", "tmpfs", str(place)]
    try:
        subprocess.run(mount, check=True, capture_output=True)
    except (OSError, subprocess.CalledProcessError):
        pytest.skip("file systems can not be mounted here")
    yield place
    subprocess.run(["umount", str(place)], check=True)


@pytest.mark.slow_faults
@pytest.mark.parametrize("disk", SIZES, indirect=True)
@pytest.mark.parametrize(
    "arguments",
    [
        ("solve", "tower.hdf5", "-o", "disk/out", "--quiet"),
        ("convert", "tower.hdf5", "disk/c.hdf5", "--form", "local"),
        ("run", "case.toml", "-o", "disk/out", "--every", "2", "--quiet"),
    ],
    ids=lambda arguments: arguments[0],
)
def test_full_disk(worker, disk, arguments):
    ended = worker.run(*arguments)
    assert ended.code in (0, 2), ended.said
    if ended.code == 2:
        assert "No space left on device" in ended.said
        assert "Error: disk/" in ended.said
        assert "Traceback" not in ended.said
    assert not left_over(disk)
    for path in disk.rglob("*"):
        if path.is_file():
            check_whole(path)
