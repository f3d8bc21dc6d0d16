"""Random towers of blocks in parts, instances, sets of sets and files, or plain: the same."""

import gzip
import random
from dataclasses import dataclass, field

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from amontons.io.readers import read

RING = ((0, 0), (1, 0), (1, 1), (0, 1))


@dataclass
class Block:
    """A brick of elements: its own points (n, 3), elements (k, 8), and where it stands."""

    points: np.ndarray
    elements: np.ndarray
    shift: np.ndarray
    angle: float
    part: int
    low: list = field(default_factory=list)  # nodes below, above; elements below, above
    high: list = field(default_factory=list)
    first: list = field(default_factory=list)
    last: list = field(default_factory=list)

    @property
    def centre(self):
        return (self.points + self.shift).mean(axis=0)

    @property
    def placed(self):
        turn = Rotation.from_euler("z", self.angle, degrees=True)
        return turn.apply(self.points + self.shift - self.centre) + self.centre


def block(draw, part, below):
    counts = [draw.randint(1, 2) for _ in range(3)]
    size = [draw.uniform(0.5, 2) for _ in range(3)] if part else [2.0, 2.0, 1.0]
    grid = [(i, j, k) for k in range(counts[2] + 1) for j in range(counts[1] + 1)
            for i in range(counts[0] + 1)]  # fmt: skip
    number = {at: n for n, at in enumerate(grid)}
    points = np.array(grid) / counts * size + [draw.uniform(-5, 5) for _ in range(3)]
    cells = [(i, j, k) for k in range(counts[2]) for j in range(counts[1])
             for i in range(counts[0])]  # fmt: skip
    elements = [[number[i + a, j + b, k + c] for c in (0, 1) for a, b in RING]
                for i, j, k in cells]  # fmt: skip
    middle = points.mean(axis=0)
    shift = np.array([0.1 * draw.random(), 0.1 * draw.random(), below]) - middle
    shift[2] = below - points[:, 2].min()
    made = Block(points, np.array(elements), shift, draw.choice([0, draw.uniform(-180, 180)]),
                 part)  # fmt: skip
    made.low = [n for n, at in enumerate(grid) if at[2] == 0]
    made.high = [n for n, at in enumerate(grid) if at[2] == counts[2]]
    made.first = [e for e, at in enumerate(cells) if at[2] == 0]
    made.last = [e for e, at in enumerate(cells) if at[2] == counts[2] - 1]
    return made, below + size[2]


def tower(seed):
    """Blocks on one another, and what is the same in both decks: numbers of laws and loads."""
    draw = random.Random(seed)
    blocks, top = [], 0.0
    for part in range(draw.randint(2, 3)):
        made, top = block(draw, part, top)
        blocks.append(made)
    numbers = {"E": draw.uniform(100, 1e5), "nu": draw.uniform(0, 0.4),
               "mu": draw.uniform(0.05, 1), "K": 10 ** draw.uniform(3, 7),
               "p": draw.uniform(0.1, 2), "g": draw.uniform(1, 10), "u": draw.uniform(-1, 1),
               "f": draw.uniform(-1, 0), "hard": draw.random() < 0.5}  # fmt: skip
    return draw, blocks, numbers


def laws(n, form):
    hard = ["*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=HARD"]
    soft = ["*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR", form(n["K"])]
    return [
        "*MATERIAL, NAME=STEEL",
        "*ELASTIC",
        f"{form(n['E'])}, {form(n['nu'])}",
        "*DENSITY",
        form(1e-3),
        "*SURFACE INTERACTION, NAME=INT",
        *(hard if n["hard"] else soft),
        "*FRICTION",
        f"{form(n['mu'])},",
        "*AMPLITUDE, NAME=AMP",
        ", ".join(map(form, (0.0, 0.0, 0.5, 1.0))),
        ", ".join(map(form, (1.0, 0.5))),
    ]


def steps(n, form, bottom, top, above, every):
    held = ["*BOUNDARY", f"{bottom}, 1, 3"]
    one = [
        "*STEP",
        "*STATIC",
        f"{form(0.5)}, {form(1.0)}",
        "*BOUNDARY",
        f"{top}, 1, 2",
        "*DSLOAD",
        f"{above}, P, {form(n['p'])}",
        "*DLOAD",
        *(f"{e}, GRAV, {form(n['g'])}, 0., 0., -1." for e in every),
        "*END STEP",
    ]
    two = [
        "*STEP",
        "*STATIC",
        f"{form(0.5)}, {form(2.0)}",
        "*BOUNDARY, AMPLITUDE=AMP",
        f"{top}, 1, 1, {form(n['u'])}",
        "*CLOAD",
        f"{top}, 3, {form(n['f'])}",
        "*END STEP",
    ]
    return held, [*one, *two]


