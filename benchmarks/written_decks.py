"""Models written as decks, solved by CalculiX, beside our own answers.

    python benchmarks/written_decks.py [--ccx PROGRAM] [--only NAME ...]

Each model is written for CalculiX, with a hard contact of two stiffnesses, the second a hundred
times the first, and solved by `ccx`; the answer is audited too.  What the columns are stands
on the page that it writes, results/written_decks.md.
"""

import argparse
import shutil
import subprocess
import tempfile
from pathlib import Path

import numpy as np
from click.testing import CliRunner
from decks import frd_blocks, text_of

import amontons as am
from amontons.app.cli import main as command

HERE = Path(__file__).parent / "results"
HEAD = """# Models written as decks

Written by `am.write_deck`, solved by CalculiX 2.20, beside our own answers to the models.
Regenerate: `python benchmarks/written_decks.py`.

u: largest difference of displacements over the largest displacement, with CalculiX' own hard
contact, 50 E; "100 K": with contact a hundred times as stiff; "deck": CalculiX beside our own
answer to the deck as it was written, with its stiffness and slope of sticking; "deck, finer":
the same on half the mesh width. "audit": what `amontons audit --law own` says of it:
where two answers differ and both are right, the problem has several solutions.
Where contact carries load, CalculiX sums it up in points of the slave's facets and we as mortar
averages; that difference falls with the mesh. It takes the mean temperature of each brick.

"""
STEEL = am.LinearElastic(210e3, 0.3, density=7.8e-9, expansion=1.2e-5)
SOFT = am.LinearElastic(1000.0, 0.3, density=1e-3, expansion=1e-4)
HARD = 50  # times E: the stiffness of hard contact in CalculiX
PATIENCE = 120  # seconds for ccx


# --------------------------------------------------------------------------------- models
def bricks(n, kind, order, mu, shear=0.3):
    """A block on another one, meshes that do not match, pressed and pushed."""
    lower = am.Body(am.box((3, 3, 1), (4 * n, 4 * n, 2 * n), kind), SOFT, "lower", order=order)
    mesh = am.box((1, 1, 1), (3 * n, 3 * n, 2 * n), kind, origin=(1, 1, 1))
    upper = am.Body(mesh, SOFT, "upper", order=order)
    return am.Model(
        [lower, upper],
        [am.Fix("lower.bottom", 0), am.Fix("upper.left", (None, 0, None)),
         am.Fix("upper.top", (shear * 0.01, None, -0.01))],
        [am.Contact("upper.bottom", master="lower.top", mu=mu)],
    )  # fmt: skip


def plane(n, kind, order, state, mu):
    """The same in the plane."""
    law = am.LinearElastic(1000.0, 0.3, plane=state)
    lower = am.Body(am.box((3, 1), (7 * n, 3 * n), kind), law, "lower", order=order)
    mesh = am.box((1, 1), (4 * n, 4 * n), kind, origin=(1, 1))
    upper = am.Body(mesh, law, "upper", order=order)
    return am.Model(
        [lower, upper],
        [am.Fix("lower.bottom", 0), am.Fix("upper.top", (0.003, -0.01))],
        [am.Contact("upper.bottom", master="lower.top", mu=mu)],
    )


def rings(n, order):
    """A press fit around an axis."""
    inner = am.box((20, 19), (4 * n, 4 * n), origin=(20.005, 0))
    outer = am.box((20, 19), (4 * n, 4 * n), origin=(40, 0))
    law = am.LinearElastic(210e3, 0.3)
    bodies = [am.Body(inner, law, "inner", order=order, axisymmetric=True),
              am.Body(outer, law, "outer", order=order, axisymmetric=True)]  # fmt: skip
    return am.Model(
        bodies, [am.Fix("inner.bottom", (None, 0)), am.Fix("outer.bottom", (None, 0))],
        [am.Contact("inner.right", master="outer.left", mu=0.0)],
    )


def floor(n, mu):
    """A block on a plane, pressed and pushed at its top."""
    body = am.Body(am.box((2, 1, 1), (6 * n, 3 * n, 3 * n)), SOFT)
    return am.Model([body], [am.Fix("front", (None, 0, None)), am.Fix("left", (0, None, None))],
                    [am.Contact("bottom", am.Plane((0, 0, 1)), mu=mu)],
                    [am.Traction("top", (0, 0, -10.0)), am.Pressure("right", 2.0)])  # fmt: skip


