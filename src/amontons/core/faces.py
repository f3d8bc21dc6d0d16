"""The faces of a result: methods of classes in all rooms, answered by rooms above them.

Results stand in lower rooms than pictures and files.  So that `branch.plot("b.png")` needs no
import upwards, a class says here that it can be shown, and what it looks like is found by name
when somebody asks.
"""

from __future__ import annotations

import os
from importlib import import_module
from typing import Any

HOMES = {  # the module whose function of that name answers
    "plot": "amontons.io.plots.faces", "report": "amontons.io.report.faces",
    "html": "amontons.io.notebook.html", "view": "amontons.io.notebook.view",
    "to_dataframe": "amontons.io.notebook.tables", "to_xarray": "amontons.io.notebook.tables",
    "vjp": "amontons.analysis.gradients.gradient",
    "jvp": "amontons.analysis.gradients.gradient",
}  # fmt: skip


class Told:
    """What a notebook tells of in a few lines."""

    __slots__ = ()

    def __repr__(self) -> str:
        """Its kind and the first line of its words: arrays are asked for by name."""
        return f"<{type(self).__name__}: {str(self).partition(chr(10))[0]}>"

    def _repr_html_(self) -> str:
        return _face("html")(self)


class Shown(Told):
    """A result that can be looked at."""

    __slots__ = ()

    def plot(self, path: str | os.PathLike[str] | None = None, **options: Any) -> Any:
        """A matplotlib figure of it, written to `path` too: .png, .svg or .pdf.

        options: those of the figure of its class, see `amontons.io.plots.faces`.  Raises
        InvalidInput for a suffix that is no picture's.
        """
        return _face("plot")(self, path, **options)

    def report(self, path: str | os.PathLike[str], **options: Any) -> Any:
        """Write it as a page that turns: one HTML file, complete or not at all; its path.

        options: title; units, "mm,N,s" or {"length": "mm", …}; model, of discrete results.
        Raises InvalidInput for a suffix that is no page's, and NotWritten.
        """
        return _face("report")(self, path, **options)

    def view(self, **options: Any) -> Any:
        """Show bodies and contacts in 3D, to be turned (of solved models).

        options: scalars, a field of the VTU file; magnify, of the displacement; off_screen;
        show, False returns the plotter without opening it.  Raises MissingDependency without
        PyVista, and InvalidInput for results without bodies.
        """
        return _face("view")(self, **options)

    def to_dataframe(self) -> Any:
        """A pandas table: a row for each contact, solution, point or run.

        Raises MissingDependency without pandas.
        """
        return _face("to_dataframe")(self)

    def to_xarray(self) -> Any:
        """An xarray dataset with named dimensions, of solutions and branches.

        Raises MissingDependency without xarray, and InvalidInput for other results.
        """
        return _face("to_xarray")(self)


class Differentiated(Shown):
    """A solution that can be differentiated."""

    __slots__ = ()

    def vjp(self, r: Any = None, u: Any = None, v: Any = None) -> Any:
        """The gradient of a number J, given by its slopes in r, u (nc, d) and v (n,).

        A `Gradient` with respect to loads, gaps, friction and matrices, by one linear solve
        with the transposed system at the statuses of this solution.  Raises InvalidInput for
        one that has not converged and for other shapes, UnsupportedLaw where coefficients
        follow the state, SingularOperator at a fold.
        """
        return _face("vjp")(self, r, u, v)

    def jvp(self, **changes: Any) -> Any:
        """The derivative of this solution along changes of the data, a `Derivative`.

        changes: load, of f (n,) or q (nc, d); w (nc, d), mu, bound (nc,); M, H or W, matrices
        of their shapes.  One linear solve; where contacts are on the border of their status,
        all one-sided derivatives.  Raises as `vjp`.
        """
        return _face("jvp")(self, **changes)


def _face(name: str) -> Any:
    return getattr(import_module(HOMES[name]), name)
