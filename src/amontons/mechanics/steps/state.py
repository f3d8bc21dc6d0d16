"""Where an evolution stands, and what one step of it gives."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ...core.arrays import finite, integers, number
from ...core.errors import InvalidInput, shown
from ...core.faces import Shown
from ...core.locks import KeepsLocks
from ...core.warned import ResultWarning
from ...problem.protocol import Problem
from ...problem.solution import ContactStatus, FrictionSolution
from ..contact import forces
from ..model import ContactFields, Fix, Model
from ..model.doubts import model_warnings
from ..model.faced import Faced
from ..model.fields import by_body, load_wrench
from ..model.pairs import PairResult, pair_results
from ..model.reactions import SupportResult, support_results
from ..model.references import ReferenceResult, reference_fields, reference_results
from ..model.supports import locate, prescribed_values, with_held
from ..model.values import VectorValue, check_vector, vector_at
from ..model.yielding import yielding_of
from .energy import Energies
from .passage import Passage
from .system import Motion
from .timed import part_at, steady

Array = NDArray[np.float64]
Index = NDArray[np.int64]
ARRAYS = {"displacement": 1, "velocity": 1, "force": 2, "slip": 2}  # name: dimensions
RUBBED = {"slid": 2, "path": 1, "friction_work": 1}  # the same of what no step needs
MORE = ("plastic", "growth")  # of one dimension, empty where there is none


@dataclass(frozen=True, eq=False)
class State(KeepsLocks):
    """All that the next step needs: it may be saved, and the evolution goes on from it.

    index: steps done; time; displacement, velocity (dofs,) of all bodies one after another;
    force (nc, d): contact forces on the slaves in the local frames, zero where none is active,
    after large deformations with inertia with the share of nodes that have dropped out;
    slip (nc, d-1): tangential displacement since the start.  What no step needs, zero where
    it is not given: slid (nc, d-1), what the contacts have slid, net; path (nc,), the length of
    that way; friction_work (nc,), the energy that it took.  plastic (h,): the history of bodies
    that yield, none or empty where nothing has flown.  growth (nc,): areas that stresses of the
    law acted on over undeformed ones, none or empty where they stay, `contact.grown_areas`.
    """

    index: int
    time: float
    displacement: Array
    velocity: Array
    force: Array
    slip: Array
    slid: Array = None  # type: ignore[assignment]  # zeros where none
    path: Array = None  # type: ignore[assignment]
    friction_work: Array = None  # type: ignore[assignment]
    plastic: Array = None  # type: ignore[assignment]
    growth: Array = None  # type: ignore[assignment]

    def __post_init__(self) -> None:
        index = integers("state: index", self.index)
        if index.ndim or index < 0:
            raise InvalidInput(f"state: index: expected steps done, got {shown(self.index)}")
        object.__setattr__(self, "index", int(index))
        object.__setattr__(self, "time", number("state: time", self.time))
        for name, dimensions in ARRAYS.items():
            array = finite(f"state: {name}", getattr(self, name), dimensions)
            object.__setattr__(self, name, array)
        for name, dimensions in RUBBED.items():
            given, shape = getattr(self, name), self.slip.shape[:dimensions]
            array = finite(
                f"state: {name}", np.zeros(shape) if given is None else given, dimensions
            )
            if array.shape != shape:
                raise InvalidInput(f"state: {name}: expected shape {shape}, got {array.shape}")
            object.__setattr__(self, name, array)
        for name in MORE:
            given = np.zeros(0) if getattr(self, name) is None else getattr(self, name)
            object.__setattr__(self, name, finite(f"state: {name}", given, 1))
        if self.growth.size and (self.growth.shape != self.slip.shape[:1]
                                 or not (self.growth > 0).all()):  # fmt: skip
            raise InvalidInput(f"state: growth: expected {len(self.slip)} numbers > 0, one for "
                               f"each contact, got {shown(self.growth)}")  # fmt: skip

    @property
    def is_unloaded(self) -> bool:
        """True without displacements and contact forces: no load acts in equilibrium."""
        return not (self.displacement.any() or self.force.any())


@dataclass(frozen=True, eq=False, repr=False)
class TimeStep(Shown):
    """One step: the state after it, its discrete problem's solution, its energies.

    active (k,): the contacts that are in the problem, in order; the rest is open.  gap (nc,)
    after the step, unit of length.  frames (nc, d, d): those of the deformed state where it is
    large, else those of the model hold.  passage: the path of the step where it was followed.
    reaction, load (dofs,): nodal forces of supports, and of loads, at the end of the step, in
    dynamics their means over it.  faced: what contacts face in a deformed state, None where
    the model says it.
    """

    model: Model
    state: State
    solution: FrictionSolution
    active: Index
    energies: Energies
    gap: Array
    reaction: Array
    load: Array
    frames: Array | None = None
    passage: Passage | None = None
    faced: Faced | None = None

    @property
    def time(self) -> float:
        """Time at the end of the step."""
        return self.state.time

    @property
    def problem(self) -> Problem:
        """The discrete problem: velocities and impulses in dynamics."""
        return self.solution.problem

    @property
    def displacement(self) -> tuple[Array, ...]:
        """Displacement of every body, (nodes, dim)."""
        return self._split(self.state.displacement)

    @property
    def v(self) -> tuple[Array, ...]:
        """Velocity of every body, (nodes, dim)."""
        return self._split(self.state.velocity)

    def _split(self, values: Array) -> tuple[Array, ...]:
        return by_body(self.model.bodies, self.model.discretisation, values)

    @cached_property
    def status(self) -> NDArray[np.int8]:
        """ContactStatus of all contacts, (nc,)."""
        out = np.full(len(self.gap), int(ContactStatus.OPEN), dtype=np.int8)
        out[self.active] = self.solution.status
        return out

    @cached_property
    def sliding(self) -> NDArray[np.bool_]:
        """True where the law lets a contact slide, (nc,)."""
        out = np.zeros(len(self.gap), dtype=bool)
        out[self.active] = self.solution.sliding
        return out

    @cached_property
    def fields(self) -> ContactFields:
        """Displacements, tractions and slip since the start, for writers and plots."""
        sites = self.model.discretisation.sites
        surfaces = [locate(self.model.bodies, c.slave) for c in self.model.contacts]
        frames = sites.frames if self.frames is None else self.frames
        force = self._force
        weights = sites.weights if self.faced is None else self.faced.areas
        traction = self.state.force / weights[:, None]
        return ContactFields(
            displacement=self.displacement, points=sites.points,
            frames=frames, weights=weights, gap=self.gap, pressure=traction[:, 0],
            shear=traction[:, 1:], slip=self.state.slip, force=force,
            resultant=force.sum(axis=0),
            body=sites.body, node=sites.node,
            facets=tuple((k, self.model.bodies[k].mesh.surface(name)) for k, name in surfaces),
            status=self.status, slid=self.state.slid, path=self.state.path,
            friction_work=self.state.friction_work, reaction=self._split(self.reaction),
            load=load_wrench(self.model, self.displacement, self.load), plastic=self._plastic,
            faced=self.faced,
            references=reference_fields(self.model.discretisation, self.state.displacement,
                                        self.reaction, self.load),
        )  # fmt: skip

    @property
    def _plastic(self) -> dict[int, Array] | None:
        """Histories of the bodies that yield, by number."""
        if not self.state.plastic.size:
            return None
        return yielding_of(self.model).histories(self.state.plastic)

    @cached_property
    def pairs(self) -> dict[str, PairResult]:
        """Force, moment, area, slip, … of every contact pair, by its name."""
        return pair_results(self.model, self.fields)

    @cached_property
    def supports(self) -> dict[str, SupportResult]:
        """Force and moment of every support, by its name."""
        return support_results(self.model, self.fields)

    @cached_property
    def references(self) -> dict[str, ReferenceResult]:
        """Displacement, rotation and force of every reference and bolt, by its name."""
        return reference_results(self.model, self.fields)

    @cached_property
    def warnings(self) -> tuple[ResultWarning, ...]:
        """Reasons to doubt a step that has converged, each with a name."""
        return self.solution.warnings + model_warnings(
            self.model, self.fields, self.solution.converged, first=self.state.index <= 1
        )

    @property
    def _force(self) -> Array:
        """Contact forces on the slaves, (nc, d), global axes."""
        if self.frames is not None:
            force = np.einsum("pkc,pk->pc", self.frames, self.state.force)
            return force if self.faced is None else force * self.faced.passed[:, None]
        placed = self.model.discretisation.placed
        return forces([p.rows for p in placed], self.state.force)

    def resultant(self, pairs: Sequence[int] | None = None) -> Array:
        """Sum of the contact forces on the slaves of some (all) contact pairs, global axes."""
        placed = self.model.discretisation.placed
        ends = np.cumsum([0, *(len(p.rows.nodes) for p in placed)])
        total = np.zeros(self.model.dimension)
        for k in range(len(placed)) if pairs is None else pairs:
            total += self._force[ends[k] : ends[k + 1]].sum(axis=0)
        return total

    def __str__(self) -> str:
        e = self.energies
        counts = ((s.name.lower(), int((self.status == s).sum())) for s in ContactStatus)
        doubts = "".join(f"; warning: {warning.name}" for warning in self.warnings)
        return (
            f"t = {self.time:.6g}: {', '.join(f'{number} {name}' for name, number in counts)}; "
            f"kinetic {e.kinetic:.3e}, elastic {e.elastic:.3e}, contact {e.contact:.2e}; "
            f"{self.solution.convergence}{doubts}"
        )


def at_rest(
    model: Model,
    *,
    time: float = 0.0,
    velocity: VectorValue | Sequence[VectorValue] = 0.0,
    displacement: VectorValue | Sequence[VectorValue] = 0.0,
) -> State:
    """The model at a time without contact forces: undeformed, or displaced; with a velocity.

    velocity, displacement: a value per component, a function of x, or a list of one of these
    per body.  Fixed dofs start with their prescribed displacement and without velocity;
    quasi-static steps of a model that is displaced nowhere else begin without that either.
    """
    parts = steady(model).discretisation
    q, v = (
        _at_nodes(model, value, name)
        for value, name in ((displacement, "displacement"), (velocity, "velocity"))
    )
    v[parts.fixed] = 0.0
    if parts.eliminated is not None:
        v = parts.eliminated.nearest(v, np.zeros_like(v))
    supports: tuple[Fix, ...] = tuple(part_at(s, time) for s in model.supports)  # type: ignore[misc]
    values = with_held(prescribed_values(model.bodies, supports, parts.beside), parts.beside)
    q[parts.fixed] = values[parts.fixed]
    if parts.eliminated is not None:
        q = parts.eliminated.nearest(q, np.where(parts.is_fixed, q, 0.0))
    u = parts.local(q)
    return State(0, time, q, v, np.zeros_like(u), u[:, 1:])


def _at_nodes(model: Model, value: object, name: str) -> Array:
    """Values of all bodies at their nodes, (dofs,)."""
    out = []
    for body, own in zip(model.bodies, _one_each(value, len(model.bodies)), strict=True):
        check_vector(own, name)
        out.append(vector_at(own, body.mesh.points, name).ravel())
    out.append(np.zeros(model.beside.count))
    return np.concatenate(out)


def undeformed(state: State, motion: Motion) -> State:
    """A state `at_rest` with all displacements zero, also prescribed ones; others as they are.

    Quasi-static steps begin there: what supports prescribe at first is part of the first step.
    """
    moved = motion.parts.moved(state.displacement) or state.velocity.any()
    if state.index or moved or state.force.any():
        return state
    zero = np.zeros_like
    return replace(state, displacement=zero(state.displacement), slip=zero(state.slip))


def _one_each(value: object, bodies: int) -> list:
    """A value for every body; a list of vectors or functions is one per body."""
    if isinstance(value, list | tuple):
        several = all(isinstance(v, list | tuple) or callable(v) for v in value)
        if several and len(value) == bodies:
            return list(value)
    return [value] * bodies
