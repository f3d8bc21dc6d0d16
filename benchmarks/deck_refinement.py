"""A deck with every element cut into halves along all sides, nothing else changed.

Nodes of the deck keep their numbers and shapes of elements stay what they are, so that
displacements at old nodes can be compared.  Slave nodes that the deck puts onto the master
are there already.  For decks without parts, of quadrilaterals and hexahedra.
"""

from itertools import product

import numpy as np

from amontons.io.decks.cards import read_cards
from amontons.io.decks.flat import flatten
from amontons.io.decks.shapes import SHAPES, side_of
from amontons.io.readers import read
from amontons.mechanics.meshes.cells import CELLS

PER_LINE = 8  # numbers; CalculiX reads 20 letters of each


def refined(path):
    """The text of the refined deck."""
    cards = read_cards(path)
    deck = flatten(cards)
    mesh = Halves(deck, adjusted_points(path, deck))
    out = []
    for card in cards:
        if card.keyword in ("NODE", "ELEMENT", "NSET", "ELSET", "SURFACE"):
            continue
        if not mesh.written and card.keyword != "HEADING":
            out += mesh.lines()
        out.append(head_of(card))
        if card.keyword == "DLOAD":
            out += [
                f"{child}, {label}, {value}"
                for name, label, value in (row.fields for row in card.rows())
                for child in mesh.beside(deck.top.elements(name, None), label)
            ]
        else:
            out += [line for piece in card.pieces for line in piece.text.split("\n") if line]
    return "\n".join(out) + "\n"


def head_of(card):
    """The keyword line, without ADJUST."""
    options = [f"{k}={v}" if v else k for k, v in card.options.items() if k != "ADJUST"]
    return ", ".join([f"*{card.written}", *options])


def adjusted_points(path, deck):
    """Points of the deck as its contact pairs have adjusted them."""
    mesh = read(path).model.bodies[0].mesh
    used = np.zeros(len(deck.points), dtype=bool)
    for block in deck.blocks:
        used[block.nodes] = True
    points = np.array(deck.points)
    points[used, : mesh.points.shape[1]] = mesh.points
    return points


class Halves:
    """The halves of all elements: children of element e are 2^d e, 2^d e + 1, ..."""

    def __init__(self, deck, points):
        names = deck.top.own
        self.deck, self.written = deck, False
        self.labels = dict(zip(names.node_at.tolist(), names.node_labels.tolist(), strict=True))
        self.points = {self.labels[k]: x for k, x in enumerate(points)}
        self.parents = {}  # label of a new node -> labels of the old ones it lies between
        self.known, self.children = {}, {}
        numbers = dict(
            zip(names.element_at.tolist(), names.element_labels.tolist(), strict=True)
        )
        self.elements = numbers
        for block in deck.blocks:
            cell = CELLS[SHAPES[block.kind].cell]
            for k, nodes in enumerate(block.nodes):
                self.cut(block.kind, cell, block.first + k, nodes, points)

    def cut(self, kind, cell, element, nodes, points):
        """Make the children of one element."""
        for number, octant in enumerate(product((0, 1), repeat=cell.dim)):
            weights = cell.shape((cell.corners + octant) / 2.0)
            made = [self.node(nodes, w, points) for w in weights]
            label = 2**cell.dim * self.elements[element] + number
            self.children.setdefault(element, []).append((label, kind, octant, made))

    def node(self, nodes, weights, points):
        """The label of a point of an element, by the old nodes it depends on."""
        at = np.flatnonzero(np.abs(weights) > 1e-9)
        key = tuple(sorted((int(nodes[k]), round(float(weights[k]), 9)) for k in at))
        if key not in self.known:
            label = self.labels[key[0][0]] if len(key) == 1 else max(self.points) + 1
            self.known[key] = label
            self.parents[label] = [n for n, _ in key]
            self.points[label] = weights @ points[nodes]
        return self.known[key]

    def beside(self, elements, label):
        """Labels of the children that lie on a side of their parents."""
        side, out = side_of(label.upper()), []
        for element in elements:
            for child, kind, octant, _ in self.children[int(element)]:
                shape = SHAPES[kind]
                x = CELLS[shape.cell].corners[list(shape.sides[side])]
                axis = int(np.ptp(x, axis=0).argmin())
                if octant[axis] == x[0, axis]:
                    out.append(child)
        return out

    def lines(self):
        """The cards of the mesh."""
        self.written = True
        names, out = self.deck.top.own, ["*NODE, NSET=NALL"]
        out += [f"{n}, " + ", ".join(f"{v:.12e}" for v in x) for n, x in self.points.items()]
        flat = [child for children in self.children.values() for child in children]
        for kind in dict.fromkeys(child[1] for child in flat):
            out.append(f"*ELEMENT, TYPE={kind}")
            for label, own, _, nodes in flat:
                out += joined([label, *nodes]) if own == kind else []
        for name, nodes in names.node_sets.items():
            inside = set(nodes.tolist())
            chosen = [n for n, p in self.parents.items() if inside.issuperset(p)]
            out += [f"*NSET, NSET={name}", *map(str, chosen)] if name != "NALL" else []
        for name, elements in names.element_sets.items():
            own = [c[0] for e in elements.tolist() for c in self.children[e]]
            out += [f"*ELSET, ELSET={name}", *map(str, own)]
        for name, faces in names.faces.items():
            out.append(f"*SURFACE, NAME={name}")
            out += [f"{c}, {s}" for elements, s in faces for c in self.beside(elements, s)]
        return out


def joined(numbers):
    """Lines of an element; all but the last end in a comma."""
    parts = [numbers[k : k + PER_LINE] for k in range(0, len(numbers), PER_LINE)]
    lines = [", ".join(map(str, part)) + "," for part in parts]
    return [*lines[:-1], lines[-1].removesuffix(",")]
