"""Nodes, elements, materials, sets and surfaces of a model as cards of a deck."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ....core.errors import InvalidInput
from ....mechanics.elements.elasticity import LinearElastic, materials_by_region
from ....mechanics.elements.hybrid import element_formulation
from ....mechanics.elements.orthotropic import OrthotropicElastic
from ....mechanics.elements.plasticity import ElastoPlastic
from ....mechanics.meshes.cells import CELLS
from ....mechanics.meshes.mesh import Mesh
from ....mechanics.model import Body, Model
from ..shapes import SHAPES
from .lines import Names, listed, value, values
from .rubber import FINITE, cards_of

Array = NDArray[np.float64]
Index = NDArray[np.int64]
WIDTH = 3
FAR = 10.0  # plastic strain to which hardening is written


class Meshes:
    """Numbers of nodes and elements from 1, body after body, and the cards of all of them."""

    def __init__(self, model: Model, names: Names, notes: list[str] | None = None) -> None:
        """notes: gets what can not be said, for programs without hybrid elements."""
        self.model, self.names, self._notes = model, names, notes
        self.lines: list[str] = []
        self._laws: list[tuple[float, list[str]]] = []  # Young's modulus and cards of each
        self.nodes = np.cumsum([0, *(len(b.mesh.points) for b in model.bodies)])
        self._sides: list[dict[tuple[int, ...], tuple[int, int]]] = []
        self._surfaces: set[str] = set()
        self.elements, self._materials = 0, 0
        for k, body in enumerate(model.bodies):
            self._body(k, body)

    def _body(self, k: int, body: Body) -> None:
        mesh, out = body.mesh, self.lines
        shown = body.name or f"body {k + 1}"
        if not isinstance(body.material, LinearElastic | OrthotropicElastic | FINITE | dict):
            raise InvalidInput(
                f"body {shown!r}: {type(body.material).__name__}: can not be said in a deck, "
                "expected LinearElastic or OrthotropicElastic"
            )
        out += [f"** body {shown}", "*NODE"]
        for number, x in enumerate(mesh.points, int(self.nodes[k]) + 1):
            out.append(f"{number}, {values([*x, *[0.0] * (WIDTH - len(x))])}")
        sides: dict[tuple[int, ...], tuple[int, int]] = {}
        laws = materials_by_region(mesh, body.material)
        for block in mesh.cells:
            law = laws[block.region]
            integration = element_formulation(mesh, block, law)
            if integration.startswith("hybrid") and self._notes is not None:
                integration = "incompatible" if "incompatible" in integration else "full"
                self._notes.append(
                    f"body {shown!r}: CalculiX has no hybrid elements, those with full "
                    "integration lock near incompressibility, and where they flow"
                )
            kind = element_type(mesh, block.kind, integration, law, shown)
            name = self.names(("region", k, block.region), f"{shown}_{block.region}")
            out.append(f"*ELEMENT, TYPE={kind}, ELSET={name}")
            for row in block.nodes:
                self.elements += 1
                out += listed([self.elements, *(row + self.nodes[k] + 1).tolist()])
                for number, side in enumerate(SHAPES[kind].sides, 1):
                    sides[_key(row[list(side)], block.kind)] = (self.elements, number)
        self._sides.append(sides)
        for region, law in laws.items():
            if not isinstance(law, LinearElastic | OrthotropicElastic | FINITE):
                raise InvalidInput(
                    f"body {shown!r}: {type(law).__name__}: can not be said in a deck"
                )
            self._material(self.names(("region", k, region), ""), law)
        for title, members in mesh.node_sets.items():
            if len(members):
                name = self.names(("nodes", k, title), f"{title}_NODES")
                out += [f"*NSET, NSET={name}", *self.listed_nodes(k, members)]
        for title in mesh.surfaces:
            self.surface(k, title)

    def listed_nodes(self, body: int, nodes: Index) -> list[str]:
        """Numbers of nodes of a body, in lines."""
        return listed((nodes + self.nodes[body] + 1).tolist())

    @property
    def materials(self) -> list[str]:
        """The cards of all materials, the stiffest first: CalculiX' HARD is 50 times that."""
        ranked = sorted(self._laws, key=lambda law: -law[0])
        return [line for _, cards in ranked for line in cards]

    def _material(self, elset: str, law: LinearElastic | OrthotropicElastic | FINITE) -> None:
        self._materials += 1
        name = f"MATERIAL_{self._materials}"
        out = [f"*MATERIAL, NAME={name}"]
        self._laws.append((float(np.max(law.young)), out))
        turned = ""
        if isinstance(law, LinearElastic):
            out += ["*ELASTIC", values([law.young, law.poisson])]
            if isinstance(law, ElastoPlastic):
                out += ["*PLASTIC", *(values(row) for row in law.rows_to(FAR))]
            if law.expansion:
                out += ["*EXPANSION", value(law.expansion)]
        elif isinstance(law, FINITE):
            out += cards_of(law)
        else:
            constants = [*law.young, *law.poisson, *law.shear]
            out += ["*ELASTIC, TYPE=ENGINEERING CONSTANTS", values(constants[:8]) + ",",
                    value(constants[8])]  # fmt: skip
            if np.any(law.expansion):
                out += ["*EXPANSION, TYPE=ORTHO", values(law.expansion)]  # type: ignore[arg-type]
            turned = f", ORIENTATION=AXES_{self._materials}"
        if not isinstance(law, FINITE) and law.density is not None:
            out += ["*DENSITY", value(law.density)]
        out = self.lines
        if isinstance(law, OrthotropicElastic):
            axes = np.array(law.axes)
            out += [f"*ORIENTATION, NAME=AXES_{self._materials}", values(axes[:2].ravel())]
        out.append(f"*SOLID SECTION, ELSET={elset}, MATERIAL={name}{turned}")
        if self.model.dimension == 2 and not self.model.axisymmetric:
            out.append("1.")

    def surface(self, body: int, title: str) -> str:
        """The name of a surface of a body, whose card is written when it is first asked for."""
        name = self.names(("surface", body, title), title)
        if name in self._surfaces:
            return name
        self._surfaces.add(name)
        rows = []
        for facets in self.model.bodies[body].mesh.surfaces[title]:
            for nodes in facets.nodes:
                found = self._sides[body].get(_key(nodes, facets.kind))
                if found is None:
                    raise InvalidInput(f"surface {title!r}: a facet is the side of no element")
                rows.append(f"{found[0]}, S{found[1]}")
        self.lines += [f"*SURFACE, NAME={name}, TYPE=ELEMENT", *rows]
        return name


