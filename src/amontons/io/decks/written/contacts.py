"""Contacts of a model as *CONTACT PAIR and *TIE, slave first, with the laws that decks have."""

from __future__ import annotations

import numpy as np

from ....core.errors import InvalidInput, within
from ....mechanics.contact.pairs import project
from ....mechanics.meshes.facets import linear_parts
from ....mechanics.model import Contact, Model
from ....mechanics.model.beside import Beside
from ....mechanics.model.supports import locate, prescribed_values
from ....mechanics.model.values import is_number
from ....problem.law import ExponentialOverclosure, OverclosureCurve
from ....problem.nitsche import NitscheProblem
from ..contact_laws import bend_of
from .bodies import Meshes
from .lines import listed, value, values

STICK = 0.1  # stick slope over the stiffness of pressure, as CalculiX' manual advises
HARD = 50.0  # stiffness of hard contact there, over Young's modulus
WIDER = 1.001  # POSITION TOLERANCE over the largest distance that is tied
UNSAID = ("tresca", "cohesion", "mu_across", "angle")


class Contacts:
    """The cards of all contacts of a model, whose obstacles are bodies already."""

    def __init__(
        self, model: Model, meshes: Meshes, dialect: str, penalty: float | None,
        notes: list[str],
    ) -> None:  # fmt: skip
        self.model, self.meshes, self.dialect = model, meshes, dialect
        self.penalty, self.notes = penalty, notes
        self.lines: list[str] = []
        for k, contact in enumerate(model.contacts):
            with within("contacts", k):
                self._contact(k, contact)

    def _contact(self, k: int, contact: Contact) -> None:
        if self.model.kind is NitscheProblem:
            self.notes.append(f"{contact.slave}: Nitsche's method is not said, the law is")
        assert contact.master is not None
        slave, master = (locate(self.model.bodies, s) for s in (contact.slave, contact.master))
        names = self.meshes.surface(*slave), self.meshes.surface(*master)
        if contact.where is not None:
            names = self._some(contact, slave, names[0]), names[1]
        elastic = contact.stiffness is not None or contact.stick_stiffness is not None
        if contact.tied and not elastic and self._can_tie(slave):
            near = value(self._distance(contact))
            self.lines += [
                f"*TIE, NAME=TIE_{k + 1}, ADJUST=NO, POSITION TOLERANCE={near}",
                f"{names[0]}, {names[1]}",
            ]
            return
        self.lines += [f"*SURFACE INTERACTION, NAME=INTERACTION_{k + 1}"]
        self._law(contact)
        curve = isinstance(contact.stiffness, OverclosureCurve) and self.dialect == "calculix"
        if curve:
            self.notes.append(f"{contact.slave}: NODE TO SURFACE, for CalculiX 2.20 takes no "
                              "force from a table of a contact of surfaces")  # fmt: skip
        nodes = names[0].endswith("_SOME") or curve
        kind = "NODE TO SURFACE" if nodes else "SURFACE TO SURFACE"
        self.lines += [f"*CONTACT PAIR, INTERACTION=INTERACTION_{k + 1}, TYPE={kind}",
                       f"{names[0]}, {names[1]}"]  # fmt: skip
        if contact.clearance is not None:
            if not is_number(contact.clearance):
                raise InvalidInput("a deck has one clearance for a pair; expected a number",
                                   ("clearance",))  # fmt: skip
            self.lines.append(f"*CLEARANCE, SLAVE={names[0]}, MASTER={names[1]}, "
                              f"VALUE={value(contact.clearance)}")  # type: ignore[arg-type]  # fmt: skip

    def _can_tie(self, slave: tuple[int, str]) -> bool:
        """Whether *TIE ties all that is tied: CalculiX' leaves held slave nodes and 2D out."""
        if self.dialect != "calculix":
            return True
        if self.model.dimension == 2:
            return False
        model, (body, surface) = self.model, slave
        beside = Beside.of(model.bodies, model.references, model.constraints)
        held = ~np.isnan(prescribed_values(model.bodies, model.supports, beside))
        nodes = model.bodies[body].mesh.surface_nodes(surface) + self.meshes.nodes[body]
        return not held[: beside.first].reshape(-1, beside.dim)[nodes].any()

    # ------------------------------------------------------------------------ where it is
    def _some(self, contact: Contact, slave: tuple[int, str], whole: str) -> str:
        """The name of the slave's nodes that take part, that of the surface if all do."""
        mesh = self.model.bodies[slave[0]].mesh
        nodes = mesh.surface_nodes(slave[1])
        chosen = np.asarray(contact.where(mesh.points[nodes]), dtype=bool)  # type: ignore[misc]
        if chosen.all():
            return whole
        if not (contact.tied or contact.method == "nodal"):
            raise InvalidInput(
                "a part of a surface with mortar contact: give it a surface of its own",
                ("where",),
            )
        name = self.meshes.names(("some", len(self.lines)), f"{whole}_SOME")
        members = listed((nodes[chosen] + self.meshes.nodes[slave[0]] + 1).tolist())
        rows = [text.strip() for line in members for text in line.split(",") if text.strip()]
        self.lines += [f"*SURFACE, NAME={name}, TYPE=NODE", *rows]
        return name

    def _distance(self, contact: Contact) -> float:
        """The largest distance of nodes that are tied."""
        bodies = self.model.bodies
        (a, slave), (b, master) = (locate(bodies, s) for s in (contact.slave, contact.master))  # type: ignore[arg-type]
        mesh, other = bodies[a].mesh, bodies[b].mesh
        nodes = mesh.surface_nodes(slave)
        if contact.where is not None:
            nodes = nodes[np.asarray(contact.where(mesh.points[nodes]), dtype=bool)]
        x = mesh.points[nodes]
        hit = project(x, other.points, linear_parts(other.surface(master)),
                      own=nodes if a == b else None)  # fmt: skip
        away = np.linalg.norm(x - hit.closest, axis=1)[hit.found]
        size = float(np.ptp(mesh.points, axis=0).max())
        return WIDER * float(away.max(initial=0.0)) + 1e-9 * size

    # --------------------------------------------------------------------------- what acts
    def _law(self, contact: Contact) -> None:
        for name in UNSAID:
            if getattr(contact, name) is not None:
                raise InvalidInput("no deck has this friction; expected a coefficient mu",
                                   (name,))  # fmt: skip
        if contact.tied:
            self._bond(contact)
            return
        stiffness = self._overclosure(contact)
        mu = _single(contact.mu, "mu")
        cap = None if contact.cap is None else _single(contact.cap, "cap")
        if cap is not None and self.dialect == "calculix":
            raise InvalidInput("CalculiX has no largest shear stress; expected mu alone",
                               ("cap",))  # fmt: skip
        if not mu:
            return
        most = "" if cap is None else f", TAUMAX={value(cap)}"
        numbers = [mu]
        if contact.stick_stiffness is not None:
            numbers.append(_single(contact.stick_stiffness, "stick_stiffness"))
        elif self.dialect == "calculix":
            numbers.append(STICK * stiffness)
            self.notes.append(
                f"{contact.slave}: sticking has a slope of {numbers[1]:.3g}, "
                "which CalculiX needs"
            )
        self.lines += [f"*FRICTION{most}", values(numbers)]

    def _bond(self, contact: Contact) -> None:
        """An elastic bond, or what CalculiX has for a tie in 2D."""
        if self.dialect == "abaqus":
            raise InvalidInput("an elastic bond: expected a tie without stiffness in a deck "
                               "for Abaqus", ("stiffness",))  # fmt: skip
        given = (contact.stiffness, contact.stick_stiffness)
        sizes = []
        for law, name in zip(given, ("stiffness", "stick_stiffness"), strict=True):
            rigid = self.penalty if self.penalty is not None else HARD * _young(self.model)
            sizes.append(rigid if law is None else _single(law, name))
        if None in given:
            self.notes.append(f"{contact.slave}: tied by a stiffness of {sizes[0]:.3g} "
                              f"({sizes[1]:.3g} along it), for CalculiX ties no 2D elements, "
                              "no held nodes and not one direction alone")  # fmt: skip
        self.lines += ["*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=TIED", value(sizes[0]),
                       "*FRICTION", values([1.0, sizes[1]])]  # fmt: skip

    def _overclosure(self, contact: Contact) -> float:
        """Write the pressure over overclosure; returns a stiffness that is typical of it."""
        law, card = contact.stiffness, "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE="
        if law is None and self.penalty is None:
            self.lines.append(f"{card}HARD")
            return HARD * _young(self.model)
        if isinstance(law, ExponentialOverclosure):
            if self.dialect == "abaqus":
                raise InvalidInput("an exponential law is another one in Abaqus; expected an "
                                   "OverclosureCurve", ("stiffness",))  # fmt: skip
            self.lines += [f"{card}EXPONENTIAL", values([law.c0, law.p0])]
            return law.p0 / law.c0
        bent = _bent(contact)
        if bent:
            self.lines += [f"{card}LINEAR", values(bent)]
            return bent[0]
        if isinstance(law, OverclosureCurve):
            table = list(zip(np.array(law.pressure), np.array(law.overclosure), strict=True))
            self.lines += [f"{card}TABULAR", *(values(row) for row in table)]
            return float((table[-1][0] - table[0][0]) / (table[-1][1] - table[0][1]))
        size = self.penalty if law is None else _single(law, "stiffness")
        assert size is not None
        self.lines += [f"{card}LINEAR", value(size)]
        return size


def _bent(contact: Contact) -> tuple[float, float] | None:
    """Stiffness and tension of nodes in contact as CalculiX has them, read from a deck."""
    law = contact.stiffness
    return bend_of(law) if isinstance(law, OverclosureCurve) else None


def _single(given: object, name: str) -> float:
    """One number; raises InvalidInput for one that changes over the surface."""
    if not is_number(given) and not (
        isinstance(given, np.ndarray | list | tuple) and np.ptp(np.asarray(given)) == 0
    ):
        raise InvalidInput("changes over the surface or with the state; expected one number",
                           (name,))  # fmt: skip
    return float(np.ravel(given)[0])  # type: ignore[arg-type]


def _young(model: Model) -> float:
    """The largest Young's modulus."""
    found = []
    for body in model.bodies:
        laws = body.material.values() if isinstance(body.material, dict) else [body.material]
        found += [float(np.max(law.young)) for law in laws]  # type: ignore[union-attr]
    return max(found)
