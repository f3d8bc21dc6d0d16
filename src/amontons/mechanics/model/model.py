"""A model: assembled to one discrete problem, and its solution recovered as mechanics."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...core.errors import InvalidInput, UnsupportedForm
from ...linear import Direct
from ...linear.grid_matrix import GridMatrix
from ...problem.friction import FrictionProblem
from ...problem.law.cones import Coulomb, Law, Tresca
from ...problem.nitsche import NO_MULTIPLIERS, NitscheProblem
from ...problem.solution import FrictionSolution
from ..contact import ContactRows
from ..elements.hyperelasticity import is_hyperelastic
from .assembly import Discretisation, discretise, locate
from .balance import imbalance, in_words
from .fields import ContactFields, recover_fields
from .held import check_outside
from .large_deformation import LargeDeformation, large_deformation
from .large_fields import recover_large
from .nitsche import nitsche_matrices, nitsche_problem
from .nodal_forces import follows
from .parts import CURRENT, REFERENCE, Body, BodyForce, Contact, Fix, Load, Pressure
from .rigid import Piece, check_held, loose_modes
from .values import ScalarValue, is_number, scalar_at

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Model:
    """Elastic bodies in frictional contact with obstacles and each other.

    Gaps and normals are taken once in the reference configuration, unless the contacts or
    hyperelastic laws say otherwise: then where the nodes are, see `is_large`.  load_factor
    multiplies the loads and the prescribed displacements, not the gaps.
    """

    bodies: Sequence[Body]
    supports: Sequence[Fix] = ()
    contacts: Sequence[Contact] = ()
    loads: Sequence[Load] = ()
    load_factor: float = 1.0
    name: str = ""
    _shared: dict[str, Any] = field(default_factory=dict, init=False, repr=False)

    def __post_init__(self) -> None:
        for name, kind in (("bodies", Body), ("supports", Fix), ("contacts", Contact),
                           ("loads", Load)):  # fmt: skip
            object.__setattr__(self, name, _tuple_of(name, getattr(self, name), kind))
        if not self.bodies:
            raise InvalidInput("bodies: expected at least one, got none")
        if not self.contacts:
            raise InvalidInput("contacts: expected at least one, got none")
        dims = {body.mesh.dim for body in self.bodies}
        if len(dims) > 1:
            raise InvalidInput("bodies: expected all in 2D or all in 3D, got both")
        laws = {contact.friction for contact in self.contacts}
        if len(laws) > 1:
            raise InvalidInput("contacts: expected one friction law, got both mu and tresca")
        if len({contact.nitsche is None for contact in self.contacts}) > 1:
            raise InvalidInput(
                "contacts: expected Nitsche's method in all of them or in none, got both"
            )
        self._check_configurations()
        if not (is_number(self.load_factor) and np.isfinite(self.load_factor)):
            raise InvalidInput(
                f"load_factor: expected a finite number, got {self.load_factor!r}"
            )
        object.__setattr__(self, "bodies", _named(self.bodies))
        for name in _surfaces(*self.supports, *self.contacts, *self.loads):
            if not isinstance(name, str):
                raise InvalidInput(f"surface: expected a name, got {name!r}")
            k, surface = locate(self.bodies, name)
            self.bodies[k].mesh.surface(surface)

    @property
    def dimension(self) -> int:
        """2 or 3."""
        return self.bodies[0].mesh.dim

    @property
    def is_large(self) -> bool:
        """True where contact is found in the current configuration, and loads may follow.

        So it is with hyperelastic laws, whose strains are finite, and where contacts ask for
        it; linear elastic bodies keep their small strains.
        """
        return self._is_hyperelastic or any(c.configuration == CURRENT for c in self.contacts)

    @property
    def _is_hyperelastic(self) -> bool:
        return any(is_hyperelastic(body.material) for body in self.bodies)

    def _check_configurations(self) -> None:
        """Contacts of one configuration, one that the bodies can have, and loads that fit."""
        for contact in self.contacts if self.is_large else ():
            if contact.configuration == REFERENCE and self._is_hyperelastic:
                raise InvalidInput(
                    f"contact on {contact.slave!r}: hyperelastic laws have contact in the "
                    "current configuration; leave configuration out"
                )
            if contact.configuration != CURRENT and not self._is_hyperelastic:
                raise InvalidInput(
                    "contacts: expected one configuration for all of them, got both "
                    "'reference' and 'current'"
                )
        for load in self.loads:
            if follows(load) and not (self.is_large or isinstance(load, Pressure)):
                is_body = isinstance(load, BodyForce)
                what = "body force" if is_body else f"traction on {load.on!r}"
                raise InvalidInput(
                    f"{what}: configuration 'current' needs large deformations: hyperelastic "
                    "laws, or contacts with configuration='current'"
                )

    @property
    def discretisation(self) -> Discretisation:
        """Matrices at load factor 1, assembled once and shared by variants of this model."""
        if "all" not in self._shared:
            self._shared["all"] = discretise(
                self.bodies, self.supports, self.loads, self.contacts
            )
        return self._shared["all"]

    def assemble(self) -> FrictionProblem:
        """The discrete problem in global form, made once.

        Its unknowns are the displacements of the free dofs; prescribed ones are lifted into f
        and w.  Nodes whose normal direction is prescribed by supports are no contacts.  Raises
        SingularOperator naming the body and the rigid modes that nothing can hold, and
        UnsupportedForm with Nitsche's method, which has no reactions for unknowns.
        """
        problem = self._problem
        if isinstance(problem, NitscheProblem):
            raise UnsupportedForm(NO_MULTIPLIERS)
        return problem

    def discrete_problem(self) -> FrictionProblem | NitscheProblem | LargeDeformation:
        """What `solve` solves: as `assemble`, with Nitsche's method a NitscheProblem.

        With contact in the current configuration a LargeDeformation.
        """
        return large_deformation(self) if self.is_large else self._problem

    @cached_property
    def _problem(self) -> FrictionProblem | NitscheProblem:
        if self.is_large:
            raise UnsupportedForm(
                "model: hyperelastic laws and contact in the current configuration have no one "
                "linear problem; use solve(model), whose solution.problem is the tangent one, "
                "or LinearElastic and contact in the reference configuration"
            )
        parts = self.discretisation
        w = self.load_factor * parts.carried
        w[:, 0] += parts.gap
        prescribed = self.load_factor * parts.prescribed
        self.check_outside(prescribed)
        return self._discrete(self.load_factor * parts.load, w, prescribed)

    def check_outside(self, prescribed: Array, when: str = "") -> None:
        """Raise InvalidInput where supports push a node that they hold into the other side.

        prescribed (dofs,): displacements on the fixed dofs, else zero; when: for the message.
        """
        parts = self.discretisation
        for held in (placed.held for placed in parts.placed if placed.held is not None):
            gap = (held.left_where_moved(prescribed, parts.is_fixed) if self.is_large
                   else held.left(prescribed))  # fmt: skip
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
        f = parts.with_driven(f, parts.M, prescribed) if parts.rigid is not None else f
        return self._discrete(f, w, prescribed)

    def _discrete(
        self, f: Array, w: Array, prescribed: Array
    ) -> FrictionProblem | NitscheProblem:
        """The problem with a load f and local values w; shares its matrices with others.

        prescribed (dofs,): the values on the fixed dofs that f and w contain already.
        """
        parts, law = self.discretisation, self.law
        loose = self._loose_but_held(parts, law)
        if self.contacts[0].nitsche is not None:
            if parts.rigid is not None:
                raise UnsupportedForm(
                    "model: Nitsche's method takes the place of reactions by stresses, and a "
                    "rigid body has none; use nodal or mortar contact"
                )
            if "nitsche" not in self._shared:
                self._shared["nitsche"] = nitsche_matrices(parts, not loose)
            matrices = self._shared["nitsche"]
            return nitsche_problem(parts, matrices, f, w, prescribed, law, self.name)
        guess, size = parts.continued(prescribed), None
        if loose:
            guess, size = _bonded(parts, f, w)
        base = FrictionProblem.from_global(
            parts.M, parts.H, f, w, law, near_nullspace=parts.near_nullspace,
            levels=parts.levels, guess=guess, name=self.name,
            load_scale=_load_size(parts, f, w), u_scale=size,
        )  # fmt: skip
        first = self._shared.setdefault("problem", base)
        return replace(base, M=first.M, H=first.H, _shared=first._shared)  # one factor for all

    @cached_property
    def law(self) -> Law:
        """Friction law of all contacts: Coulomb's coefficients, or bounds in the unit of r."""
        values = []
        for contact, placed in zip(self.contacts, self.discretisation.placed, strict=True):
            name = contact.friction
            given = scalar_at(
                getattr(contact, name), placed.all_points, f"{name} on {contact.slave!r}",
                each="slave node" if contact.nitsche is None else "Gauss point",
            )  # fmt: skip
            values.append(given[placed.kept])
            if name == "tresca" and callable(contact.tresca):
                values[-1] = _mean_bound(contact, placed.rows)
        both = np.concatenate(values)
        if self.contacts[0].friction == "mu":
            return Coulomb(both)
        return Tresca(
            both * np.concatenate([p.rows.weights for p in self.discretisation.placed])
        )

    def imbalance(self, load: Array | None = None) -> str:
        """Which bodies contact alone holds, and whether it can, in words; "" if supports do.

        load (n,): forces on the free dofs, by default those of the model.  In large
        deformations, where normals change, nothing is proved.
        """
        parts = self.discretisation
        given = self.load_factor * parts.load if load is None else load
        force = np.zeros_like(parts.load) if self.is_large else given
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
        """Pieces with the rigid modes that supports leave free."""
        return loose_modes(parts.parts, parts.is_fixed)

    def _loose_but_held(self, parts: Discretisation, law: Law) -> bool:
        """True when contact alone holds a body; raises SingularOperator when nothing does."""
        acting = np.ones(parts.carried.shape, dtype=bool)
        acting[:, 1:] = (law.coefficient > 0)[:, None]
        loose = self._loose(parts)
        check_held(loose, parts.whole_H, parts.dofs, acting.ravel())
        return bool(loose)

    def check_held(self) -> None:
        """Raise SingularOperator for a body that neither supports nor contacts can hold."""
        self._loose_but_held(self.discretisation, self.law)

    def with_mu(self, mu: ScalarValue) -> Model:
        """The same model with Coulomb friction mu in all its contacts."""
        return self._variant(
            contacts=tuple(replace(c, mu=mu, tresca=None) for c in self.contacts)
        )

    def with_load(self, factor: float) -> Model:
        """The same model at a load factor on loads and prescribed displacements, not gaps."""
        return self._variant(load_factor=float(factor))

    def _variant(self, **changes: object) -> Model:
        """A copy that shares the assembled matrices, which must not depend on the changes."""
        other = replace(self, **changes)  # type: ignore[arg-type]
        object.__setattr__(other, "_shared", self._shared)
        return other

    def recover(self, solution: FrictionSolution) -> ContactFields:
        """Displacements, tractions and resultant of a solution of `assemble()`.

        With large deformations of its `large_deformation`, and frames of the deformed state.
        """
        surfaces = tuple(locate(self.bodies, c.slave) for c in self.contacts)
        if self.is_large:
            return recover_large(self, surfaces, solution)
        return recover_fields(
            self.bodies, surfaces, self.discretisation, solution, self.load_factor
        )