def _key(nodes: Index, kind: str) -> tuple[int, ...]:
    """What tells a facet: its nodes without their order."""
    return tuple(sorted(nodes.tolist()))


def element_type(
    mesh: Mesh, cell: str, integration: str, law: object, body: str
) -> str:
    """The element of a cell; raises InvalidInput for one that no deck has."""
    plane = "" if mesh.dim == 3 else "axisymmetric" if mesh.axisymmetric else (
        getattr(law, "plane", "strain"))  # fmt: skip
    fitting = [
        name for name, shape in SHAPES.items() if (shape.cell, shape.plane) == (cell, plane)
    ]
    for name in fitting:
        if SHAPES[name].integration == integration and not name.endswith("4R"):
            return name if name != "C3D8R" else "C3D8"
    hint = "; expected quad8, hex20 or others of decks"
    if fitting:
        hint = f"; expected integration {SHAPES[fitting[0]].integration!r} of these cells"
    raise InvalidInput(
        f"body {body!r}: cells {cell!r} with {integration} integration: no element of a "
        f"deck is the same{hint}"
    )


def plane_element(model: Model, plane: Sequence[float], point: Sequence[float]) -> Mesh:
    """One large element behind a plane, its surface "face"; same order and kind as the bodies.

    Raises InvalidInput where a body of revolution would not stay one.
    """
    from ....mechanics.meshes import Facets
    from ....mechanics.meshes.facets import Cells
    from ....mechanics.meshes.order import second_order

    every = np.concatenate([body.mesh.points for body in model.bodies])
    n, dim = np.array(plane, dtype=float), model.dimension
    size = float(np.ptp(every, axis=0).max())
    middle = every.mean(axis=0)
    middle = middle - ((middle - np.array(point)) @ n) * n
    if model.axisymmetric and abs(n[0]) > 1e-12:
        raise InvalidInput("a plane around an axis: expected a normal along the axis")
    sides = np.linalg.svd(n[None])[2][1:] * size * 2
    if dim == 2:
        side = np.array([n[1], -n[0]]) * size * 2
        left = -side
        if model.axisymmetric:
            left, side = -middle * [1, 0], np.array([size * 2, 0.0]) * np.sign(n[1])
            left, side = (left, side) if n[1] > 0 else (-side, -middle * [1, 0])
        top = np.stack([middle + side, middle + left])
        points = np.concatenate([top[::-1] - size * n, top])
        kind, face = "quad", [[2, 3]]
    else:
        a, b = sides
        if np.cross(a, b) @ n < 0:
            a, b = b, a
        top = np.stack([middle - a - b, middle + a - b, middle + a + b, middle - a + b])
        points = np.concatenate([top - size * n, top])
        kind, face = "hex", [[4, 5, 6, 7]]
    mesh = Mesh(
        points, (Cells(kind, np.arange(len(points))[None], "obstacle"),),
        {"face": (Facets("line" if dim == 2 else "quad", np.array(face)),)},
        axisymmetric=model.axisymmetric,
    )  # fmt: skip
    if model.bodies[0].mesh.order == 2:
        mesh = second_order(mesh, serendipity=True)
    assert mesh.cells[0].kind in CELLS
    return mesh
