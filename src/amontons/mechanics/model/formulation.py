"""How the contact of a model is formulated: chosen once, by `formulation_of`.

    Reactions   small strains, pairs of the undeformed state; contact forces are unknowns
    Flowing     the same of bodies that yield
    Stresses    the same with Nitsche's method: stresses take the place of contact forces
    Moved       contact is found where the nodes are now, and loads may follow the bodies

Everything that differs between them is a member here, so that nobody else has to ask which.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...core.errors import InvalidInput, UnsupportedForm
from ...linear import Direct
from ...linear.grid_matrix import GridMatrix
from ...problem.friction import FrictionProblem
from ...problem.nitsche import NitscheProblem
from ...problem.protocol import Problem
from ...problem.solution import FrictionSolution
from ..elements.plasticity import is_plastic
from .assembly import Discretisation
from .doubts import CHECKS, OF_THE_START, OF_WHERE_NODES_ARE, Check
from .fields import ContactFields, recover_fields
from .held import HeldNodes
from .joint_masters import with_masters
from .large_deformation import LargeDeformation, large_deformation
from .large_fields import recover_large
from .laws import NEEDS_FORCES, OF_LINEAR_BODIES, check_law
from .nitsche import nitsche_matrices, nitsche_problem
from .nodal_forces import NodalForces, follows, nodal_forces
from .parts import FINITE, SMALL, Body, BodyForce, Contact, Load, Pressure
from .placing import Placed
from .supports import external_load
from .yielding import YieldingProblem, yielding_step
from .yielding_fields import with_flow

if TYPE_CHECKING:
    from .model import Model

Array = NDArray[np.float64]
Index = NDArray[np.int64]


class Formulation(ABC):
    """What a model asks of its formulation; one object serves all models."""

    problem: ClassVar[type[Problem]]  # what `discrete_problem` is
    finds_contact_where_nodes_are: ClassVar[bool] = False
    lacks: ClassVar[Mapping[str, str]] = {}  # numbers of laws it does not take, and why
    doubts: ClassVar[tuple[Check, ...]] = CHECKS + OF_THE_START
    keeps: ClassVar[str] = ", and keep loads and gaps where they were"  # turned bodies do

    def joined(self, contacts: tuple[Contact, ...]) -> tuple[Contact, ...]:
        """The contacts that a model has: as they are given."""
        return contacts

    def check(self, model: Model) -> None:
        """Raise InvalidInput or UnsupportedLaw for contacts and loads that do not fit."""
        for k, contact in enumerate(model.contacts):
            check_law(k, contact, model.dimension, self.lacks)
            if contact.more_masters:
                raise UnsupportedForm(
                    "several masters in one contact need kinematics='finite'; here a contact "
                    "for each of them does the same", ("contacts", k, "more_masters"),
                    f"contact on {contact.slave!r}",
                )  # fmt: skip
        for k, load in enumerate(model.loads):
            if follows(load) and not isinstance(load, Pressure):
                is_body = isinstance(load, BodyForce)
                what = "body force" if is_body else f"traction on {load.on!r}"
                raise InvalidInput(
                    "configuration 'current' needs large deformations: hyperelastic laws, or "
                    "contacts with kinematics='finite'", ("loads", k, "configuration"), what,
                )  # fmt: skip

    # ---------------------------------------------------------------- the discrete problem
    def at_load_factor(self, model: Model) -> Problem:
        """The static problem of a model at its load factor."""
        parts, factor = model.discretisation, model.load_factor
        w = factor * parts.carried
        w[:, 0] += parts.gap
        prescribed = factor * parts.prescribed
        model.check_outside(prescribed)
        return self.with_load(model, factor * parts.load, w, prescribed)

    @abstractmethod
    def with_load(self, model: Model, f: Array, w: Array, prescribed: Array) -> Any:
        """The problem with a load f (n,) and local values w (nc, d); shares its matrices.

        prescribed (dofs,): the values on the fixed dofs that f and w contain already.
        """

    def assembled(self, model: Model) -> FrictionProblem:
        """The linear problem with contact forces; raises UnsupportedForm without one."""
        raise UnsupportedForm(self.problem.unfit)

    # ---------------------------------------------------------------- loads and supports
    def nodal_load(
        self, model: Model, loads: Sequence[Load | None], *, own: bool = True
    ) -> Any:
        """Nodal forces of loads, None: of none; (dofs,), or `NodalForces` that may follow.

        own: with the loads that bodies of other programs bring.
        """
        return external_load(model.bodies, loads, model.beside, own=own)

    def lasting(self, force: Array) -> Array:
        """The part of a load (n,) of which can be proved whether contact can hold it."""
        return force

    def left(self, held: HeldNodes, prescribed: Array, is_fixed: NDArray[np.bool_]) -> Array:
        """Gaps (k,) of held nodes under prescribed displacements (dofs,), else zero."""
        return held.left(prescribed)

    # ---------------------------------------------------------------- results
    def recover(
        self, model: Model, surfaces: tuple[tuple[int, str], ...], solution: FrictionSolution
    ) -> ContactFields:
        """Fields of a solution at the load factor; surfaces: (body, slave surface) per pair."""
        return recover_fields(model, surfaces, solution)

    def forces_of_pair(
        self, placed: Placed, fields: ContactFields, numbers: Index
    ) -> tuple[Index, Array]:
        """Nodes (k,) of the slave body and the forces (k, d) on them of contacts `numbers`."""
        r = np.column_stack([fields.pressure, fields.shear]) * fields.weights[:, None]
        forces = (placed.rows.H @ r[numbers].ravel()).reshape(-1, r.shape[1])
        return np.arange(len(forces)), forces


class Reactions(Formulation):
    """Nodal and mortar contact of small strains."""

    problem = FrictionProblem

    def with_load(
        self, model: Model, f: Array, w: Array, prescribed: Array
    ) -> FrictionProblem:
        """The problem in global form, which shares its factor with others."""
        parts = model.discretisation
        guess, size = parts.continued(prescribed), None
        if model.rests_on_contact:
            guess, size = _bonded(parts, f, w)
        base = FrictionProblem.from_global(
            parts.M,  # type: ignore[arg-type]  # operators as well
            parts.H, f, w, model.law, near_nullspace=parts.near_nullspace,
            levels=parts.levels, guess=guess, name=model.name,
            load_scale=_load_size(parts, f, w), u_scale=size, structure=parts.structure,
        )  # fmt: skip
        first = model._shared.once(_first, (), base)
        return replace(base, M=first.M, H=first.H, _shared=first._shared)  # one factor for all

    def assembled(self, model: Model) -> FrictionProblem:
        """The static problem itself."""
        return model.discrete_problem()  # type: ignore[return-value]  # as `with_load` says


class Flowing(Reactions):
    """The same of bodies that yield."""

    problem = YieldingProblem
    lacks = OF_LINEAR_BODIES

    def at_load_factor(self, model: Model) -> YieldingProblem:  # type: ignore[override]
        """The static problem of a body that has not flown yet."""
        parts, factor = model.discretisation, model.load_factor
        prescribed = factor * parts.prescribed
        model.check_outside(prescribed)
        load = external_load(model.bodies, model.loads, model.beside)
        return yielding_step(model, factor * load, prescribed)

    def elastic(
        self, model: Model, load: Array, prescribed: Array, before: Array
    ) -> FrictionProblem:
        """The step without flow, as `Model.increment` has it."""
        return model.increment(load, prescribed, before)  # type: ignore[return-value]

    def assembled(self, model: Model) -> FrictionProblem:
        """Raises UnsupportedForm: tangents are linear, each at its own state."""
        raise UnsupportedForm(
            "model: bodies that yield have no one linear problem; use solve(model), whose "
            "solution.problem is the tangent one, or LinearElastic"
        )

    def recover(
        self, model: Model, surfaces: tuple[tuple[int, str], ...], solution: FrictionSolution
    ) -> ContactFields:
        """The same fields; supports hold what the flow leaves, and the history is there."""
        fields = recover_fields(model, surfaces, solution)
        return with_flow(model, fields, solution)


class Stresses(Formulation):
    """Nitsche's method at small strains."""

    problem = NitscheProblem
    lacks = NEEDS_FORCES

    def with_load(
        self, model: Model, f: Array, w: Array, prescribed: Array
    ) -> NitscheProblem:
        """The problem in displacements alone."""
        parts, held = model.discretisation, not model.rests_on_contact
        if parts.eliminated is not None:
            raise UnsupportedForm(
                "Nitsche's method takes the place of reactions by stresses, which rigid bodies "
                "and constraints do not give; use nodal or mortar contact",
                ("contacts", 0, "method"), "model",
            )  # fmt: skip
        matrices = model._shared.once(nitsche_matrices, (), parts, held)
        return nitsche_problem(parts, matrices, f, w, prescribed, model.law, model.name)


