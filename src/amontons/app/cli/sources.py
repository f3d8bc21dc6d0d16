"""What a command works on: a case file, an FCLib file, or a built-in example."""

from __future__ import annotations

import copy
import math
import os
import stat
import tomllib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

from ...core.errors import FileFormatError, InvalidInput, SingularOperator
from ...core.expressions import nearest
from ...io.case import (
    DATA,
    Settings,
    example_file,
    key_of,
    make_solver,
    method_class,
    read_case,
)
from ...io.case.overrides import set_value, split_override
from ...io.case.settings import LIMITS, NUMBERS
from ...problem.friction import FrictionProblem
from ...problem.nitsche import NitscheProblem

if TYPE_CHECKING:
    from ...mechanics.model import Model
    from ...mechanics.model.large_deformation import LargeDeformation

HDF5_SIGNATURE = b"\x89HDF\r\n\x1a\n"


@dataclass(frozen=True, eq=False)
class Source:
    """A problem, or a model to assemble, with solver settings and a short name."""

    name: str
    title: str
    problem: FrictionProblem | None = None
    model: Model | None = None
    from_fclib: bool = False
    settings: Settings = field(default_factory=Settings)
    file: str = ""  # for messages
    files: tuple[Path, ...] = ()  # what it was read from
    in_time: bool = False  # a case with [evolution]

    @property
    def target(self) -> Model | FrictionProblem:
        """What `solve` takes."""
        return self.model if self.model is not None else self.discrete()

    def discrete(self) -> FrictionProblem:
        """The discrete problem; assembles a model.

        UnsupportedForm with Nitsche's method and with large deformations.
        """
        problem = self.solvable()
        return problem if isinstance(problem, FrictionProblem) else self.model.assemble()  # type: ignore[union-attr]

    def discrete_with(self, mu: float | None) -> FrictionProblem:
        """The discrete problem with the coefficient of --mu on all contacts, if given."""
        problem = self.discrete()
        if mu is None:
            return problem
        if not (math.isfinite(mu) and mu >= 0):
            raise InvalidInput(f"--mu: expected a friction coefficient >= 0, got {mu}")
        return problem.with_mu(mu)

    def target_with(self, mu: float | None) -> Model | FrictionProblem:
        """The same before it is assembled: questions about a model name its bodies."""
        problem = self.discrete_with(mu)
        if self.model is None:
            return problem
        return self.model if mu is None else self.model.with_mu(mu)

    def solvable(self) -> FrictionProblem | NitscheProblem | LargeDeformation:
        """What `solve` solves; assembles a model."""
        if self.problem is not None:
            return self.problem
        assert self.model is not None
        with naming_keys(self.model, self.file):
            return self.model.discrete_problem()


@contextmanager
def naming_keys(model: Model, file: str) -> Iterator[None]:
    """Name file and key in errors that only show when the model of a case is assembled."""
    try:
        yield
    except (InvalidInput, SingularOperator) as reason:
        key = key_of(model, reason, wall=len(model.bodies) > 1)
        text = str(reason).removeprefix("supports: ").removeprefix("contacts: ")  # as the key
        raise type(reason)(f"{file}: {key}: {text}") from reason


def open_source(
    text: str, overrides: Sequence[str] = (), method: str | None = None
) -> Source:
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


def _opened(text: str, overrides: Sequence[str], method: str | None) -> Source:
    if text.startswith("example:"):
        return _example(text.removeprefix("example:"), overrides, method)
    if not text:
        raise FileFormatError("SOURCE: expected a file or example:NAME, got an empty text")
    path = Path(text)
    if os.path.isdir(path) and os.path.isfile(path / "solution.h5"):
        path = path / "solution.h5"
    check_is_plain(path)
    if path.suffix.lower() == ".toml":
        return _case(path, path.stem, overrides, method)
    return _fclib(path, overrides, method)