def plain(blocks, n):
    """The deck without parts, numbers from 1 on, one name for each thing."""
    out, cells, sets, at, element = ["*NODE"], [], [], 0, 0
    for k, b in enumerate(blocks):
        out += [f"{at + j + 1}, {x!r}, {y!r}, {z!r}" for j, (x, y, z)
                in enumerate(b.placed.tolist())]  # fmt: skip
        cells += [f"*ELEMENT, TYPE=C3D8, ELSET=E{k}"]
        cells += [f"{element + j + 1}, " + ", ".join(str(at + i + 1) for i in nodes)
                  for j, nodes in enumerate(b.elements.tolist())]  # fmt: skip
        sets += [
            f"*SURFACE, NAME=LOW{k}",
            *(f"{element + e + 1}, S1" for e in b.first),
            f"*SURFACE, NAME=HIGH{k}",
            *(f"{element + e + 1}, S2" for e in b.last),
        ]
        if k == 0:
            sets += ["*NSET, NSET=FIXED", *(str(at + i + 1) for i in b.low)]
        if b is blocks[-1]:
            sets += ["*NSET, NSET=TOP", *(str(at + i + 1) for i in b.high)]
        at, element = at + len(b.points), element + len(b.elements)
    each = range(len(blocks))
    sections = [f"*SOLID SECTION, ELSET=E{k}, MATERIAL=STEEL" for k in each]
    pairs = ["*CONTACT PAIR, INTERACTION=INT"]
    pairs += [f"LOW{k + 1}, HIGH{k}" for k in each[:-1]]
    held, loads = steps(n, repr, "FIXED", "TOP", f"HIGH{each[-1]}", [f"E{k}" for k in each])
    return "\n".join([*out, *cells, *sets, *laws(n, repr), *sections, *pairs, *held, *loads])


# ------------------------------------------------------------------------------------- odd
def fortran(draw):
    """A way to write numbers."""

    def form(value):
        return draw.choice([repr(value), f"{value:.17e}".replace("e", "D"),
                            f"{value:+.17E}", f" {value:.17e} "])  # fmt: skip

    return form


def part_lines(draw, b, k, form):
    """A part with numbers of its own, in any order, sets of sets and ranges."""
    count, cells = len(b.points), len(b.elements)
    if draw.random() < 0.5:
        labels, names = range(5, 5 + count), range(2, 2 + 3 * cells, 3)
    else:
        labels = draw.sample(range(1, 10**9), count)
        names = draw.sample(range(1, 10**9), cells)
    out = [f'*PART, NAME="Part {k}"', "*NODE, NSET=ALL NODES"]
    out += [f"{labels[i]}, " + ", ".join(form(float(c)) for c in x)
            for i, x in enumerate(b.points)]  # fmt: skip
    out += ["*ELEMENT, TYPE=C3D8, ELSET=CELLS"]
    for e, nodes in enumerate(b.elements.tolist()):
        line = [str(names[e]), *(str(labels[i]) for i in nodes)]
        cut = draw.choice([9, 4, 6])
        out += [", ".join(line[:cut]) + ("," if cut < 9 else ""), *filter(None, [", ".join(
            line[cut:])])]  # fmt: skip
    for title, chosen, known in (("LOW", b.low, labels), ("HIGH", b.high, labels)):
        out += members(draw, "NSET", title, [known[i] for i in chosen])
    for title, chosen in (("FIRST", b.first), ("LAST", b.last)):
        out += members(draw, "ELSET", title, [names[e] for e in chosen])
    out += [
        "*SURFACE, NAME=BELOW, TYPE=ELEMENT",
        "FIRST, S1",
        "*SURFACE, NAME=ABOVE",
        "LAST, s2",
        "** Section: one",
        "*SOLID SECTION, ELSET=CELLS, MATERIAL=Steel",
        ",",
        "*END PART",
    ]
    return out


def members(draw, kind, title, labels):
    """A set by a list, by a range, or by two other sets."""
    gaps = np.diff(labels)
    if len(set(gaps.tolist())) == 1 and gaps[0] > 0 and draw.random() < 0.7:
        return [f"*{kind}, {kind}={title}, GENERATE", f"{labels[0]}, {labels[-1]}, {gaps[0]},"]
    if len(labels) > 1 and draw.random() < 0.5:
        cut = draw.randrange(1, len(labels))
        return [f"*{kind}, {kind}=_{title}_a, INTERNAL", *map(str, labels[:cut]),
                f"*{kind}, {kind}=_{title}_b, INTERNAL", *map(str, labels[cut:]),
                f"*{kind}, {kind}={title}", f"_{title}_a, _{title}_b"]  # fmt: skip
    return [f"*{kind}, {kind}={title}", ", ".join(map(str, labels))]


