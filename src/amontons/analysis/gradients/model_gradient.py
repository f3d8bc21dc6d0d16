"""Derivatives of a solved model in words of mechanics: loads, supports, gaps, friction, shape.

With U = (prescribed, v) all displacements, L the adjoint of the load on all dofs (zero where
supports hold) and z that of u, a change of the model's arrays changes J by

    L . (dF - dK U + dH r) + z . (dgap n + dH^T U) + P . dprescribed + mu~ . dmu + b~ . dbound,
    P = J_U - K L + H z   at the dofs that supports prescribe.

Material, node positions and anything else of which a model is made act through K, H, F and the
gap.  `along` takes a family of models make(p) and evaluates this product at four values of p
around the model: differences of assembled arrays of fourth order, and no further solve.  That
holds for every element, load and kind of contact.  `points` has node positions one by one, from
the formula of `shape`, where that is exact.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...core.errors import InvalidInput, UnsupportedForm
from ...core.faces import Told
from ...core.warned import ResultWarning
from ...mechanics.elements.elasticity import LinearElastic, materials_by_region
from ...mechanics.model import Model
from ...mechanics.model.assembly import Discretisation
from ...mechanics.model.fields import by_body
from ...problem.friction import FrictionProblem
from ...problem.law import Law
from ...problem.law.law import BOUND, MU
from ...problem.solution import FrictionSolution
from .gradient import Differentiable, Gradient, differentiable
from .systems import rows

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Make = Callable[[float], Model]
STENCIL = ((-2, 1 / 12), (-1, -2 / 3), (1, 2 / 3), (2, -1 / 12))  # f' of fourth order, by step
RELATIVE = 1e-3  # step of a parameter, relative to it, or in its unit where it is zero


@dataclass(frozen=True, eq=False, repr=False)
class ModelGradient(Told):
    """The gradient of a number J with respect to what a model is made of.

    load: of nodal forces, (nodes, dim) per body; prescribed: of prescribed displacements, the
    same, zero at free dofs; gap, mu, bound (nc,): of gaps, coefficients and bounds (forces) of
    the contacts; problem: that of the discrete problem.
    """

    model: Model
    problem: Gradient
    of_load: Array = field(repr=False)
    of_displacement: Array = field(repr=False)

    @property
    def parts(self) -> Discretisation:
        """Arrays of the model."""
        return self.model.discretisation

    @property
    def warnings(self) -> tuple[ResultWarning, ...]:
        """What may be doubted."""
        return self.problem.warnings

    @property
    def weak(self) -> Index:
        """Contacts on the border of their status."""
        return self.problem.weak

    @property
    def distance(self) -> float | None:
        """To a singular linearisation, see `Gradient`."""
        return self.problem.distance

    @property
    def load(self) -> tuple[Array, ...]:
        """Of nodal forces, (nodes, dim) per body."""
        return by_body(self.model.bodies, self.parts, self.of_load)

    @cached_property
    def of_prescribed(self) -> Array:
        """Of prescribed displacements, (dofs,), zero on free dofs."""
        parts = self.parts
        if parts.eliminated is not None:
            raise UnsupportedForm(
                "prescribed: models with constraints, references or rigid bodies spread what "
                "supports prescribe; use along(make, at)"
            )
        whole = self.of_displacement - parts.K @ self.of_load
        whole = whole + parts.whole_H @ self.problem.w.ravel()
        return np.where(parts.is_fixed, whole, 0.0)

    @property
    def prescribed(self) -> tuple[Array, ...]:
        """The same, (nodes, dim) per body."""
        return by_body(self.model.bodies, self.parts, self.of_prescribed)

    @property
    def gap(self) -> Array:
        """Of gaps, (nc,)."""
        return self.problem.gap

    @property
    def mu(self) -> Array:
        """Of coefficients of friction, (nc,); zero where a contact has none."""
        return self.problem.mu

    @property
    def bound(self) -> Array:
        """Of bounds of friction as forces, (nc,)."""
        return self.problem.bound

    @property
    def load_factor(self) -> float:
        """Of the load factor on loads and prescribed displacements."""
        return self.along(self.model.with_load, self.model.load_factor)

    @cached_property
    def young(self) -> dict[str, float]:
        """Of young by name of the body, body.region where it has several."""
        return self._of_material("young")

    @cached_property
    def poisson(self) -> dict[str, float]:
        """Of poisson, likewise."""
        return self._of_material("poisson")

    @cached_property
    def points(self) -> tuple[Array, ...]:
        """Of node positions, (nodes, dim) per body.

        Raises UnsupportedForm, naming `along`, where other things than stiffness and gaps of
        nodal contact with obstacles depend on them.
        """
        from .shape import points_gradient

        return points_gradient(self)

    def along(self, make: Make, at: float, step: float | None = None) -> float:
        """dJ/dp of models make(p) at p = at, where make(at) is the model that was solved.

        All of make(p) have the same unknowns and contacts.  step: of differences, by default
        1e-3 of `at`.  Raises InvalidInput where it makes models of other sizes.
        """
        h = step_of(at, step)
        return sum(share * self._paired(make(at + k * h)) for k, share in STENCIL) / h

    def _paired(self, other: Model) -> float:
        """The product of the module with the arrays of another model."""
        p, g, solution = _assembled(other, self.model), self.problem, self.problem.solution
        v, r = solution.v, solution.r.ravel()
        assert v is not None and p.H is not None and p.f is not None and p.w is not None
        out = g.load @ (p.f + p.H @ r - p.M @ v) + g.w.ravel() @ (p.H.T @ v + p.w.ravel())
        mu, bound = numbers_of(p.law)
        prescribed = other.load_factor * other.discretisation.prescribed
        return float(out + g.mu @ mu + g.bound @ bound + self._directly @ prescribed)

    @property
    def _directly(self) -> Array:
        """Of prescribed displacements as part of all displacements alone."""
        return self.of_displacement

    def _of_material(self, name: str) -> dict[str, float]:
        out = {}
        for key, make, value in _materials(self.model, name):
            out[key] = self.along(make, value)
        return out

    def __str__(self) -> str:
        lines = [f"gradient with respect to {self.model.name or 'model'}: {self.problem}"]
        return "\n".join(lines)


@dataclass(frozen=True, eq=False, repr=False)
class ModelDerivative(Told):
    """The change of a solved model along one direction.

    displacement: (nodes, dim) per body; r, u (nc, d); sides: all one-sided ones, each with the
    same three; others as in `Derivative`.
    """

    displacement: tuple[Array, ...]
    r: Array
    u: Array
    sides: tuple[ModelDerivative, ...]
    complete: bool
    weak: Index
    warnings: tuple[ResultWarning, ...]
    distance: float | None

    def __str__(self) -> str:
        text = f"derivative along one direction, {len(self.sides) or 1} one-sided"
        return "\n".join([text, *map(str, self.warnings)])


def model_vjp(
    model: Model, solution: FrictionSolution, displacement: Any = None, r: Any = None,
    u: Any = None,
) -> ModelGradient:  # fmt: skip
    """See `ModelSolution.vjp`."""
    parts, kept = _checked(model), differentiable(solution)
    of_U = of_bodies("displacement", displacement, model)
    g = kept.vjp(r, u, parts.gathered(of_U))
    L = g.load
    if parts.eliminated is not None:
        L = np.where(parts.eliminated.driven, 0.0, L)
    return ModelGradient(model, g, parts.spread(L, np.zeros(parts.dofs)), of_U)


def model_jvp(
    model: Model, solution: FrictionSolution, *, load: Any = None, prescribed: Any = None,
    gap: Any = None, mu: Any = None, bound: Any = None,
    young: Mapping[str, float] | None = None, poisson: Mapping[str, float] | None = None,
    points: Any = None, along: tuple[Make, float] | None = None,
) -> ModelDerivative:  # fmt: skip
    """See `ModelSolution.jvp`."""
    parts, kept = _checked(model), differentiable(solution)
    F = of_bodies("load", load, model)
    moved = of_bodies("prescribed", prescribed, model)
    if np.any(moved[~parts.is_fixed]):
        raise InvalidInput("prescribed: expected 0 at dofs that no support holds")
    if parts.eliminated is not None and moved.any():
        raise UnsupportedForm("prescribed: use along=(make, at) for models with constraints")
    f = parts.gathered(F - parts.K @ moved) if moved.any() else parts.gathered(F)
    w = (parts.whole_H.T @ moved).reshape(parts.carried.shape)
    w[:, 0] += rows("gap", gap, w.shape[:1])
    of_mu, of_bound = rows("mu", mu, w.shape[:1]), rows("bound", bound, w.shape[:1])
    makes: list[tuple[Make, float, float]] = []
    for name, given in (("young", young), ("poisson", poisson)):
        known = {key: (make, value) for key, make, value in _materials(model, name)}
        for key, rate in (given or {}).items():
            if key not in known:
                raise InvalidInput(f"{name}: expected one of {', '.join(known)}, got {key!r}")
            makes.append((*known[key], float(rate)))
    if points is not None:
        makes.append((_moving(model, points), 0.0, 1.0))
    if along is not None:
        makes.append((along[0], along[1], 1.0))
    for make, at, rate in makes:
        change = _change(make, at, model, solution)
        f, w = f + rate * change[0], w + rate * change[1]
        of_mu, of_bound = of_mu + rate * change[2], of_bound + rate * change[3]
        moved = moved + rate * change[4]
    found = kept.jvp(load=f, w=w, mu=of_mu, bound=of_bound)

    def told(one: Any, sides: tuple[ModelDerivative, ...]) -> ModelDerivative:
        whole = parts.spread(one.v, moved)
        return ModelDerivative(by_body(model.bodies, parts, whole), one.r, one.u, sides,
                               found.complete, found.weak, found.warnings, found.distance
                               )  # fmt: skip

    return told(found, tuple(told(side, ()) for side in found.sides))


def _change(
    make: Make, at: float, model: Model, solution: FrictionSolution
) -> tuple[Array, Array, Array, Array, Array]:
    """What a parameter changes: f with -M v + H r, w with H^T v, mu, bound, prescribed."""
    h, v, r = step_of(at, None), solution.v, solution.r.ravel()
    assert v is not None
    total: list[Any] = [0.0] * 5
    for k, share in STENCIL:
        other = make(at + k * h)
        p = _assembled(other, model)
        assert p.H is not None and p.f is not None and p.w is not None
        mu, bound = numbers_of(p.law)
        now = (p.f + p.H @ r - p.M @ v, p.w + (p.H.T @ v).reshape(p.w.shape), mu, bound,
               other.load_factor * other.discretisation.prescribed)  # fmt: skip
        total = [a + share / h * b for a, b in zip(total, now, strict=True)]
    return tuple(total)  # type: ignore[return-value]


def numbers_of(law: Law) -> tuple[Array, Array]:
    """Coefficients and finite bounds of the plain law, (nc,) each."""
    parameters = law.plain.parameters
    bound = parameters[:, BOUND]
    return parameters[:, MU], np.where(np.isfinite(bound), bound, 0.0)


def _assembled(other: Model, model: Model) -> FrictionProblem:
    """The discrete problem of another model, of the same size."""
    if not isinstance(other, Model):
        raise InvalidInput(f"make: expected it to return a Model, got {type(other).__name__}")
    found, own = other.assemble(), model.assemble()
    if (found.unknowns, found.contacts) != (own.unknowns, own.contacts):
        raise InvalidInput(
            f"make: expected models with {own.unknowns} unknowns and {own.contacts} contacts, "
            f"got {found.unknowns} and {found.contacts}"
        )
    return found


def step_of(at: float, step: float | None) -> float:
    """The step of differences of a parameter; raises InvalidInput for none > 0."""
    if step is None:
        return RELATIVE * (abs(at) or 1.0)
    if not (np.isfinite(step) and step > 0):
        raise InvalidInput(f"step: expected a number > 0, got {step!r}")
    return float(step)


def _checked(model: Model) -> Discretisation:
    if model.kind is not FrictionProblem:
        raise UnsupportedForm(
            f"gradient: {model.kind.__name__} is not linear but for its contacts; expected "
            "linear elastic or rigid bodies in contact of small kinematics, method 'nodal' or "
            "'mortar'"
        )
    return model.discretisation


def of_bodies(name: str, given: Any, model: Model) -> Array:
    """Values at all nodes, (dofs,), of (nodes, dim) per body, of one array, or of (dofs,)."""
    parts, bodies = model.discretisation, model.bodies
    out = np.zeros(parts.dofs)
    if given is None:
        return out
    if isinstance(given, np.ndarray) and given.shape == (parts.dofs,):
        return rows(name, given, (parts.dofs,)).copy()
    listed: Sequence[Any] = [given] if isinstance(given, np.ndarray) else list(given)
    if len(listed) != len(bodies):
        raise InvalidInput(f"{name}: expected an array for each of {len(bodies)} bodies, "
                           f"got {len(listed)}")  # fmt: skip
    for k, (body, own) in enumerate(zip(bodies, listed, strict=True)):
        first = int(parts.offsets[k])
        value = rows(f"{name}[{k}]", own, body.mesh.points.shape)
        out[first : first + value.size] = value.ravel()
    return out


def _materials(model: Model, name: str) -> list[tuple[str, Make, float]]:
    """(key, family of models, value) of every isotropic material of a model."""
    out: list[tuple[str, Make, float]] = []
    for k, body in enumerate(model.bodies):
        laws = materials_by_region(body.mesh, body.material)
        single = not isinstance(body.material, Mapping)
        for region, law in laws.items():
            if type(law) is not LinearElastic:
                continue
            key = body.name if single else f"{body.name}.{region}"
            make = _Varied(model, k, None if single else region, name)
            out.append((key, make, float(getattr(law, name))))
            if single:
                break
    return out


@dataclass(frozen=True, eq=False)
class _Varied:
    """Models with another number of one material."""

    model: Model
    body: int
    region: str | None
    name: str

    def __call__(self, value: float) -> Model:
        body: Any = self.model.bodies[self.body]
        material: Any = body.material
        change = {self.name: value}
        if self.region is None:
            material = replace(material, **change)
        else:
            material = {**material, self.region: replace(material[self.region], **change)}
        bodies = list(self.model.bodies)
        bodies[self.body] = replace(body, material=material)
        return replace(self.model, bodies=bodies)


def _moving(model: Model, points: Any) -> Make:
    """Models whose nodes have moved along directions (nodes, dim) per body."""
    parts = model.discretisation
    whole = by_body(model.bodies, parts, of_bodies("points", points, model))

    def make(p: float) -> Model:
        bodies = [
            replace(b, mesh=replace(b.mesh, points=b.mesh.points + p * x, grid=None, levels=()))
            for b, x in zip(model.bodies, whole, strict=True)
        ]
        return replace(model, bodies=bodies)

    return make


__all__ = ["Differentiable", "ModelDerivative", "ModelGradient", "model_jvp", "model_vjp"]
