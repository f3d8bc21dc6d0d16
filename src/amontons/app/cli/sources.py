"""What a command works on: a file or a built-in example, with the flags that go with it."""

from __future__ import annotations

import os
import stat
import tomllib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import click

from ...core.errors import FileFormatError, InvalidInput, SingularOperator, UnsupportedForm
from ...core.words import near, near_file, nearest
from ...io.case import DATA, Settings, make_solver, method_class, read_case
from ...io.case.overrides import override_settings
from ...io.checkpoint import load_start
from ...io.readers import Case, read
from ...problem.nitsche import NitscheProblem
from ...solvers import Iterate


def open_source(text: str, overrides: Sequence[str] = (), method: str | None = None) -> Case:
    """Read a SOURCE; overrides are those of --set, method that of --method, which comes first.

    Options of another solver that a case has are left out then.
    """
    if method is None:
        return _opened(text, overrides, None)
    _check_method(method)
    source = _opened(text, overrides, method)
    if source.settings.method != method:
        raise InvalidInput(
            f"--method {method}: --set solver.method={source.settings.method} says another one"
        )
    return source


def _check_method(method: str) -> None:
    try:
        method_class(method)
    except InvalidInput as reason:
        raise InvalidInput(f"--method: {reason}") from None


def _opened(text: str, overrides: Sequence[str], method: str | None) -> Case:
    if text.startswith("example:"):
        return _example(text.removeprefix("example:"), overrides, method)
    if not text:
        raise FileFormatError("SOURCE: expected a file or example:NAME, got an empty text")
    path = Path(text)
    if os.path.isdir(path) and os.path.isfile(path / "solution.h5"):
        path = path / "solution.h5"
    check_is_plain(path)
    return read(path, overrides, method)


def check_is_plain(path: Path) -> None:
    """Raise FileFormatError for what is missing, can not be there, or is no plain file."""
    shown = f"{str(path)[:60]}…" if len(str(path)) > 200 else str(path)
    try:
        mode = path.stat().st_mode
    except FileNotFoundError:
        hint = near_file(path)
        if "*" in path.name:
            hint = "; no name fits this pattern, write one out"
        elif not hint and not path.suffix:
            meant = near(path.name, examples())
            one = f", such as example:{meant}" if meant else ""
            hint = f"; built-in examples are written example:NAME{one}"
        raise FileFormatError(f"{shown}: no such file{hint}") from None
    except (OSError, ValueError) as reason:
        why = getattr(reason, "strerror", None) or reason
        raise FileFormatError(f"{shown}: can not be read: {why}") from None
    if stat.S_ISDIR(mode):
        raise FileFormatError(
            f"{shown}: expected a case or FCLib file, this is a folder; name the files in it, "
            "such as folder/*.hdf5"
        )
    if not stat.S_ISREG(mode):
        raise FileFormatError(
            f"{shown}: not a regular file; save what it gives to a file first"
        )


def with_flags(
    settings: Settings, tolerance: float | None,
    max_iterations: int | None = None, time_limit: float | None = None,
    contact_tolerance: float | None = None,
) -> Settings:  # fmt: skip
    """Settings with the flags of the command line, which win; the solver is checked here."""
    for key, value in (("tolerance", tolerance), ("max_iterations", max_iterations),
                       ("time_limit", time_limit),
                       ("contact_tolerance", contact_tolerance)):  # fmt: skip
        if value is not None:
            settings = replace(settings, **{key: value})
    if not 0 < settings.tolerance < 1:
        raise InvalidInput(
            f"tolerance: expected a number between 0 and 1, got {settings.tolerance}"
        )
    single = settings.contact_tolerance
    if single is not None and not single > 0:
        raise InvalidInput(f"contact-tolerance: expected a number > 0, got {single}")
    if settings.time_limit is not None and not settings.time_limit > 0:
        raise InvalidInput(f"time-limit: expected seconds > 0, got {settings.time_limit}")
    make_solver(settings.method, settings.options)
    return settings


def start_from(file: str, opened: Case) -> Iterate:
    """The start in the file of --start."""
    try:
        found = load_start(file)
    except FileFormatError as reason:
        raise FileFormatError(f"--start {reason}") from None
    if opened.has_model and opened.model.kind is NitscheProblem and found.v is None:
        raise InvalidInput(
            f"--start {file}: no v, and the method starts from displacements"
        )
    return found


@contextmanager
def naming_culprits(
    opened: Case, source: str, method: str, start: str | None
) -> Iterator[None]:
    """Say which key, file or flag an error comes from."""
    try:
        yield
    except (UnsupportedForm, SingularOperator, InvalidInput) as error:
        where, key = f"{source}: --method {method}", opened.key_of(error.at)
        if error.at[:1] == ("start",):
            where = f"--start {start}"
        elif key:
            where = f"{opened.path}: {key}"
        raise type(error)(f"{where}: {error.text}") from error


# ----------------------------------------------------------------------------- examples
def examples() -> dict[str, str]:
    """Names of the built-in examples and one line about each."""
    from ...mechanics.ready.gallery import GALLERY

    found = {}
    for file in DATA.iterdir():
        if file.name.endswith(".toml"):
            found[file.name[:-5]] = tomllib.loads(file.read_text(encoding="utf-8"))["title"]
    found |= {name: (make.__doc__ or "").splitlines()[0] for name, make in GALLERY.items()}
    return dict(sorted(found.items()))


def list_examples() -> None:
    """Print the built-in examples, one a line."""
    known = examples()
    width = max(len(name) for name in known)
    for name, line in known.items():
        click.echo(f"{name:<{width}}  {line}")


def _example(name: str, overrides: Sequence[str], method: str | None) -> Case:
    from ...mechanics.ready.gallery import GALLERY

    if name in GALLERY:
        settings = override_settings(Settings(method or "auto"), overrides)
        return Case(GALLERY[name](), settings, name, None)
    known = examples()
    if name not in known:
        raise InvalidInput(f"example:{name}: no such example{nearest(name, known)}")
    return read_case(Path(str(DATA / f"{name}.toml")), overrides, method)
