"""Own decks beside CalculiX and a closed form: who is right where both differ.

    python benchmarks/decks_own.py [--ccx PROGRAM]

A pin pressed into a bore with an interference, plane strain, a quarter of hexahedra, without
friction: the outside of the ring moves by what Lame's formulas say.  Pin and bore have other
numbers of facets, whose chords are farther from the circles than the interference is deep.
Writes results/decks_own.md.
"""

import argparse
import itertools
import shutil
import tempfile
from pathlib import Path

import decks
import numpy as np

HERE = Path(__file__).parent / "results"
YOUNG, POISSON = 1000.0, 0.3
HOLE, BORE, OUTSIDE = 0.25, 1.0, 2.0  # radii: inside of the pin, of the ring
DEEP = 1e-3  # interference
STIFFNESS = 1e5  # of contact, pressure over overclosure
FACETS = ((8, 6), (16, 12), (32, 24), (64, 48))  # on a quarter of pin and bore
HEAD = f"""# Own decks beside CalculiX and a closed form

Regenerate: `python benchmarks/decks_own.py` (needs CalculiX, 2.20 here).

A pin pressed into a bore of radius {BORE:g} with an interference of {DEEP:g}, plane strain, a
quarter of hexahedra (C3D8I), frictionless, small strains, surface to surface: how far the
outside moves, over Lame's value. "sagitta": how far chords of the bore's facets are from its
circle. CalculiX takes facets as they are, chords that do not match overlap, and what that adds
falls with the square of their length; here gaps are those of the circles behind the facets. The
stiffness of contact alone makes {{give:.2%}} less.

| facets of pin, bore | sagitta over interference | CalculiX | ours |
|---|---:|---:|---:|
"""


def sector(inner, outer, facets, first):
    """Points and cells of a quarter of a ring, and its numbers of nodes, from first on."""
    nr, numbers, points = max(2, 3 * facets // 4), {}, []
    for k, j, i in itertools.product(range(2), range(facets + 1), range(nr + 1)):
        r, a = inner + (outer - inner) * i / nr, np.pi / 2 * j / facets
        numbers[i, j, k] = first + len(points)
        points.append((r * np.cos(a), r * np.sin(a), 0.1 * k))
    around = ((0, 0), (1, 0), (1, 1), (0, 1))
    cells = [[numbers[i + a, j + b, k] for k in range(2) for a, b in around]
             for j in range(facets) for i in range(nr)]  # fmt: skip
    return points, cells, [numbers[nr, j, 0] for j in range(facets + 1)], nr


def deck(on_pin, on_bore):
    """(text, nodes of the outside, points)."""
    points, cells, _, nr = sector(HOLE, BORE + DEEP, on_pin, 1)
    more, others, outside, nr_ring = sector(BORE, OUTSIDE, on_bore, 1 + len(points))
    first, points, cells = len(cells), points + more, cells + others
    rows = lambda table: [  # noqa: E731
        f"{k + 1}, " + ", ".join(f"{x:.12g}" for x in row) for k, row in enumerate(table)
    ]
    held = [f"{k + 1}, {c}, {c}" for k, p in enumerate(points)
            for c, x in ((1, p[0]), (2, p[1]), (3, 0.0)) if abs(x) < 1e-9]  # fmt: skip
    lines = [
        "*NODE, NSET=ALL", *rows(points), "*ELEMENT, TYPE=C3D8I, ELSET=EALL", *rows(cells),
        "*SURFACE, NAME=MASTER", *(f"{(j + 1) * nr}, S4" for j in range(on_pin)),
        "*SURFACE, NAME=SLAVE", *(f"{first + j * nr_ring + 1}, S6" for j in range(on_bore)),
        "*BOUNDARY", *held, "*MATERIAL, NAME=M", "*ELASTIC", f"{YOUNG}, {POISSON}",
        "*SOLID SECTION, ELSET=EALL, MATERIAL=M", "*SURFACE INTERACTION, NAME=I",
        "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR", f"{STIFFNESS}",
        "*CONTACT PAIR, INTERACTION=I, TYPE=SURFACE TO SURFACE", "SLAVE, MASTER",
        "*STEP, INC=100", "*STATIC", "1., 1.", "*NODE PRINT, NSET=ALL", "U", "*END STEP",
    ]  # fmt: skip
    return "\n".join(lines) + "\n", outside, np.array(points)


def lame():
    """(motion of the outside, overlap that the stiffness leaves over the interference)."""
    young = YOUNG / (1 - POISSON**2)  # of plane strain
    a, b, c = BORE**2, OUTSIDE**2, HOLE**2
    pressure = DEEP * young / BORE / ((b + a) / (b - a) + (a + c) / (a - c))
    return 2 * pressure * a * OUTSIDE / (young * (b - a)), pressure / STIFFNESS / DEEP


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--ccx", default=shutil.which("ccx"))
    asked = parser.parse_args()
    exact, give = lame()
    lines = []
    for facets in FACETS:
        text, outside, points = deck(*facets)
        with tempfile.TemporaryDirectory() as place:
            path = Path(place) / "pin.inp"
            path.write_text(text, encoding="latin-1")
            own, at = decks.ours(path, times=(1.0,))[0], decks.nodes_of(path)
            found = decks.theirs(asked.ccx, text, "pin", Path(place)) if asked.ccx else None
        mine = {n: own[max(own)][0][k] for n, k in at.items()}
        both = [mine] if found is None else [found[0][max(found[0])], mine]
        radial = [[np.dot(u[n][:2], points[n - 1, :2]) / OUTSIDE for n in outside]
                  for u in both]  # fmt: skip
        told = [np.mean(each) / exact for each in radial]
        sagitta = BORE * (1 - np.cos(np.pi / 4 / facets[1])) / DEEP
        cells = ["", *map("{:.3f}".format, told)][-2:]
        lines.append(f"| {facets[0]}, {facets[1]} | {sagitta:.2f} | {' | '.join(cells)} |")
        print(lines[-1], flush=True)
    (HERE / "decks_own.md").write_text(HEAD.format(give=give) + "\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