def clear(n):
    """A block that is pressed through a clearance."""
    body = am.Body(am.box((2, 1), (6 * n, 3 * n)), SOFT)
    return am.Model([body], [am.Fix("top", (0, -0.02))],
                    [am.Contact("bottom", am.Plane((0, 1)), mu=0.0, clearance=0.005)])


def glued(n):
    """Two blocks that are tied, meshes that do not match."""
    near = am.Body(am.box((1, 1, 1), 2 * n), SOFT, "near")
    far = am.Body(am.box((1, 1, 1), 3 * n, origin=(1, 0, 0)), SOFT, "far")
    return am.Model([near, far], [am.Fix("near.left", 0)],
                    [am.Contact("far.left", master="near.right", tied=True)],
                    [am.Traction("far.right", (1.0, 0.5, 0))])  # fmt: skip


def beam(kind="hex", order=1, law=STEEL, loads=(), **more):
    """A beam that is held at its left end."""
    body = am.Body(am.box((8, 1, 1), (8, 2, 2), kind), law, order=order)
    return am.Model([body], [am.Fix("left", 0)], loads=loads, **more)


def turned():
    """Supports along turned axes: a tube, a sector of it."""
    box = am.box((1, 1), (6, 4))
    r, a = 1 + box.points[:, 0], np.pi / 6 * box.points[:, 1]
    mesh = am.Mesh(np.stack([r * np.cos(a), r * np.sin(a)], 1), box.cells, box.surfaces)
    c, s = np.cos(np.pi / 6), np.sin(np.pi / 6)
    return am.Model([am.Body(mesh, SOFT)],
                    [am.Fix("bottom", (None, 0)), am.Fix("A", (None, 0))],
                    loads=[am.Pressure("left", 10.0)],
                    constraints=[am.Axes("A", "top", [[c, s], [-s, c]])])  # fmt: skip


def led(kind):
    """The end of a beam led by a reference."""
    return beam(loads=[am.NodalForce("R", (0, 0, -50.0)),
                       am.NodalForce("R.rotation", (80.0, 0, 0))],
                references=[am.Reference("R", (9.0, 0.5, 0.5))],
                constraints=[am.Coupling("right", "R", kind=kind)])  # fmt: skip


def sprung():
    """A block on springs."""
    body = am.Body(am.box((2, 1, 1), (2, 1, 1)), SOFT)
    springs = [am.Spring([("bottom", c, 1.0)], 50.0) for c in range(3)]
    return am.Model([body], loads=[am.Traction("top", (1.0, 0.5, -3.0))], springs=springs)


ORTHO = am.OrthotropicElastic((900.0, 1100.0, 1000.0), (0.2, 0.1, 0.15), (400.0, 300.0, 350.0))
PUSH = (am.Traction("right", (0.0, 0.0, -1.0)),)
MODELS = {
    "bricks, no friction": lambda n=1: bricks(n, "hex", 1, 0.0),
    "bricks that slip": lambda n=1: bricks(n, "hex", 1, 0.1, 1.0),
    "bricks that stick": lambda n=1: bricks(n, "hex", 1, 0.5),
    "tetrahedra": lambda n=1: bricks(n, "tet", 1, 0.3),
    "tetrahedra of ten nodes": lambda n=1: bricks(n, "tet", 2, 0.0),
    "plane strain": lambda n=1: plane(n, "quad", 1, "strain", 0.2),
    "plane stress": lambda n=1: plane(n, "quad", 1, "stress", 0.2),
    "triangles of six nodes": lambda n=1: plane(n, "tri", 2, "strain", 0.0),
    "press fit": lambda n=1: rings(n, 1),
    "block on a plane": lambda n=1: floor(n, 0.0),
    "block that sticks to a plane": lambda n=1: floor(n, 0.5),
    "clearance": lambda n=1: clear(n),
    "tie": lambda n=1: glued(n),
    "beam": lambda: beam(loads=PUSH),
    "beam, tetrahedra of ten nodes": lambda: beam("tet", 2, loads=PUSH),
    "orthotropic": lambda: beam(law=ORTHO, loads=PUSH),
    "weight": lambda: beam(loads=(am.BodyForce((0, 0, -1.0)),)),
    "pressure": lambda: beam(loads=(am.Pressure("top", 1.0),)),
    "pressure that varies": lambda: beam(loads=(am.Pressure("top", lambda x: x[0]),)),
    "heat": lambda: beam(loads=(am.Temperature(lambda x: 10 * x[2]),)),
    "turned supports": turned,
    "kinematic coupling": lambda: led("kinematic"),
    "distributing coupling": lambda: led("distributing"),
    "springs": sprung,
    "example: cube": lambda: am.read_case("example:cube").model,
    "example: brake": lambda: am.read_case("example:brake").model,
    "example: slab": lambda: am.read_case("example:slab").model,
    "example: hild": lambda: am.read_case("example:hild").model,
}