def check_is_plain(path: Path) -> None:
    """Raise FileFormatError for what is missing, can not be there, or is no plain file."""
    shown = f"{str(path)[:60]}…" if len(str(path)) > 200 else str(path)
    try:
        mode = path.stat().st_mode
    except FileNotFoundError:
        hint = "" if path.suffix else "; built-in examples are written example:NAME"
        raise FileFormatError(f"{shown}: no such file{hint}") from None
    except (OSError, ValueError) as reason:
        why = getattr(reason, "strerror", None) or reason
        raise FileFormatError(f"{shown}: can not be read: {why}") from None
    if stat.S_ISDIR(mode):
        raise FileFormatError(f"{shown}: expected a case or FCLib file, this is a folder")
    if not stat.S_ISREG(mode):
        raise FileFormatError(
            f"{shown}: not a regular file; save what it gives to a file first"
        )


def _case(path: Path, name: str, overrides: Sequence[str], method: str | None) -> Source:
    case = read_case(path, overrides, method)
    return Source(
        name,
        case.title,
        model=case.model,
        settings=case.settings,
        file=str(path),
        files=(path,),
        in_time=case.evolution is not None,
    )


def case_file(text: str) -> Path:
    """The case file that a CASE names: a path to one, or example:NAME."""
    if text.startswith("example:"):
        return example_file(text.removeprefix("example:"))
    path = Path(text)
    if path.suffix.lower() != ".toml":
        raise FileFormatError(f"{text}: expected a TOML case file (.toml) or example:NAME")
    check_is_plain(path)
    return path


def _fclib(path: Path, overrides: Sequence[str], method: str | None) -> Source:
    from ...io.fclib import read_fclib

    try:
        with path.open("rb") as file:
            known = file.read(8) == HDF5_SIGNATURE or path.suffix.lower() in (".hdf5", ".h5")
    except OSError as reason:
        raise FileFormatError(f"{path}: can not be read: {reason.strerror}") from None
    if not known:
        raise FileFormatError(
            f"{path}: expected a TOML case file (.toml) or an FCLib HDF5 file, this is neither"
        )
    try:
        problem = read_fclib(path)
    except FileFormatError as reason:
        if path.name != "solution.h5" or "fclib_local or fclib_global" not in str(reason):
            raise
        raise FileFormatError(
            f"{path}: the results of a model hold no problem to read; give the case file"
        ) from None
    settings = override_settings(Settings(method or "auto"), overrides)
    return Source(path.stem, path.stem, problem=problem, from_fclib=True, settings=settings,
                  files=(path,))  # fmt: skip


def override_settings(settings: Settings, overrides: Sequence[str]) -> Settings:
    """Settings changed by `solver.field=value`; `make_solver` checks the fields.

    By `continuation.field=value`, too.
    """
    for text in overrides:
        path, value = split_override(text)
        if path[0] == "continuation" and len(path) == 2:
            paths = {**settings.along_paths, path[1]: value}
            settings = replace(settings, along_paths=paths)
            settings.continuation()
            continue
        named = path[1:2] and path[1] in (*LIMITS, *NUMBERS, "method")
        if path[0] != "solver" or len(path) < 2 or (named and len(path) > 2):
            raise InvalidInput(
                f"--set {text}: expected solver.FIELD=VALUE or continuation.FIELD=VALUE, as "
                "this is not a case file"
            )
        key = path[1]
        if key in LIMITS:
            if type(value) is not int or value < 1:
                raise InvalidInput(f"--set {text}: expected a whole number >= 1")
            settings = replace(settings, max_iterations=value)
        elif key in NUMBERS:
            if not isinstance(value, int | float) or isinstance(value, bool):
                raise InvalidInput(f"--set {text}: expected a number")
            settings = replace(settings, **{key: float(value)})
        elif key == "method":
            method_class(str(value))
            settings = replace(settings, method=str(value))
        else:
            options = copy.deepcopy(settings.options)
            set_value(options, path[1:], value, f"--set {text}")
            settings = replace(settings, options=options)
    return settings


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


def _example(name: str, overrides: Sequence[str], method: str | None) -> Source:
    from ...mechanics.ready.gallery import GALLERY

    if name in GALLERY:
        settings = override_settings(Settings(method or "auto"), overrides)
        return Source(name, name, problem=GALLERY[name](), settings=settings)
    known = examples()
    if name not in known:
        raise InvalidInput(f"example:{name}: no such example{nearest(name, known)}")
    return _case(Path(str(DATA / f"{name}.toml")), name, overrides, method)
