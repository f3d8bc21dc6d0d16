"""A model as a deck: one static step with all supports and loads at their full size.

Supports are written node by node, loads as nodal forces equal to ours (constant pressures as
*DSLOAD), constraints as *EQUATION, so that both programs take exactly what the model says.
"""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ....core.errors import InvalidInput, within
from ....core.files import write_bytes
from ....mechanics.contact.geometry import Plane
from ....mechanics.elements.elasticity import LinearElastic
from ....mechanics.model import Body, Contact, Fix, Model, Pressure, Temperature
from ....mechanics.model.beside import Beside
from ....mechanics.model.constraint_rows import Rows
from ....mechanics.model.large_deformation import LargeDeformation
from ....mechanics.model.parts import CURRENT
from ....mechanics.model.supports import external_load, locate, prescribed_values
from ....mechanics.model.temperature import changes
from ....mechanics.model.timing import is_timed
from ....mechanics.model.values import is_number
from .bodies import Meshes, plane_element
from .contacts import Contacts
from .lines import Names, value
from .rubber import check_finite

Array = NDArray[np.float64]
CALCULIX, ABAQUS = DIALECTS = ("calculix", "abaqus")
WIDTH = 3
FIRST = 0.1  # the first increment of large deformations


def write_deck(
    model: Model, path: str | os.PathLike[str], dialect: str = CALCULIX, *,
    penalty: float | None = None,
) -> tuple[str, ...]:  # fmt: skip
    """Write a model as an `.inp` deck, whole or not at all; returns what differs, in words.

    dialect: "calculix" or "abaqus".  penalty: pressure over overclosure of hard contact, stress
    / length, > 0; by default hard, which CalculiX takes as 50 times the largest modulus.
    Raises InvalidInput for what no deck says, such as obstacles that are no planes, Tresca's
    friction, values that depend on time, and laws of finite strains that decks do not have.
    """
    if dialect not in DIALECTS:
        raise InvalidInput(f"dialect: expected one of {', '.join(DIALECTS)}, got {dialect!r}")
    if penalty is not None and not (np.isfinite(penalty) and penalty > 0):
        raise InvalidInput(f"penalty: expected a number > 0, got {penalty!r}")
    _check(model)
    notes: list[str] = []
    whole = _with_planes(model, notes)
    names = Names()
    meshes = Meshes(whole, names, notes if dialect == CALCULIX else None)
    contacts = Contacts(whole, meshes, dialect, penalty, notes)
    heat = [load for load in model.loads if isinstance(load, Temperature)]
    if any(not (load.mean or is_number(load.value)) for load in heat):
        notes.append("temperature: other programs take its mean in quad and hex cells")
    beside = Beside.of(whole.bodies, whole.references, whole.constraints)
    labels, extra = _labels(beside)
    own = Beside.of(model.bodies, model.references, model.constraints)
    known = labels[: own.first] + labels[beside.first :]  # planes come after the bodies
    title = " ".join((model.name or "a model of amontons").replace("*", " ").split())[:80]
    lines = ["*HEADING", title, *meshes.materials, *extra, *meshes.lines,
             *_springs(model, own, known, meshes), *_equations(model, own, known),
             *contacts.lines]  # fmt: skip
    lines += _step(whole, beside, labels, meshes, dialect)
    write_bytes(Path(path), ("\n".join(lines) + "\n").encode("ascii", "replace"))
    return tuple(dict.fromkeys(notes))


def _check(model: Model) -> None:
    if model.kind is LargeDeformation:
        check_finite(model)
    for part in ("supports", "loads"):
        for k, each in enumerate(getattr(model, part)):
            with within(part, k, "value"):
                if is_timed(each.value):
                    raise InvalidInput(
                        "depends on time; a deck is written of one state: expected numbers or "
                        "functions of the position"
                    )
                if getattr(each, "configuration", "") == CURRENT:
                    raise InvalidInput("a load of the deformed body: can not be said in a deck")


