"""The solution of a model: the discrete solution, and what it means in words of mechanics."""

from __future__ import annotations

import os
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

from ..core.faces import Shown
from ..core.warned import ResultWarning
from ..core.words import near
from ..io import results as output
from ..problem.solution import FrictionSolution

if TYPE_CHECKING:
    from ..analysis.gradients.model_gradient import ModelDerivative, ModelGradient
    from ..mechanics.model import ContactFields, Model
    from ..mechanics.model.pairs import PairResult
    from ..mechanics.model.reactions import SupportResult
    from ..mechanics.model.references import ReferenceResult

OF_SOLUTION = (
    "problem", "r", "u", "v", "status", "sliding", "margin", "convergence", "converged",
    "pattern", "counts", "fclib_error", "max_penetration", "max_cone_violation",
)  # fmt: skip
OF_FIELDS = (
    "displacement", "points", "frames", "weights", "gap", "pressure", "shear", "slip", "force",
    "resultant", "load", "reaction",
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class ModelSolution(Shown):
    """A solved model.  Forwards what FrictionSolution and ContactFields know.

    displacement: (nodes, dim) per body; gap, pressure (nc,), shear, slip (nc, d-1) per contact;
    resultant (d,): force of the obstacles on the slaves, global axes; load: force and moment
    of all loads, reaction: forces of supports, (nodes, dim) per body; r, u, v, status and so
    on as in FrictionSolution.
    """

    model: Model
    solution: FrictionSolution
    fields: ContactFields
    assemble_seconds: float = 0.0

    def __getattr__(self, name: str) -> Any:
        if name in OF_SOLUTION:
            return getattr(self.solution, name)
        if name in OF_FIELDS:
            return getattr(self.fields, name)
        meant = None if name.startswith("_") else near(name, (*OF_SOLUTION, *OF_FIELDS))
        hint = f"; did you mean {meant!r}?" if meant else ""
        raise AttributeError(f"ModelSolution has no attribute {name!r}{hint}")

    def __dir__(self) -> list[str]:
        return sorted([*object.__dir__(self), *OF_SOLUTION, *OF_FIELDS])

    def __repr__(self) -> str:
        counts = ", ".join(f"{count} {name}" for name, count in self.solution.counts.items())
        outcome = self.solution.convergence.outcome.name.lower().replace("_", " ")
        return f"<ModelSolution of {self.model.name or 'model'}: {counts}; {outcome}>"

    @cached_property
    def pairs(self) -> dict[str, PairResult]:
        """Force, moment, area, pressure, slip, … of every contact pair, by its name."""
        from ..mechanics.model.pairs import pair_results

        return pair_results(self.model, self.fields)

    @cached_property
    def supports(self) -> dict[str, SupportResult]:
        """Force and moment of every support, by its name."""
        from ..mechanics.model.reactions import support_results

        return support_results(self.model, self.fields)

    @cached_property
    def references(self) -> dict[str, ReferenceResult]:
        """Displacement, rotation, force and moment of every reference and bolt, by its name."""
        from ..mechanics.model.references import reference_results

        return reference_results(self.model, self.fields)

    @cached_property
    def warnings(self) -> tuple[ResultWarning, ...]:
        """Reasons to doubt a result that has converged, each with a name."""
        from ..mechanics.model.doubts import model_warnings

        return self.solution.warnings + model_warnings(
            self.model, self.fields, self.solution.converged
        )

    def __str__(self) -> str:
        return output.describe(self.output)

    @property
    def output(self) -> output.Output:
        """What the writers need."""
        return output.Output(
            self.solution,
            self.model,
            self.fields,
            title=self.model.name or "model",
            assemble_seconds=self.assemble_seconds,
            warnings=self.warnings,
        )

    def vjp(self, displacement: Any = None, r: Any = None, u: Any = None) -> ModelGradient:
        """The gradient of a number J, given by its slopes, with respect to the model.

        displacement: slopes in the displacements, (nodes, dim) per body; r, u (nc, d).  The
        result has loads, prescribed displacements, gaps, friction, young, poisson, node
        positions, and `along(make, at)` for any parameter of a family of models: one linear
        solve for all.  Raises InvalidInput for a solution that has not converged and for other
        shapes, UnsupportedForm for large deformations, bodies that yield and Nitsche's method,
        UnsupportedLaw and SingularOperator as `FrictionSolution.vjp`.
        """
        from ..analysis.gradients.model_gradient import model_vjp

        return model_vjp(self.model, self.solution, displacement, r, u)

    def jvp(self, **changes: Any) -> ModelDerivative:
        """The derivative of this solution along changes of the model.

        changes: load, prescribed, points, (nodes, dim) per body; gap, mu, bound (nc,); young,
        poisson, a rate by body or body.region; along, (make, at) of a family of models.  One
        linear solve; where contacts are on the border of their status, all one-sided ones.
        Raises as `vjp`.
        """
        from ..analysis.gradients.model_gradient import model_jvp

        return model_jvp(self.model, self.solution, **changes)

    def write(self, path: str | os.PathLike[str]) -> None:
        """Write the solution; the suffix decides: .vtu, .h5 (or .hdf5), .json, .csv."""
        output.write(self.output, path)

    def plot(self, path: str | os.PathLike[str] | None = None, **options: Any) -> Any:
        """A figure of bodies, statuses and pressures, written to `path` too: .png, .svg, .pdf.

        options: title.
        """
        from ..io.plots.faces import plot

        return plot(self.output, path, **options)
