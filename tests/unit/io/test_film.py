"""Films of steps in time: one picture each, at the deformed state, .gif or .mp4."""

from typing import Any

import numpy as np
import pytest
from matplotlib.animation import FFMpegWriter
from PIL import Image, ImageSequence

import amontons as am


def steps(dimension=2, law=None):
    """A block that is pressed on a plane in two steps, down by 0.15 each."""
    body = am.Body(am.box((1,) * dimension, cells=2), law or am.NeoHookean(1.0, 0.3))
    up = np.eye(dimension)[-1]
    model = am.Model([body], [am.Fix("top", lambda x, t: tuple(-0.15 * t * up))],
                     [am.Contact("bottom", am.Plane(up), mu=0.3)])  # fmt: skip
    return list(am.evolve(model, am.QuasiStatic(1.0), until=2.0))


def pictures(path):
    """All frames of a film as arrays (frames, rows, columns, 3)."""
    with Image.open(path) as film:
        return np.array([np.asarray(one.convert("RGB"), dtype=float)
                         for one in ImageSequence.Iterator(film)])  # fmt: skip


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("colour", ["body", "displacement", "stress"])
def test_a_film_has_a_picture_of_every_step(tmp_path, dimension, colour):
    path = am.film(steps(dimension), tmp_path / "film.gif", colour=colour)
    frames = pictures(path)
    assert len(frames) == 2
    change = np.abs(frames[1] - frames[0]).max(axis=-1)
    assert 100 < (change > 30).sum() < 0.5 * change.size  # the body moves, the rest stays


def test_large_displacements_are_drawn_as_they_are(tmp_path):
    """The dark outline of the body is lower at the end, by a tenth of its height or more."""
    frames = pictures(am.film(steps(), tmp_path / "film.gif", colour="body"))
    tall = []
    for frame in frames:
        inside = frame[60:560, 120:700]
        rows = np.flatnonzero((np.ptp(inside, axis=-1) > 10).sum(axis=1) > 100)
        tall.append(np.ptp(rows))
    assert tall[1] / tall[0] == pytest.approx(0.7 / 0.85, abs=0.02)


def test_mistakes_are_told_before_anything_is_written(tmp_path):
    done = steps()
    for options, match in (
        ({"path": tmp_path / "film.avi"}, "path: expected .*gif"),
        ({"colour": "heat"}, "colour: expected one of body, displacement, stress"),
        ({"seconds": 0}, "seconds: expected"),
        ({"magnify": -1.0}, "magnify: expected"),
        ({"steps": []}, "steps: expected"),
        ({"steps": [1]}, "steps: expected"),
    ):
        asked: dict[str, Any] = {"steps": done, "path": tmp_path / "film.gif"} | options
        with pytest.raises(am.InvalidInput, match=match):
            am.film(**asked)
    assert not list(tmp_path.iterdir())


def test_mp4_needs_ffmpeg(tmp_path, monkeypatch):
    if FFMpegWriter.isAvailable():
        path = am.film(steps(), tmp_path / "film.mp4")
        assert path.read_bytes()[4:8] == b"ftyp"
    monkeypatch.setattr(FFMpegWriter, "isAvailable", classmethod(lambda cls: False))
    with pytest.raises(am.MissingDependency, match=r"film.mp4: .*ffmpeg"):
        am.film(steps(), tmp_path / "film.mp4")