def _with_planes(model: Model, notes: list[str]) -> Model:
    """The model with one held element behind each obstacle, as the master of the contact."""
    bodies, contacts, supports = list(model.bodies), [], list(model.supports)
    for k, contact in enumerate(model.contacts):
        if contact.obstacle is None:
            contacts.append(contact)
            continue
        if type(contact.obstacle) is not Plane:
            with within("contacts", k, "obstacle"):
                raise InvalidInput(
                    f"{type(contact.obstacle).__name__}: can not be said in a deck; expected a "
                    "Plane, or a meshed body as the master"
                )
        if contact.follows is not None:
            with within("contacts", k, "follows"):
                raise InvalidInput("an obstacle that moves: can not be said in a deck")
        name = f"obstacle {k + 1}"
        mesh = plane_element(model, contact.obstacle.normal, contact.obstacle.point)
        mesh = replace(mesh, node_sets={f"held {k + 1}": np.arange(len(mesh.points))})
        bodies.append(Body(mesh, _stiff(model), name))
        supports.append(Fix(f"{name}.held {k + 1}", 0))
        contacts.append(_against(contact, f"{name}.face"))
        notes.append(f"{contact.slave}: the plane is one large element, held at all its nodes")
    if len(bodies) == len(model.bodies):
        return model
    return Model(
        bodies, supports, contacts, model.loads, model.load_factor, model.name,
        model.references, model.constraints, model.springs,
    )  # fmt: skip


def _against(contact: Contact, master: str) -> Contact:
    """The same contact with a master; nodal contact stays what it is."""
    return replace(contact, obstacle=None, master=master, kinematics=None, configuration=None,
                   law=None)  # fmt: skip


def _stiff(model: Model) -> LinearElastic:
    """A material of the plane: it is held at all its nodes, and stays as it is."""
    laws = model.bodies[0].material
    first = next(iter(laws.values())) if isinstance(laws, dict) else laws
    young = float(np.max(first.young)) if hasattr(first, "young") else 1.0  # type: ignore[union-attr]
    return LinearElastic(young, 0.0, getattr(first, "plane", "strain"))