# ------------------------------------------------------------------------------ comparison
def of_ccx(program, path):
    """{node: displacement} at the end, or None with what ccx said."""
    done = subprocess.run([program, path.stem], cwd=path.parent, capture_output=True,
                          text=True, timeout=PATIENCE, check=False)  # fmt: skip
    frd = path.with_suffix(".frd")
    blocks = frd_blocks(text_of(frd)) if frd.exists() else {}
    errors = [line for line in done.stdout.splitlines() if "ERROR" in line]
    if errors or not blocks:
        return None, (errors or ["no result"])[0].strip()[:80]
    return blocks[max(blocks)], ""


def difference(theirs, ours):
    """Largest difference over the largest displacement; ours (nodes, dim) in their order."""
    dim = ours.shape[1]
    values = np.array([theirs[k + 1][:dim] for k in range(len(ours))])
    return float(np.abs(values - ours).max() / np.linalg.norm(ours, axis=1).max())


def compared(name, make, program):
    """A row of the table."""
    model = make()
    solved = am.solve(model, tolerance=1e-9)
    ours = np.concatenate([*solved.displacement])
    row = {"nodes": len(ours), "contacts": solved.problem.contacts}
    with tempfile.TemporaryDirectory() as place:
        path = Path(place) / "deck.inp"
        theirs, row["said"], row["deck"], row["audit"] = as_written(model, path, program)
        row["u"] = difference(theirs, ours)
        if model.contacts:
            am.write_deck(model, path, penalty=100 * HARD * young(model))
            theirs, row["said"] = of_ccx(program, path)
            row["stiff"] = None if theirs is None else difference(theirs, ours)
        if make.__code__.co_argcount:
            row["finer"] = as_written(make(2), path, program)[2]
    return row


def as_written(model, path, program):
    """CalculiX' answer, what it said, how far ours to the same deck is, and the verdict."""
    am.write_deck(model, path, penalty=HARD * young(model) if model.contacts else None)
    theirs, said = of_ccx(program, path)
    if theirs is None:
        raise am.AmontonsError(said)
    case = am.read_case(path)
    count = sum(len(body.mesh.points) for body in model.bodies)
    read = np.concatenate([*am.solve(case.model, tolerance=1e-9).displacement])[:count]
    moved = np.array([theirs[k + 1] for k in range(len(theirs))])
    verdict = audited(path)
    return theirs, said, difference(dict(enumerate(moved, 1)), read), verdict


def audited(path):
    """The first line of the audit of the .frd beside the deck."""
    files = [str(path), str(path.with_suffix(".frd"))]
    done = CliRunner().invoke(command, ["audit", *files, "--law", "own"])
    return done.output.splitlines()[0].rsplit(":", 1)[-1].strip() if done.output else "?"


def young(model):
    """Of the first body."""
    law = model.bodies[0].material
    law = next(iter(law.values())) if isinstance(law, dict) else law
    return float(law.young)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--ccx", default=shutil.which("ccx"))
    parser.add_argument("--only", nargs="*")
    asked = parser.parse_args()
    if asked.ccx is None:
        print("ccx: not found, nothing is done; --ccx PROGRAM")
        return
    lines = ["| model | nodes | contacts | u | u, 100 K | u, deck | deck, finer | audit |  |",
             "|---|---:|---:|---:|---:|---:|---:|---|---|"]  # fmt: skip
    for name, make in MODELS.items():
        if asked.only and name not in asked.only:
            continue
        try:
            row = compared(name, make, asked.ccx)
        except am.AmontonsError as error:
            row = {"said": " ".join(str(error).split())[:120]}
        cells = [name, row.get("nodes", ""), row.get("contacts", "")]
        numbers = (row.get(key) for key in ("u", "stiff", "deck", "finer"))
        cells += ["" if number is None else f"{number:.1e}" for number in numbers]
        cells += [row.get("audit", ""), row.get("said", "")]
        lines.append(f"| {' | '.join(map(str, cells))} |")
        print(lines[-1], flush=True)
    if not asked.only:
        (HERE / "written_decks.md").write_text(HEAD + "\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