class Moved(Formulation):
    """Contact in the current configuration, of bodies with finite or with small strains."""

    problem = LargeDeformation
    finds_contact_where_nodes_are = True
    doubts = CHECKS + OF_WHERE_NODES_ARE
    keeps = ""

    def joined(self, contacts: tuple[Contact, ...]) -> tuple[Contact, ...]:
        """Contacts of one slave with several masters and one law are one: nodes carry one."""
        return with_masters(contacts)

    def check(self, model: Model) -> None:
        """Loads may follow; raises InvalidInput where kinematics do not fit laws, or differ."""
        by_law = has_finite_strains(model.bodies)
        if model.axisymmetric:
            raise InvalidInput(
                "axisymmetric bodies have contact of small kinematics; expected no "
                "kinematics='finite'", ("contacts", 0, "kinematics"), "contacts",
            )  # fmt: skip
        for name in ("references", "constraints", "springs"):
            if getattr(model, name):
                raise UnsupportedForm(
                    "small strains alone have constraints, springs and references, not "
                    "hyperelastic laws and contacts with kinematics='finite'", (name, 0),
                    "model",
                )  # fmt: skip
        for k, contact in enumerate(model.contacts):
            check_law(k, contact, model.dimension, self.lacks)
        for k, contact in enumerate(model.contacts):
            at = ("contacts", k, "kinematics")
            if contact.kinematics == SMALL and by_law:
                raise InvalidInput(
                    "hyperelastic laws and corotational bodies have contact in the current "
                    "configuration, kinematics='finite', as by default; got 'small'",
                    at, f"contact on {contact.slave!r}",
                )  # fmt: skip
            if contact.kinematics != FINITE and not by_law:
                raise InvalidInput(
                    "expected one kinematics for all of them, got both 'small' and 'finite'",
                    at, "contacts",
                )  # fmt: skip

    def at_load_factor(self, model: Model) -> LargeDeformation:
        """The static problem of large deformations."""
        return large_deformation(model)

    def with_load(self, model: Model, f: Array, w: Array, prescribed: Array) -> Problem:
        """None: it has no f and w; see `large_step`."""
        raise UnsupportedForm(self.problem.unfit)

    def assembled(self, model: Model) -> FrictionProblem:
        """Raises UnsupportedForm: tangents are linear, each at its own state."""
        raise UnsupportedForm(
            "model: hyperelastic laws and contact in the current configuration have no one "
            "linear problem; use solve(model), whose solution.problem is the tangent one, "
            "or LinearElastic and contact of small kinematics"
        )

    def nodal_load(
        self, model: Model, loads: Sequence[Load | None], *, own: bool = True
    ) -> NodalForces:
        """Nodal forces, also those that follow."""
        return nodal_forces(model, loads)

    def lasting(self, force: Array) -> Array:
        """Nothing: normals change, and nothing is proved."""
        return np.zeros_like(force)

    def left(self, held: HeldNodes, prescribed: Array, is_fixed: NDArray[np.bool_]) -> Array:
        """Gaps (k,) at the new places of the nodes."""
        return held.left_where_moved(prescribed, is_fixed)

    def recover(
        self, model: Model, surfaces: tuple[tuple[int, str], ...], solution: FrictionSolution
    ) -> ContactFields:
        """Fields in the frames of the deformed state."""
        return recover_large(model, surfaces, solution)

    def forces_of_pair(
        self, placed: Placed, fields: ContactFields, numbers: Index
    ) -> tuple[Index, Array]:
        """Forces at the slave nodes, which they act on alone."""
        return fields.node[numbers], fields.force[numbers]


