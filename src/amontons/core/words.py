"""The nearest right word for a wrong one: misspelt, or that of another program.

SYNONYMS are words that users of other programs, or of the other face of this one (Python, case
files, command line), write for ours.
"""

from __future__ import annotations

import difflib
import inspect
from collections.abc import Callable, Iterable
from functools import wraps
from pathlib import Path
from typing import Any, TypeVar

Thing = TypeVar("Thing", bound=Callable[..., Any])
SYNONYMS: dict[str, tuple[str, ...]] = {
    "e": ("young",), "emod": ("young",), "young_modulus": ("young",),
    "youngs_modulus": ("young",), "elastic_modulus": ("young",), "modulus": ("young",),
    "nu": ("poisson",), "poisson_ratio": ("poisson",), "poissons_ratio": ("poisson",),
    "rho": ("density",), "mass_density": ("density",),
    "mu": ("mu", "coulomb", "friction"), "friction": ("mu", "friction"),
    "coulomb": ("mu", "friction"),
    "friction_coefficient": ("mu", "coulomb", "friction"),
    "coefficient": ("mu", "coulomb", "friction"),
    "tau_max": ("cap",), "taumax": ("cap",), "tol": ("tolerance",), "eps": ("tolerance",),
    "rtol": ("tolerance",), "maxiter": ("max_iterations",), "max_iter": ("max_iterations",),
    "itermax": ("max_iterations",), "iterations": ("max_iterations",),
    "timeout": ("time_limit",), "max_time": ("time_limit",), "method": ("solver", "method"),
    "load": ("traction", "loads"), "loads": ("traction", "loads"), "force": ("traction",),
    "gravity": ("body_force", "BodyForce"), "weight": ("body_force", "BodyForce"),
    "dload": ("pressure",), "bc": ("fix", "supports"), "boundary": ("fix", "supports"),
    "support": ("fix", "supports"), "supports": ("fix", "supports"),
    "displacement": ("fix", "supports"), "dirichlet": ("fix", "supports"),
    "fixed": ("fix", "supports"), "plane": ("obstacle",), "sphere": ("obstacle",),
    "wall": ("obstacle",), "rigid": ("obstacle",), "slave_surface": ("slave",),
    "master_surface": ("master",), "surface": ("on", "slave"), "side": ("on",),
    "region": ("on", "region"), "time": ("t", "until"), "t_end": ("until",), "end": ("until",),
    "duration": ("until",), "dt": ("step",), "time_step": ("step",), "timestep": ("step",),
    "n": ("cells",), "resolution": ("cells",), "size": ("box", "lengths"),
    "path": ("file",), "filename": ("file",), "mesh_file": ("file",),
    "materials": ("material",), "contacts": ("contact", "contacts"),
    "gauss_seidel": ("GaussSeidel",), "newton": ("semismooth-newton", "SemismoothNewton"),
    "nsgs": ("gauss-seidel", "GaussSeidel"), "penalty": ("active-set", "ActiveSet"),
    "export": ("convert",), "plot": ("solve",), "simulate": ("run",), "evolve": ("run",),
    "continuation": ("follow",), "all-solutions": ("enumerate",), "unique": ("uniqueness",),
    "benchmark": ("bench",), "compare": ("bench",), "cpress": ("pressure",),
    "copen": ("gap",), "cslip": ("slip",), "cshear": ("shear",), "u": ("displacement",),
    "forces": ("force",), "reactions": ("r",), "stress": ("pressure",),
}  # fmt: skip


def near(word: object, known: Iterable[str]) -> str | None:
    """The word that is meant, if one can be guessed: a synonym's, or the nearest by letters."""
    names = sorted(map(str, known))
    text = str(word)
    plain = text.lower().replace("-", "_").replace(" ", "_")
    meant = [name for name in SYNONYMS.get(plain, ()) if name in names]
    if meant:
        return meant[0]
    lower = {name.lower(): name for name in names}
    close = difflib.get_close_matches(text.lower(), lower, n=1, cutoff=0.6)
    return lower[close[0]] if close else None


def nearest(word: object, known: Iterable[str]) -> str:
    """The end of an error message: '; did you mean …?' or '; known: …'."""
    names = sorted(map(str, known))
    meant = near(word, names)
    return f"; did you mean '{meant}'?" if meant else f"; known: {', '.join(names)}"


def near_file(path: Path) -> str:
    """The same for a file that is not there: one of its folder with nearly that name, or ""."""
    try:
        names = [each.name for each in path.parent.iterdir() if each.is_file()]
    except (OSError, ValueError):
        return ""
    close = difflib.get_close_matches(path.name, names[:10_000], n=1, cutoff=0.7)
    return f"; did you mean '{path.parent / close[0]}'?" if close else ""


def helpful(thing: Thing) -> Thing:
    """A function, or a class, whose TypeError for an unknown argument names the nearest one."""
    is_class = isinstance(thing, type)
    target: Callable[..., Any] = thing.__init__ if is_class else thing  # type: ignore[misc]
    names = [name for name in inspect.signature(target).parameters if name != "self"]
    title = thing.__name__

    @wraps(target)
    def called(*args: Any, **named: Any) -> Any:
        for name in named:
            if name not in names:
                raise TypeError(f"{title}: no argument '{name}'{nearest(name, names)}")
        return target(*args, **named)

    if is_class:
        thing.__init__ = called  # type: ignore[misc]
    return thing if is_class else called  # type: ignore[return-value]


def shortened(pattern: str, letters: int = 60) -> str:
    """A pattern of statuses, its end left out where it is long."""
    return pattern if len(pattern) <= letters else f"{pattern[: letters - 1]}…"