# ------------------------------------------------------------------------------ numbers
def _labels(beside: Beside) -> tuple[list[tuple[int, int]], list[str]]:
    """(node, component) from 1 of every dof, and the nodes of those beside the bodies."""
    dim, lines = beside.dim, []
    labels = [(k // dim + 1, k % dim + 1) for k in range(beside.first)]
    node = beside.first // dim
    found: dict[int, tuple[int, int]] = {}
    for name, entry in beside.entries.items():
        for dofs, point in zip(entry.dofs, entry.points, strict=True):
            node += 1
            at = [*point, *[0.0] * (WIDTH - dim)]
            lines += [f"** {name}", "*NODE", f"{node}, {', '.join(map(value, at))}"]
            found |= {int(dof): (node, c) for c, dof in enumerate(dofs, 1)}
    return labels + [found[k] for k in range(beside.first, beside.total)], lines


def _equations(model: Model, beside: Beside, labels: list[tuple[int, int]]) -> list[str]:
    rows, out = Rows.of(model.constraints, beside), []
    for k, first in enumerate(rows.dependent):
        begin, end = rows.matrix.indptr[k : k + 2]
        columns, factors = rows.matrix.indices[begin:end], rows.matrix.data[begin:end]
        order = np.argsort(columns != first, kind="stable")
        out += ["*EQUATION", str(len(columns))]
        for c, f in zip(columns[order], factors[order], strict=True):
            node, component = labels[c]
            out.append(f"{node}, {component}, {value(f)}")
    return out


def _springs(
    model: Model, beside: Beside, labels: list[tuple[int, int]], meshes: Meshes
) -> list[str]:
    """Springs to the ground, and between two components."""
    from ....mechanics.model.constraint_rows import equations

    out: list[str] = []
    for k, spring in enumerate(model.springs):
        matrix, _ = equations(spring.terms, beside)
        for row in matrix:
            row = sparse_row(row)  # noqa: PLW2901
            plain = len(row) == 1 or (len(row) == 2 and sum(f for _, f in row) == 0)
            if not plain:
                with within("springs", k, "terms"):
                    raise InvalidInput(
                        "a deck has springs to the ground and between two components alone; "
                        "expected one term, or two with opposite coefficients"
                    )
            meshes.elements += 1
            name, kind = f"SPRING_{meshes.elements}", f"SPRING{len(row)}"
            ends = [labels[c] for c, _ in row]
            out += [f"*ELEMENT, TYPE={kind}, ELSET={name}",
                    ", ".join(map(str, [meshes.elements, *(n for n, _ in ends)])),
                    f"*SPRING, ELSET={name}", ", ".join(str(c) for _, c in ends),
                    value(spring.stiffness * row[0][1] ** 2)]  # fmt: skip
    return out


def sparse_row(row: object) -> list[tuple[int, float]]:
    """Columns and numbers of one row of a matrix that are not 0."""
    coo = row.tocoo()  # type: ignore[attr-defined]
    at = coo.coords[-1]
    return [(int(c), float(f)) for c, f in zip(at, coo.data, strict=True) if f]


# --------------------------------------------------------------------------------- step
def _step(
    model: Model, beside: Beside, labels: list[tuple[int, int]], meshes: Meshes, dialect: str
) -> list[str]:
    factor, dim = model.load_factor, beside.dim
    prescribed = factor * prescribed_values(model.bodies, model.supports, beside)
    for entry in beside.entries.values():
        if entry.held:
            prescribed[entry.dofs] = 0.0
    heat = changes(model.bodies, model.loads)
    warm = any(change is not None for change in heat)
    count = len(meshes.nodes) and int(meshes.nodes[-1])
    begin = ["*NSET, NSET=ALL_NODES, GENERATE", f"1, {count}, 1"]
    if warm:
        begin += ["*INITIAL CONDITIONS, TYPE=TEMPERATURE", "ALL_NODES, 0."]
    finite = model.kind is LargeDeformation
    first = FIRST if finite else 1.0  # of the whole load
    head = "*STEP, NLGEOM, INC=1000" if finite else "*STEP"
    out = [*begin, head, "*STATIC", f"{first:g}, 1."]
    held = np.flatnonzero(~np.isnan(prescribed))
    out += ["*BOUNDARY"] if len(held) else []
    for dof in held:
        node, component = labels[dof]
        out.append(f"{node}, {component}, {component}, {value(prescribed[dof])}")
    pressures = [load for load in model.loads if isinstance(load, Pressure)
                 and is_number(load.value)]  # fmt: skip
    rest = [None if load in pressures or isinstance(load, Temperature) else load
            for load in model.loads]  # fmt: skip
    for load in pressures:
        body, surface = locate(model.bodies, load.on)
        size = value(factor * load.value)  # type: ignore[operator]
        out += ["*DSLOAD", f"{meshes.surface(body, surface)}, P, {size}"]
    force = factor * external_load(model.bodies, rest, beside, own=False)
    loaded = np.flatnonzero(force)
    out += ["*CLOAD"] if len(loaded) else []
    out += [f"{labels[d][0]}, {labels[d][1]}, {value(force[d])}" for d in loaded]
    out += ["*TEMPERATURE"] if warm else []
    for k, change in enumerate(heat):
        for node in () if change is None else np.flatnonzero(change):
            out.append(f"{node + meshes.nodes[k] + 1}, {value(factor * change[node])}")  # type: ignore[index]
    flat = ", OUTPUT=2D" if dim == 2 else ""
    if dialect == CALCULIX:
        out += [f"*NODE FILE{flat}", "U, RF", "*NODE PRINT, NSET=ALL_NODES", "U"]
        out += [] if dim == 2 else ["*EL FILE", "S"]
    else:
        out += ["*OUTPUT, FIELD, VARIABLE=PRESELECT"]
    return [*out, "*END STEP"]
