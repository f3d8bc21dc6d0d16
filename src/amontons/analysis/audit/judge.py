"""The judge of an audit: balance of the whole, and the questions to every pair."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ...core.errors import InvalidInput, UnsupportedForm
from ...mechanics.elements.elasticity import LinearElastic, materials_by_region
from ...mechanics.elements.given import GivenMatrices
from ...mechanics.elements.rigid import Rigid
from ...mechanics.model.supports import external_load, locate
from ...problem.friction import FrictionProblem
from . import questions
from .action import between_sides
from .culprit import culprits
from .forces import NodalForces, misplaced, nodal_forces
from .laws import Give, Seen, approach_of, seen
from .sides import Side, sides_of
from .turning import Turning
from .verdict import QUESTIONS, RIGHT, UNDECIDED, WRONG, Audit, Finding, PairAudit, joined

if TYPE_CHECKING:
    from ...mechanics.model import Model

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
BALANCED = 1e-4  # of the largest nodal force: imbalance that is none
BLIND = 0.1  # the same, from which rounding hides the balance
FORMULATED = 1e-2  # of it, above which elements with another formulation say nothing
ACTION = 0.02  # of the pressure, by which both sides' forces may differ
PLACED = 1e-6  # of the largest displacement: what supports hold is there
ZERO = 1e-13  # of the forces that single displacements need: a sum of them that is none
NAMED = 10


@dataclass(frozen=True, eq=False)
class Answer:
    """Displacements to be judged, and what is known of where they come from.

    displacement (nodes, d) of every body; blur, the same shapes: by how much each may be off;
    before: displacements of the increment before, None without.  reactions (nc, d): contact
    forces that the answer states, in the model's frames.  large: of large strains; other:
    elements formulated otherwise, in words; time, until: of the answer and of the end.
    names (nodes,): what its nodes are called.  tolerance: imbalance, over the largest nodal
    force, that another formulation explains.  one_way: loads grow along one straight way.
    turning: constraints that turn with their nodes.
    """

    displacement: tuple[Array, ...]
    blur: tuple[Array, ...] | None = None
    before: tuple[Array, ...] | None = None
    reactions: Array | None = None
    large: bool = False
    other: tuple[str, ...] = ()
    time: float | None = None
    until: float | None = None
    names: Array | None = None
    one_way: bool = True
    tolerance: float = 0.0
    notes: tuple[str, ...] = field(default=())
    turning: tuple[Turning, ...] = ()


def audit_answer(model: Model, answer: Answer, *, deck_law: bool = True) -> Audit:
    """Judge an answer of a model; deck_law: stiffness that its contacts have is meant.

    Raises InvalidInput for displacements that do not fit the model, UnsupportedForm for models
    in large deformations or with Nitsche's method, which have no such forces.
    """
    if model.kind is not FrictionProblem:
        raise UnsupportedForm(
            "an audit needs small strains and nodal or mortar contact in the reference "
            "configuration; for others `solution.convergence` is the judge's word"
        )
    u, blur = _whole(model, answer.displacement), _blur(model, answer)
    forces = nodal_forces(model, u, blur, large=answer.large, turning=answer.turning)
    scale = _scale(model, forces)
    idle = max(scale, float(forces.known.max(initial=0.0))) <= ZERO * forces.size
    least = forces.size if idle else scale  # of what loads pairs; sums of nothing are rounding
    every = sides_of(model, forces, u)
    findings: dict[str, Finding] = {}
    off = _on_no_contact(model)
    findings["balance"] = _balance(model, forces, (u, scale), off, every, answer)
    before = None if answer.before is None else _whole(model, answer.before)
    pairs = tuple(
        _pair(model, k, sides, (u, before, least), answer, deck_law=deck_law)
        for k, sides in enumerate(every)
    )
    for name in QUESTIONS[1:]:
        findings[name] = joined([p.findings[name] for p in pairs], list(model.pair_names))
    if answer.reactions is not None:
        findings["forces"] = _stated(model, every, answer.reactions, scale, answer)
    if answer.until is not None and answer.time is not None:
        findings["time"] = _time(answer.time, answer.until)
    blind = findings["balance"].verdict is UNDECIDED
    rough = findings["balance"].numbers.get("residual", 0.0) > FORMULATED
    if answer.other and (blind or rough):  # what fits although it is rough does fit
        findings = {
            name: _only_bounded(name, f) if blind or f.verdict is WRONG else f
            for name, f in findings.items()
        }
    hidden = float(np.max(forces.bound * off, initial=0.0)) / scale if scale > 0 else 0.0
    return Audit(model.name or "model", findings, pairs, hidden, answer.displacement, model,
                 _notes(answer, forces))  # fmt: skip


def _notes(answer: Answer, forces: NodalForces) -> tuple[str, ...]:
    notes = list(answer.notes)
    if answer.large:
        notes.append(
            "large strains there, small ones here: displacements change by up to "
            f"{forces.gradient:.2g} of a length, which bounds what forces can tell"
        )
    if answer.turning:
        notes.append("*MPC turns with its nodes there (CalculiX takes NLGEOM with it), and is "
                     "linear here: displacements of its nodes may differ by that turning"
                     )  # fmt: skip
    notes += [f"{text}: their forces are only bounded" for text in answer.other]
    return tuple(notes)


def _whole(model: Model, displacement: Sequence[Array]) -> Array:
    """(dofs,) of the displacements of all bodies, checked."""
    if len(displacement) != len(model.bodies):
        raise InvalidInput(
            f"displacements: expected one array for each of {len(model.bodies)} bodies, got "
            f"{len(displacement)}"
        )
    out = []
    for body, values in zip(model.bodies, displacement, strict=True):
        given = np.asarray(values, dtype=float)
        if given.shape != body.mesh.points.shape:
            raise InvalidInput(
                f"displacements of body {body.name!r}: expected {body.mesh.points.shape}, a "
                f"row for each node, got {given.shape}"
            )
        if not np.isfinite(given).all():
            row = int(np.flatnonzero(~np.isfinite(given).all(axis=1))[0])
            raise InvalidInput(
                f"displacements of body {body.name!r}: node {row} has {given[row].tolist()}, "
                "expected finite numbers"
            )
        out.append(given.ravel())
    return np.concatenate(out)


def _blur(model: Model, answer: Answer) -> Array:
    if answer.blur is None:
        return np.zeros(sum(body.mesh.points.size for body in model.bodies))
    return _whole(model, answer.blur)


def _scale(model: Model, forces: NodalForces) -> float:
    """The largest force at a node, of contacts, supports or loads."""
    d = model.dimension
    beside = model.discretisation.beside
    load = external_load(model.bodies, model.loads, beside)[: beside.first]
    sizes = [np.linalg.norm(f.reshape(-1, d), axis=1).max(initial=0.0)
             for f in (forces.missing, model.load_factor * load)]  # fmt: skip
    return float(max(sizes))


def _on_no_contact(model: Model) -> Mask:
    """Dofs (dofs,) where neither supports nor contacts act."""
    parts, d = model.discretisation, model.dimension
    off = np.ones((parts.beside.first // d, d), dtype=bool)
    for contact in model.contacts:
        for name in (contact.slave, contact.master):
            if name is not None:
                k, surface = locate(model.bodies, name)
                nodes = model.bodies[k].mesh.surface_nodes(surface)
                off[int(parts.offsets[k]) // d + nodes] = False
    out = off.ravel()
    out[parts.held[parts.held < out.size]] = False
    return out


# ------------------------------------------------------------------------------ balance
def _balance(
    model: Model, forces: NodalForces, state: tuple[Array, float], off: Mask,
    every: Sequence[tuple[Side, ...]], answer: Answer,
) -> Finding:  # fmt: skip
    """Whether inner forces balance the loads off the contacts, and both sides each other."""
    u, scale = state
    left = np.where(off, np.abs(forces.missing), 0.0)
    over = np.where(off, left - forces.known, 0.0)
    moved, at = misplaced(model, u, forces.blur, answer.turning)
    if scale <= ZERO * forces.size and moved <= PLACED:
        names = ("residual", "excess", "bound", "largest_force", "between_sides", "supports")
        return Finding(RIGHT, "no forces at all", dict.fromkeys(names, 0.0))
    unit = scale or 1.0
    residual, excess = float(left.max(initial=0.0)) / unit, float(over.max(initial=0.0)) / unit
    bound = float((forces.known * off).max(initial=0.0)) / unit
    between, pair = between_sides(model, forces, every)
    numbers = {"residual": residual, "excess": excess, "bound": bound, "largest_force": scale,
               "between_sides": between, "supports": moved}  # fmt: skip
    name = _namer(model, answer)
    if moved > PLACED:
        fixed = model.discretisation.is_fixed[at * model.dimension :][: model.dimension].any()
        text = "supports do not have the displacements that they prescribe"
        text = text if fixed else "nodes do not follow their constraints"
        text += f": node {name(at)} is off by {moved:.2g} of the largest"
        return Finding(WRONG, text, numbers, (name(at),))
    if excess <= answer.tolerance and between <= max(ACTION, answer.tolerance):
        excess = between = 0.0
    if answer.other and max(excess, between) > FORMULATED and not answer.tolerance:
        text = (
            f"inner forces miss the loads by {residual:.1e} of the largest nodal force, and "
            "the elements are formulated otherwise: forces can not be told"
        )
        return Finding(UNDECIDED, text, numbers)
    if excess > BALANCED:
        return _unbalanced(model, forces, (off, over), numbers, name)
    if between > ACTION:
        text = f"the forces on both sides of pair {pair} differ by {between:.2g} of its force"
        return Finding(WRONG, text, numbers)
    if bound > BLIND:
        is_turned = forces.large.max(initial=0.0) > forces.bound.max(initial=0.0)
        what, remedy = (
            ("turning of bodies or constraints", "small strains do not know it") if is_turned
            else ("rounding of the displacements", "give more digits")
        )  # fmt: skip
        text = (f"{what} may move nodal forces by {bound:.2g} of the largest: the balance can "
                f"not be told; {remedy}")  # fmt: skip
        return Finding(UNDECIDED, text, numbers)
    return Finding(RIGHT, f"holds to {residual:.1e} of the largest nodal force (rounding may "
                   f"hide {bound:.1e})", numbers)  # fmt: skip


def _unbalanced(
    model: Model, forces: NodalForces, where: tuple[Mask, Array], numbers: dict[str, float],
    name: Any,
) -> Finding:  # fmt: skip
    """Forces that balance nothing; where (dofs,): asked for balance, and by how much off."""
    off, over = where
    alone = culprits(model.discretisation.stored_stiffness[: len(off), : len(off)],
                     forces.missing, off, model.dimension)[:3]  # fmt: skip
    order = np.argsort(-over, kind="stable") // model.dimension
    nodes = tuple(dict.fromkeys(name(int(n)) for n in order[: 4 * NAMED]))[:3]
    text = ("inner forces do not balance the loads off the contacts: by "
            f"{numbers['excess']:.2g} of the largest nodal force at node {nodes[0]}, where "
            f"rounding explains {numbers['bound']:.1g}")  # fmt: skip
    if alone:
        node, share, size = alone[0]
        text += (f"; the displacement of node {name(node)} alone, off by {size:.3g}, explains "
                 f"{share:.1%} of it")  # fmt: skip
        nodes = tuple(dict.fromkeys([*(name(each[0]) for each in alone), *nodes]))
    return Finding(WRONG, text, numbers, nodes)


# ------------------------------------------------------------------------------ pairs
def _pair(
    model: Model, k: int, sides: tuple[Side, ...],
    moved: tuple[Array, Array | None, float], answer: Answer, *, deck_law: bool,
) -> PairAudit:  # fmt: skip
    """One pair, from both sides; moved: displacements, those before, the largest force."""
    contact, (u, before, scale) = model.contacts[k], moved
    young = _softest(model, contact.slave, contact.master)
    lengths = [approach_of(side, young, scale) for side in sides]
    approach, sheared = (max(each) for each in zip(*lengths, strict=True))
    give = Give(*(_inverse(contact.numbers.get(name)) for name in
                  ("stiffness", "stick_stiffness")), meant=deck_law)  # fmt: skip
    found: list[Seen] = []
    for side in [one for one in sides if len(one.node)] or sides:  # one that is held tells none
        slip = side.slip if before is None else side.slip - side.slip_of(before)
        one = seen(side, give, approach, sheared, slip, scale)
        if before is not None and answer.one_way:  # both are histories of one straight way
            other = seen(side, give, approach, sheared, side.slip, scale)
            soft = min(one.missing_deck, other.missing_deck)
            one = min(one, other, key=lambda s: (s.missing, s.impossible_share))
            one = replace(one, missing_deck=soft)
        found.append(one)
    views = tuple(found)
    name, size = _namer(model, answer), float(np.abs(u).max(initial=0.0))
    deck = deck_law and (give.normal > 0 or give.shear > 0)
    findings = {
        "penetration": questions.penetration(
            views, approach, _side_length(model, contact.slave, contact.master), size, name,
            deck=deck,
        ),
        "cone": questions.cone(views, name),
        "status": questions.status(
            views, sheared, name, history=answer.one_way or before is not None, deck=deck
        ),
        "geometry": questions.geometry(views, approach),
    }  # fmt: skip
    return PairAudit(model.pair_names[k], contact.slave, contact.master, views, findings,
                     approach)  # fmt: skip


def _inverse(stiffness: Any) -> float:
    """Length per traction of a stiffness that is one number; 0 without."""
    return 1.0 / float(stiffness) if isinstance(stiffness, int | float) else 0.0


def _softest(model: Model, *names: str | None) -> float:
    """Smallest Young's modulus of cells at surfaces."""
    found = []
    for name in names:
        if name is None:
            continue
        k, surface = locate(model.bodies, name)
        body = model.bodies[k]
        if isinstance(body.material, Rigid | GivenMatrices):
            continue
        on = np.zeros(len(body.mesh.points), dtype=bool)
        on[body.mesh.surface_nodes(surface)] = True
        laws = materials_by_region(body.mesh, body.material)
        found += [
            law.young for block in body.mesh.cells
            if on[block.nodes].any() and isinstance(law := laws[block.region], LinearElastic)
        ]  # fmt: skip
    return min(found, default=np.inf)


