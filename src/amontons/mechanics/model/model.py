"""A model: assembled to one discrete problem, and its solution recovered as mechanics."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ...core.errors import InvalidInput, within
from ...core.faces import Told
from ...core.prepared import Prepared
from ...core.words import helpful
from ...problem.friction import FrictionProblem
from ...problem.law import Law
from ...problem.nitsche import NitscheProblem
from ...problem.protocol import Problem
from ...problem.solution import FrictionSolution
from .assembly import Discretisation, Ties, discretise, locate
from .balance import Imbalance, imbalance, in_words
from .beside import Beside
from .constraints import Constraint, Reference, Spring
from .fields import ContactFields
from .following import check_follows
from .formulation import Formulation, formulation_of
from .held import check_outside
from .joined import joined_loose, sprung_loose
from .laws import law_of, rubs
from .names import named_bodies, pair_names, tuple_of
from .parts import Body, Contact, Fix, Load, NodalForce, Temperature
from .rigid import Piece, check_held, loose_modes
from .values import ScalarValue, is_number

Array = NDArray[np.float64]
SURFACES = {  # the fields of a model's parts that name one
    "supports": ("on",), "contacts": ("slave", "master"), "loads": ("on",),
}  # fmt: skip


@helpful
@dataclass(frozen=True, eq=False)
class Model(Told):
    """Elastic bodies in frictional contact with obstacles and each other.

    Gaps and normals are taken once in the reference configuration, unless the contacts or
    hyperelastic laws say otherwise: then where the nodes are, see `is_large`.  load_factor
    multiplies the loads and the prescribed displacements, not the gaps.  pair_names: of the
    contacts, their own or those of their slaves, all different.  references, constraints,
    springs: points beside the bodies, what ties degrees of freedom to one another, and linear
    springs between them.
    """

    bodies: Sequence[Body]
    supports: Sequence[Fix] = ()
    contacts: Sequence[Contact] = ()
    loads: Sequence[Load] = ()
    load_factor: float = 1.0
    name: str = ""
    references: Sequence[Reference] = ()
    constraints: Sequence[Constraint] = ()
    springs: Sequence[Spring] = ()
    pair_names: tuple[str, ...] = field(default=(), init=False, repr=False)
    beside: Beside = field(default=None, init=False, repr=False)  # type: ignore[assignment]
    divided_at: Array | None = field(default=None, init=False, repr=False)
    _shared: Prepared = field(default_factory=Prepared, init=False, repr=False)

    def __post_init__(self) -> None:
        for name, kind in (("bodies", Body), ("supports", Fix), ("contacts", Contact),
                           ("loads", Load), ("references", Reference), ("springs", Spring),
                           ("constraints", Constraint)):  # fmt: skip
            object.__setattr__(self, name, tuple_of(name, getattr(self, name), kind))
        if not self.bodies:
            raise InvalidInput("expected at least one, got none", ("bodies",))
        dims = {body.mesh.dim for body in self.bodies}
        if len(dims) > 1:
            raise InvalidInput("expected all in 2D or all in 3D, got both", ("bodies",))
        if len({body.axisymmetric for body in self.bodies}) > 1:
            raise InvalidInput("expected all axisymmetric or none of them, got both",
                               ("bodies",))  # fmt: skip
        object.__setattr__(self, "contacts", self.formulation.joined(tuple(self.contacts)))
        self.formulation.check(self)
        object.__setattr__(self, "pair_names", pair_names(self.contacts))
        if not (is_number(self.load_factor) and np.isfinite(self.load_factor)):
            raise InvalidInput(
                f"expected a finite number, got {self.load_factor!r}", ("load_factor",)
            )
        object.__setattr__(self, "bodies", named_bodies(self.bodies))
        object.__setattr__(self, "beside", Beside.of(self.bodies, self.references,
                                                     self.constraints))  # fmt: skip
        for k, contact in enumerate(self.contacts):
            with within("contacts", k):
                check_follows(contact, self.beside, self.constraints, self.is_large)
        for part, fields in SURFACES.items():
            for k, item in enumerate(getattr(self, part)):
                for name in (name for name in fields if hasattr(item, name)):
                    with within(part, k, name):
                        self._check_surface(item, name)
        for k, contact in enumerate(self.contacts):
            for name in contact.more_masters:
                with within("contacts", k, "more_masters"):
                    j, surface = locate(self.bodies, name)
                    self.bodies[j].mesh.surface(surface)

    def _check_surface(self, part: object, field: str) -> None:
        """Raise InvalidInput for a surface that no body has, or more than one."""
        name, optional = getattr(part, field), field == "master"
        if name is None and (optional or isinstance(part, Temperature)):
            return
        if not isinstance(name, str):
            raise InvalidInput(f"surface: expected a name, got {name!r}")
        sets = isinstance(part, Fix | NodalForce | Temperature)
        if sets and self.beside.named(name) is not None:
            return
        k, surface = locate(self.bodies, name, sets=sets)
        if not sets:
            self.bodies[k].mesh.surface(surface)
        elif not len(self.bodies[k].mesh.surface_nodes(surface)):
            raise InvalidInput(f"node set {surface!r}: holds no nodes")

    @property
    def dimension(self) -> int:
        """2 or 3."""
        return self.bodies[0].mesh.dim

    @cached_property
    def formulation(self) -> Formulation:
        """What differs between models that find contact, or speak of its forces, otherwise."""
        return formulation_of(self.bodies, self.contacts)

    @property
    def axisymmetric(self) -> bool:
        """Whether the bodies are half sections of bodies of revolution, see `Body`."""
        return self.bodies[0].axisymmetric

    @property
    def is_large(self) -> bool:
        """True where contact is found in the current configuration, and loads may follow.

        So it is with hyperelastic laws, whose strains are finite, and where contacts ask for
        it; linear elastic bodies keep their small strains.
        """
        return self.formulation.finds_contact_where_nodes_are

    @property
    def kind(self) -> type[Problem]:
        """The class of the `discrete_problem`."""
        return self.formulation.problem

    @property
    def discretisation(self) -> Discretisation:
        """Matrices at load factor 1, assembled once and shared by variants of this model."""
        ties = Ties(self.references, self.constraints, self.springs)
        return self._shared.once(
            discretise, (), self.bodies, self.supports, self.loads, self.contacts, ties
        )

    def assemble(self) -> FrictionProblem:
        """The discrete problem in global form, made once.

        Its unknowns are the displacements of the free dofs; prescribed ones are lifted into f
        and w.  Nodes whose normal direction is prescribed by supports are no contacts.  Raises
        SingularOperator naming the body and the rigid modes that nothing can hold, and
        UnsupportedForm with Nitsche's method, which has no reactions for unknowns.
        """
        return self.formulation.assembled(self)

    def discrete_problem(self) -> Problem:
        """What `solve` solves: as `assemble`, with Nitsche's method a NitscheProblem.

        With contact in the current configuration a LargeDeformation.
        """
        return self._problem

    @cached_property
    def _problem(self) -> Problem:
        return self.formulation.at_load_factor(self)

    def check_outside(self, prescribed: Array, when: str = "") -> None:
        """Raise InvalidInput where supports push a node that they hold into the other side.

        prescribed (dofs,): displacements on the fixed dofs, else zero; when: for the message.
        """
        parts = self.discretisation
        for k, held in enumerate(placed.held for placed in parts.placed):
            if held is None:
                continue
            gap = self.formulation.left(held, prescribed, parts.is_fixed)
            with within("contacts", k):
                check_outside(held, gap, self.bodies, self.supports, parts.offsets, when)

    def increment(
        self, load: Array, prescribed: Array, before: Array
    ) -> FrictionProblem | NitscheProblem:
        """The discrete problem of a quasi-static step, with friction on the new slip only.

        load (dofs,): nodal forces; prescribed (dofs,): values on the fixed dofs, else zero;
        before (nc, d-1): tangential displacement at the end of the last step.
        """
        parts = self.discretisation
        w = parts.local(prescribed)
        w[:, 0] += parts.gap
        w[:, 1:] -= before
        f = parts.gathered(load - parts.K @ prescribed)
        f = parts.with_driven(f, parts.M, prescribed) if parts.eliminated is not None else f
        return self.formulation.with_load(self, f, w, prescribed)

    @cached_property
    def law(self) -> Law:
        """Laws of all contacts one after another, their stresses as forces in the unit of r."""
        return law_of(self.contacts, self.discretisation)

    def imbalance(self, load: Array | None = None) -> Imbalance | None:
        """Which bodies contact alone holds, and whether it can; None if supports hold all.

        load (n,): forces on the free dofs, by default those of the model.  In large
        deformations, where normals change, nothing is proved.
        """
        parts = self.discretisation
        given = self.load_factor * parts.load if load is None else load
        force = self.formulation.lasting(given)
        if self.law.cohesion.any():  # as `FrictionProblem.plain` has it
            tension = np.zeros_like(parts.carried)
            tension[:, 0] = self.law.cohesion
            force = force - parts.H @ tension.ravel()
        return imbalance(parts, self._loose(parts), self.law, force)

    @property
    def held_by_contact(self) -> str:
        """The bodies that contact alone holds, in words; "" if supports hold all."""
        names = in_words(self._loose(self.discretisation))
        if not names:
            return ""
        alone = len(self.bodies) == 1 and names == f"body {self.bodies[0].name!r}"
        return "a body" if alone else f"a body ({names})"  # the only one needs no name

    def _loose(self, parts: Discretisation) -> list[tuple[Piece, Array]]:
        """Pieces with the rigid modes that supports and springs leave free."""
        if parts.eliminated is not None and not parts.eliminated.only_rigid:
            return self._shared.once(joined_loose, (), parts.parts, parts.eliminated,
                                     parts.is_fixed, parts.stretched)  # fmt: skip
        if parts.stretched.shape[0]:
            return sprung_loose(parts.parts, parts.is_fixed, parts.stretched)
        return loose_modes(parts.parts, parts.is_fixed)

    @property
    def rests_on_contact(self) -> bool:
        """True when contact alone holds a body; raises SingularOperator when nothing does."""
        parts = self.discretisation
        acting = np.ones(parts.carried.shape, dtype=bool)
        acting[:, 1:] = rubs(self.law)[:, None]
        loose = self._loose(parts)
        check_held(loose, parts.whole_H, parts.dofs, acting.ravel())
        return bool(loose)

    def with_mu(self, mu: ScalarValue) -> Model:
        """The same model with Coulomb friction mu in all contacts that are not tied."""
        return self._variant(
            contacts=tuple(
                c if c.tied else
                replace(c, mu=mu, tresca=None, mu_across=None, direction=None, angle=None)
                for c in self.contacts
            )
        )

    def with_load(self, factor: float) -> Model:
        """The same model at a load factor on loads and prescribed displacements, not gaps."""
        return self._variant(load_factor=float(factor))

    def _variant(self, **changes: object) -> Model:
        """A copy that shares the assembled matrices, which must not depend on the changes."""
        other = replace(self, **changes)  # type: ignore[arg-type]
        object.__setattr__(other, "_shared", self._shared)
        object.__setattr__(other, "divided_at", self.divided_at)
        return other

    def divided(self, displacement: Array) -> Model:
        """The same whose surfaces that meet themselves have the sides of another state.

        displacement (dofs,): at the beginning of a step; else the undeformed state is meant.
        """
        other = self._variant()
        object.__setattr__(other, "divided_at", displacement)
        return other

    def recover(self, solution: FrictionSolution) -> ContactFields:
        """Displacements, tractions and resultant of a solution of `assemble()`.

        With large deformations of its `large_deformation`, and frames of the deformed state.
        """
        surfaces = tuple(locate(self.bodies, c.slave) for c in self.contacts)
        return self.formulation.recover(self, surfaces, solution)