def _mean_bound(contact: Contact, rows: ContactRows) -> Array:
    """A bound given as a function, averaged as the gap is; dual functions may be negative."""
    given, what = contact.tresca, f"tresca on {contact.slave!r}"
    assert given is not None
    return np.maximum(rows.mean(lambda x: scalar_at(given, x, what)), 0.0)


def _surfaces(*parts: Fix | Load | Contact) -> list[str]:
    """Names of all surfaces that parts of a model refer to."""
    names: list[str] = []
    for part in parts:
        if isinstance(part, Contact):
            names += [part.slave] if part.master is None else [part.slave, part.master]
        elif not isinstance(part, BodyForce):
            names.append(part.on)
    return names


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
    if parts.rigid is not None:  # between rigid bodies, which have none
        near[near == 0] = near.max(initial=0.0) or 1.0
    stiffness = sparse.diags_array(near)
    stored = M.tocsc() if isinstance(M, GridMatrix) else M
    bonded = sparse.csc_array(stored + H @ stiffness @ H.T)
    v = Direct().factor(bonded).solve(f - H @ (stiffness @ w.ravel()))
    return v, float(np.linalg.norm(H.T @ v + w.ravel()))


def _tuple_of(name: str, values: object, kind: object) -> tuple:
    wanted = getattr(kind, "__name__", "Traction, Pressure or BodyForce")
    if isinstance(values, kind):  # type: ignore[arg-type]
        raise InvalidInput(f"{name}: expected a list of {wanted}, got one alone; write [it]")
    try:
        items = tuple(values)  # type: ignore[arg-type]
    except TypeError as error:
        raise InvalidInput(f"{name}: expected a list, got {values!r}") from error
    for item in items:
        if not isinstance(item, kind):  # type: ignore[arg-type]
            raise InvalidInput(f"{name}: expected {wanted}, got {item!r}")
    return items


def _named(bodies: tuple[Body, ...]) -> tuple[Body, ...]:
    """Bodies with distinct names: "body", or "body 1", "body 2", … where none is given."""
    several = len(bodies) > 1
    out = tuple(
        body if body.name else replace(body, name=f"body {k + 1}" if several else "body")
        for k, body in enumerate(bodies)
    )
    names = [body.name for body in out]
    if len(set(names)) < len(names):
        raise InvalidInput(f"bodies: expected distinct names, got {', '.join(names)}")
    return out