def _side_length(model: Model, *names: str | None) -> float:
    """Shortest side of the facets of surfaces."""
    shortest = np.inf
    for name in names:
        if name is None:
            continue
        k, surface = locate(model.bodies, name)
        mesh = model.bodies[k].mesh
        for block in mesh.surface(surface):
            x = mesh.points[block.nodes]
            sides = x - np.roll(x, 1, axis=1)
            shortest = min(shortest, float(np.linalg.norm(sides, axis=2).min(initial=np.inf)))
    return shortest if np.isfinite(shortest) else 0.0


# ------------------------------------------------------------------------------ the rest
def _namer(model: Model, answer: Answer) -> Any:
    """What a node of the model is called."""
    if answer.names is not None:
        given = answer.names
        return lambda node: str(given[node])
    starts = model.discretisation.offsets // model.dimension
    if len(model.bodies) == 1:
        return str

    def name(node: int) -> str:
        k = int(np.searchsorted(starts, node, side="right")) - 1
        return f"{model.bodies[k].name}:{node - int(starts[k])}"

    return name


def _stated(
    model: Model, every: Sequence[tuple[Side, ...]], reactions: Array, scale: float,
    answer: Answer,
) -> Finding:  # fmt: skip
    """Whether the contact forces that it states are those that its displacements need."""
    own = np.concatenate([sides[0].r for sides in every])
    given = np.asarray(reactions, dtype=float)
    if given.shape != own.shape:
        raise InvalidInput(f"reactions: expected {own.shape}, a row for each contact, got "
                           f"{given.shape}")  # fmt: skip
    known = np.concatenate([sides[0].known for sides in every])
    bound = np.concatenate([sides[0].bound for sides in every])
    node = np.concatenate([sides[0].node for sides in every])
    off = np.where(known, np.abs(given - own) - bound, 0.0).max(axis=1, initial=0.0)
    worst = int(off.argmax()) if len(off) else 0
    share = float(off[worst]) / scale if scale > 0 else float(off.max(initial=0.0))
    numbers = {"difference": share}
    if not share <= BALANCED:
        name = _namer(model, answer)(int(node[worst]))
        return Finding(WRONG, "the contact forces that it states are not those that its "
                       f"displacements need: off by {share:.2g} of the largest nodal force at "
                       f"node {name}", numbers, (name,))  # fmt: skip
    text = f"stated contact forces fit the displacements to {share:.1e}"
    return Finding(RIGHT, text, numbers)


def _time(time: float, until: float) -> Finding:
    numbers = {"reached": time, "end": until}
    if time < until * (1 - 1e-4):
        return Finding(WRONG, f"the answer ends at t = {time:g}, the deck at {until:g}: it was "
                       "stopped early", numbers)  # fmt: skip
    return Finding(RIGHT, f"at the end, t = {time:g}", numbers)


def _only_bounded(name: str, found: Finding) -> Finding:
    """Forces of elements formulated otherwise say neither right nor wrong."""
    is_known = name in ("penetration", "time", "geometry") or not found.numbers  # or no pairs
    if is_known or found.verdict is UNDECIDED:
        return found
    return Finding(UNDECIDED, "not known, forces of these elements are only bounded; " +
                   found.text, found.numbers, found.nodes)  # fmt: skip
