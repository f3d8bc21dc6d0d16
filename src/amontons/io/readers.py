"""Formats in which a case may be given: a new one is a file with a reader, and a line here.

A reader takes a file, overrides as on the command line ("solver.tolerance=1e-6") and the solver
in place of that of the file, and returns a `Case`.  It raises FileFormatError that names the
file and the place in it.  Packages add formats by entry points `amontons.readers`, each of
which names a `Format`.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..core.errors import Address, AmontonsError, FileFormatError, InvalidInput
from ..core.plugins import installed, load, loaded
from ..problem.friction import FrictionProblem
from ..problem.protocol import Problem
from .units import Units

if TYPE_CHECKING:
    from ..mechanics.model import Model
    from .case.evolution import Evolution
    from .case.settings import Settings
    from .decks.about import About

GROUP = "amontons.readers"  # of entry points
MESHES = (".msh", ".vtk", ".vtu", ".stp", ".step", ".iges", ".igs", ".brep", ".stl", ".med",
          ".unv", ".bdf")  # fmt: skip
PACKED = {".gz": "gunzip", ".zip": "unzip", ".xz": "unxz", ".bz2": "bunzip2"}


@dataclass(frozen=True, eq=False)
class Case:
    """A model or a discrete problem, how to solve it, a title, and how it goes on in time.

    path: the file, None of a problem without one; tables: what a case file says, with
    overrides; key_of: the words of the file for an address in the model.  moving: the model
    as it goes on in time, where `target` is its state at the end, which can be solved for at
    once.  notes: what the file says and the case leaves out, and
    contacts that it leaves to be found, in words.  units: what they are
    called.  about: what an audit asks of a deck.
    """

    target: Model | FrictionProblem
    settings: Settings
    title: str
    path: Path | None
    evolution: Evolution | None = None
    tables: dict[str, Any] = field(default_factory=dict)
    key_of: Callable[[Address], str] = lambda at: ""
    moving: Model | None = None
    notes: tuple[str, ...] = ()
    units: Units = Units()
    about: About | None = None

    @property
    def name(self) -> str:
        """A short name, for files."""
        return self.title if self.path is None else self.path.stem

    @property
    def model(self) -> Model:
        """The model; raises InvalidInput for a discrete problem."""
        if isinstance(self.target, FrictionProblem):
            raise InvalidInput(f"{self.title}: a discrete problem, it has no model")
        return self.target

    @property
    def in_time(self) -> Model:
        """The model whose loads and supports depend on time, if any do."""
        return self.model if self.moving is None else self.moving

    @property
    def has_model(self) -> bool:
        """False for a discrete problem."""
        return not isinstance(self.target, FrictionProblem)

    def solvable(self) -> Problem:
        """What `solve` solves; assembles a model."""
        if isinstance(self.target, FrictionProblem):
            return self.target
        with self.naming_keys():
            return self.target.discrete_problem()

    def discrete(self) -> FrictionProblem:
        """The discrete problem; assembles a model.

        UnsupportedForm with Nitsche's method and with large deformations.
        """
        problem = self.solvable()
        return problem if isinstance(problem, FrictionProblem) else self.model.assemble()

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
        if not self.has_model:
            return problem
        return self.model if mu is None else self.model.with_mu(mu)

    @contextmanager
    def naming_keys(self) -> Iterator[None]:
        """Name file and key in errors that carry an address of the model."""
        try:
            yield
        except AmontonsError as error:
            key = self.key_of(error.at)
            if not key:
                raise
            raise type(error)(f"{self.path}: {key}: {error.text}") from error


Reader = Callable[[Path, Sequence[str], str | None], Case]


@dataclass(frozen=True)
class Format:
    """A format: its name with an article, how names of its files end, and its reader.

    reader: a function, or "package.module:function", imported when it is needed.  signature:
    how such files begin, whatever their names.
    """

    name: str
    suffixes: tuple[str, ...]
    reader: Reader | str
    signature: bytes = b""

    def read(self, path: Path, overrides: Sequence[str], method: str | None) -> Case:
        """The case in a file."""
        reader = load(self.reader) if isinstance(self.reader, str) else self.reader
        return reader(path, overrides, method)

    def __str__(self) -> str:
        return f"{self.name} ({', '.join(self.suffixes)})"


FORMATS = (
    Format("a TOML case file", (".toml",), "amontons.io.case:read_case"),
    Format("an FCLib HDF5 file", (".hdf5", ".h5"), "amontons.io.fclib.case:read",
           b"\x89HDF\r\n\x1a\n"),
    Format("a CalculiX or Abaqus deck", (".inp", ".inp.gz"), "amontons.io.decks.case:read"),
)  # fmt: skip


def read(path: Path, overrides: Sequence[str] = (), method: str | None = None) -> Case:
    """The case in a file of any known format; raises FileFormatError for other files."""
    return format_of(path).read(path, overrides, method)


def read_case(
    path: str | os.PathLike[str], overrides: Sequence[str] = (), method: str | None = None
) -> Case:
    """The case in a case file, an FCLib file or a deck; `.model` of it can be solved.

    path: also "example:NAME", a case that comes with amontons.  overrides such as
    "mesh.cells=32" replace single values.  method: solver in place of that of the case, before
    the overrides; options that the case has for another one go with it.  What has the suffix
    of no other format is read as TOML.  Raises FileFormatError naming the file, the key or
    line, what was found and what was expected.
    """
    text = os.fspath(path)
    named = (each for each in FORMATS if text.lower().endswith(each.suffixes))
    found = FORMATS[0] if text.startswith("example:") else next(named, FORMATS[0])
    return found.read(Path(path), overrides, method)


def format_of(path: Path) -> Format:
    """The format of a file: by how its name ends, or else by how it begins."""
    found = _fitting(path, FORMATS)
    if found is not None:
        return found
    known = (*FORMATS, *(_of_package(point) for point in installed(GROUP).values()))
    found = _fitting(path, known)
    if found is not None:
        return found
    *most, last = map(str, known)
    other = "neither" if len(known) == 2 else "none of them"
    hint = ""
    if path.suffix.lower() in MESHES:
        hint = f'; a mesh is named in a case file: [mesh] file = "{path.name}"'
    elif path.suffix.lower() in PACKED:
        hint = f"; unpack it first: {PACKED[path.suffix.lower()]} {path.name}"
    raise FileFormatError(
        f"{path}: expected {', '.join(most)} or {last}, this is {other}{hint}"
    )


def _fitting(path: Path, known: Sequence[Format]) -> Format | None:
    for each in known:
        if path.name.lower().endswith(each.suffixes):
            return each
    try:
        with path.open("rb") as file:
            begin = file.read(max(len(each.signature) for each in known))
    except OSError as reason:
        raise FileFormatError(f"{path}: can not be read: {reason.strerror}") from None
    fitting = (each for each in known if each.signature and begin.startswith(each.signature))
    return next(fitting, None)


def _of_package(point: Any) -> Format:
    found = loaded(point)
    if not isinstance(found, Format):
        raise InvalidInput(
            f"entry point '{point.name}' of {GROUP}: expected a Format, got {found!r}"
        )
    return found