def odd(draw, blocks, n):
    """The lines of the same deck with parts, instances and an assembly."""
    form, out = fortran(draw), ["*HEADING", "a tower"]
    for k, b in enumerate(blocks):
        out += part_lines(draw, b, k, form)
    out += ["*ASSEMBLY, NAME=Assembly"]
    for k, b in enumerate(blocks):
        a = b.centre
        out += [
            f'*INSTANCE, NAME=I-{k}, PART="Part {k}"',
            ", ".join(map(form, b.shift.tolist())),
        ]
        if b.angle:
            axis = [*a.tolist(), a[0], a[1], a[2] + draw.uniform(0.5, 3), b.angle]
            out += [", ".join(form(float(v)) for v in axis)]
        out += ["*END INSTANCE"]
    last = len(blocks) - 1
    out += [
        f"*NSET, NSET=Top set, INSTANCE=I-{last}",
        "HIGH",
        "*SURFACE, NAME=Upper side, TYPE=ELEMENT",
        f"I-{last}.LAST, S2",
        "*END ASSEMBLY",
    ]
    out += laws(n, form)
    for k in range(last):
        out += [
            "*CONTACT PAIR, INTERACTION=int, TYPE=SURFACE TO SURFACE",
            f"I-{k + 1}.BELOW, I-{k}.ABOVE",
        ]
    every = [f"I-{k}.CELLS" for k in range(len(blocks))]
    held, loads = steps(n, form, "I-0.LOW", '"Top set"', '"Upper side"', every)
    return [*out, *held, *loads]


def shuffled(draw, lines):
    """Letters, blanks, tabs, remarks and cuts of lines as somebody else would have them."""
    out = []
    for line in lines:
        if draw.random() < 0.1:
            out.append(draw.choice(["** remark, *NODE", "   ** \u00e9\u00df", "**", ""]))
        if draw.random() < 0.3:
            line = line.upper() if draw.random() < 0.5 else line.lower()
        if line.startswith("*") and "," in line:
            key, *rest = line.split(",")
            if draw.random() < 0.3:
                key = key.replace(" ", draw.choice(["", "  "]))
            line = draw.choice([", ", ",", " ,\t", ",\n", ",\n** between\n"]).join([key, *rest])
        elif not line.startswith("*") and draw.random() < 0.2:
            line = draw.choice([" ", "\t", ""]) + line.replace(
                ", ", draw.choice([",", "\t,  "])
            )
        out.append(line)
    return out


def written(draw, folder, lines):
    """The deck in one or several files; returns the first."""
    text, depth = [], 0
    begins = [k for k, line in enumerate(lines) if line.startswith("*") and line[1:2] != "*"]
    encoding = draw.choice(["utf-8", "utf-8-sig", "latin-1"])
    ends = draw.choice(["\n", "\r\n"])
    for a, b in zip(begins, [*begins[1:], len(lines)], strict=True):
        chunk = lines[a:b]
        if draw.random() < 0.15 and not chunk[0].rstrip().endswith(",") and len(chunk) > 1:
            place = folder / f"sub {depth}"
            place.mkdir()
            (place / "inner.inc").write_bytes(ends.join(chunk[1:]).encode(encoding))
            (place / "outer.inc").write_bytes(
                f"** at {depth}{ends}*INCLUDE, INPUT=inner.inc{ends}".encode(encoding)
            )
            chunk = [chunk[0], f"*Include, Input=sub {depth}/outer.inc"]
            depth += 1
        text += chunk
    data = ends.join(text).encode(encoding)
    packed = draw.random() < 0.3
    path = folder / ("odd.inp.gz" if packed else "odd.inp")
    path.write_bytes(gzip.compress(data) if packed else data)
    return path


@pytest.mark.parametrize("seed", range(40))
def test_a_deck_in_parts_and_files_is_the_plain_one(tmp_path, seed):
    draw, blocks, numbers = tower(seed)
    (tmp_path / "plain.inp").write_text(plain(blocks, numbers))
    wanted = read(tmp_path / "plain.inp")
    lines = shuffled(draw, odd(draw, blocks, numbers))
    lines = "\n".join(lines).split("\n")
    found = read(written(draw, tmp_path, lines))
    for one, other in zip(found.in_time.contacts, wanted.in_time.contacts, strict=True):
        assert one.numbers == other.numbers
    for time in (0.5, 1.0, 2.0, 3.0):
        ours, theirs = (case.about.at(time).assemble() for case in (found, wanted))
        for name in ("M", "H", "f", "w"):
            a, b = (np.asarray(getattr(p, name).toarray() if name in "MH" else getattr(p, name))
                    for p in (ours, theirs))  # fmt: skip
            # turned by another code: rounding of coordinates of size 5
            np.testing.assert_allclose(a, b, atol=1e-9 * max(np.abs(b).max(), 1.0), rtol=0)