def formulation_of(bodies: Sequence[Body], contacts: Sequence[Contact]) -> Formulation:
    """The one of a model; raises InvalidInput where contacts do not agree about it."""
    by_stresses = {contact.nitsche is not None for contact in contacts}
    if len(by_stresses) > 1:
        raise InvalidInput(
            "expected Nitsche's method in all of them or in none, got both", ("contacts",)
        )
    finite = has_finite_strains(bodies) or any(c.kinematics == FINITE for c in contacts)
    if any(is_plastic(body.material) for body in bodies):
        if finite or by_stresses == {True}:
            raise InvalidInput(
                "bodies that yield have small strains, contact of kinematics='small' and of "
                "method 'nodal' or 'mortar'; got hyperelastic laws beside them, "
                "kinematics='finite' or 'nitsche'", ("contacts",),
            )  # fmt: skip
        return Flowing()
    if finite:
        return Moved()
    return Stresses() if by_stresses == {True} else Reactions()


def has_finite_strains(bodies: Sequence[Body]) -> bool:
    """True where a body has a hyperelastic law, or a frame that turns with it."""
    return any(body.turns for body in bodies)


def _first(problem: FrictionProblem) -> FrictionProblem:
    """The first problem of a model: others take its matrices, and what is made of them."""
    return problem


def _load_size(parts: Discretisation, f: Array, w: Array) -> float:
    """Size of the load, also when only an overlap (gap < 0) loads the bodies: |M H overlap|."""
    overlap = np.zeros_like(w)
    overlap[:, 0] = np.minimum(w[:, 0], 0)
    return float(
        np.hypot(np.linalg.norm(f), np.linalg.norm(parts.M @ (parts.H @ overlap.ravel())))
    )


def _bonded(parts: Discretisation, f: Array, w: Array) -> tuple[Array, float]:
    """v, and size of u, when springs as stiff as the nodes bond all contacts.

    They replace those without contact, which do not exist where contact alone holds a body.
    """
    H, M = parts.H, parts.M
    near = abs(H).T @ M.diagonal()
    if parts.eliminated is not None:  # between rigid bodies, which have none
        near[near == 0] = near.max(initial=0.0) or _load_by_length(parts, f)
    stiffness = sparse.diags_array(near)
    stored = M.tocsc() if isinstance(M, GridMatrix) else M
    bonded = sparse.csc_array(stored + H @ stiffness @ H.T)
    v = Direct().factor(bonded).solve(f - H @ (stiffness @ w.ravel()))
    return v, float(np.linalg.norm(H.T @ v + w.ravel()))


def _load_by_length(parts: Discretisation, f: Array) -> float:
    """A stiffness where nothing deforms: the load moves contacts by about their distance."""
    points = parts.sites.points
    length = float(np.ptp(points, axis=0).max()) if len(points) else 0.0
    return (float(np.linalg.norm(f)) or 1.0) / (length or 1.0)
