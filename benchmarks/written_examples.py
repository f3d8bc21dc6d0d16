"""Models written as decks and given to CalculiX: its displacements beside our own solve.

    python benchmarks/written_examples.py [--ccx PROGRAM] [--only NAME ...]

All ready-made examples, decks of CalculiX' own tests read and written again, and the small
models of written_models.py.  Writes results/written_examples.md.
"""

import argparse
import re
import shutil
import subprocess
import tempfile
import warnings
from pathlib import Path

import numpy as np
from decks import PLACE
from machine import describe
from written_models import MODELS

import amontons as am
from amontons.io.answers.frd import read_frd
from amontons.io.readers import read

HERE = Path(__file__).parent
EXAMPLES = HERE.parent / "src" / "amontons" / "examples_data"
PATIENCE = 60  # seconds for ccx
STIFFER = 100  # times the stiffness of hard contact there, 50 E
HARD = 50.0  # CalculiX' stiffness of hard contact, over Young's modulus
MOST = 12000  # nodes of a deck that is written again
TOLERANCE = 1e-9
HEAD = """# Decks that are written, and what CalculiX makes of them

`am.write_deck` of every model, CalculiX {version} on that deck, and our own solve of the model.
Regenerate: `python benchmarks/written_examples.py`.

again: the deck read and solved by us (`deck.hard` where contact is hard), beside the model:
what writing and reading lose.  HARD: largest difference of displacements between CalculiX and
our solve, over the largest displacement; its hard contact is a penalty of 50 E.  same law:
beside our solve of the same deck with that penalty; what is left is how contact is discretised.
{times} K: both again with the penalty {times} times as stiff, hard here: what comes from the
stiffness is {times} times smaller.  F: largest difference of the resultant of outside forces on
a body with HARD, over the sum of the sizes of those on its nodes;
empty with large deformations.

"""


def solved(model):
    """Displacements (nodes, dim) of all bodies, outside forces (nodes, dim) there, contacts.

    Forces: None in large deformations, which have no one stiffness.
    """
    found = am.solve(model, tolerance=TOLERANCE, time_limit=300)
    u, contacts = np.concatenate([*found.displacement]), found.solution.problem.contacts
    if model.is_large:
        return u, None, contacts
    parts = model.discretisation
    K, H = parts.K.tocsr()[: u.size, : u.size], parts.whole_H.tocsr()[: u.size]
    force = K @ u.ravel() - H @ found.solution.r.ravel()
    heat = heated(model, u.size)
    return u, (force - heat).reshape(u.shape), contacts


def heated(model, size):
    """Nodal forces of thermal strains, which are none from outside."""
    from amontons.mechanics.model.beside import Beside
    from amontons.mechanics.model.supports import external_load

    beside = Beside.of(model.bodies, model.references, model.constraints)
    loads = [load if isinstance(load, am.Temperature) else None for load in model.loads]
    if not any(loads):
        return np.zeros(size)
    return model.load_factor * external_load(model.bodies, loads, beside, own=False)[:size]


def theirs(program, folder, name, count, dim):
    """Displacements and forces (count, dim) of the end; raises RuntimeError with its words."""
    try:
        done = subprocess.run([program, name], cwd=folder, capture_output=True,
                              timeout=PATIENCE, text=True, errors="replace")  # fmt: skip
    except subprocess.TimeoutExpired:
        raise RuntimeError(f"not done after {PATIENCE} s") from None
    lines = done.stdout.splitlines()
    said = [k for k, x in enumerate(lines) if "*ERROR" in x or "best solution" in x]
    path = folder / f"{name}.frd"
    blocks = read_frd(path).blocks if path.is_file() else []
    ends = [b for b in blocks if b.name == "DISP" and np.isclose(b.time, 1.0)]
    if not ends:
        text = " ".join(" ".join(lines[said[0] : said[0] + 2]).split()) if said else "stops"
        raise RuntimeError(text[:90])
    out = []
    for word in ("DISP", "FORC"):
        block = [b for b in blocks if b.name == word][-1]
        values = np.zeros((count, 3))
        fits = block.labels <= count
        values[block.labels[fits] - 1] = block.values[fits, :3]
        out.append(values[:, :dim])
    return out


def apart(one, other):
    """Largest difference over the largest of both."""
    size = max(np.abs(one).max(initial=0.0), np.abs(other).max(initial=0.0))
    return float(np.abs(one - other).max(initial=0.0) / size) if size else 0.0


def resultants(model, force):
    """Sums over each body (bodies, dim)."""
    if model.axisymmetric:  # along the radius hoops push too
        force = force[:, 1:]
    ends = np.cumsum([len(b.mesh.points) for b in model.bodies])[:-1]
    return np.array([part.sum(axis=0) for part in np.split(force, ends)])


def compared(name, model, program, folder):
    """One row of the table."""
    am.write_deck(model, folder / "a.inp")
    given = [c for c in model.contacts if c.stiffness is not None]
    u, force, contacts = solved(model)
    row = {"name": name, "unknowns": u.size, "contacts": contacts}
    count, dim = u.shape
    again, *_ = solved(read(folder / "a.inp", [] if given else ["deck.hard=true"]).model)
    row["again"] = apart(again[:count], u)
    other, outside = theirs(program, folder, "a", count, dim)
    row["hard"] = apart(other, u)
    if "OVERCLOSURE" not in (folder / "a.inp").read_text():
        return row  # CalculiX counts forces of ties among those from outside
    if force is not None:
        one, two = resultants(model, outside), resultants(model, force)
        size = max(resultants(model, np.abs(f)).max() for f in (force, outside))
        row["force"] = float(np.abs(one - two).max() / size)
    penalty = HARD * max(young(model))
    am.write_deck(model, folder / "b.inp", penalty=penalty)
    soft, *_ = solved(read(folder / "b.inp", []).model)
    row["law"] = apart(other, soft[:count])
    if not given:
        am.write_deck(model, folder / "c.inp", penalty=STIFFER * penalty)
        row["stiff"] = apart(theirs(program, folder, "c", count, dim)[0], u)
    return row


def young(model):
    """Largest Young's modulus of each law of a model."""
    laws = [b.material for b in model.bodies]
    every = [x for law in laws for x in (law.values() if isinstance(law, dict) else [law])]
    return [float(np.max(law.young)) for law in every]


def sources(only):
    """(name, model or the reason why there is none)."""
    places = [*sorted(EXAMPLES.glob("*.toml"))]
    if Path(PLACE).is_dir():
        places += sorted((*Path(PLACE).glob("*.inp"), *Path(PLACE).glob("*.inp.gz")))
    for path in places:
        name = path.name.split(".")[0]
        if only and name not in only:
            continue
        try:
            case = read(path, [])
            yield (f"example {name}" if path.suffix == ".toml" else name), case.model
        except am.AmontonsError as error:
            if path.suffix == ".toml":
                yield name, str(error)
    for name, make in MODELS.items():
        if not only or name in only:
            yield name, make()


def shown(value):
    return "" if value is None else f"{value:.1e}"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--ccx", default=shutil.which("ccx"))
    parser.add_argument("--only", nargs="*")
    asked = parser.parse_args()
    if asked.ccx is None:
        print("ccx: no such program, nothing is done; --ccx PROGRAM")
        return
    warnings.simplefilter("ignore", am.DoubtWarning)
    rows, refused = [], []
    for name, model in sources(asked.only):
        row = {"name": name}
        if isinstance(model, str):
            refused.append((name, model))
            continue
        if sum(len(b.mesh.points) for b in model.bodies) > MOST:
            refused.append((name, f"more than {MOST} nodes: left out here"))
            continue
        with tempfile.TemporaryDirectory() as place:
            try:
                row = compared(name, model, asked.ccx, Path(place))
            except am.AmontonsError as error:
                refused.append((name, str(error)))
                print(refused[-1], flush=True)
                continue
            except RuntimeError as error:
                row["said"] = f"CalculiX: {error}"
        rows.append(row)
        print(row, flush=True)
    if not asked.only:
        (HERE / "results" / "written_examples.md").write_text(page(rows, refused, asked.ccx))


def page(rows, refused, program):
    """The page of results."""
    done = subprocess.run([program, "-v"], capture_output=True, text=True, check=False)
    version = re.search(r"[\d.]+", done.stdout or "")
    keys = ("again", "hard", "law", "stiff", "force")
    titles = ("model", "unknowns", "contacts", "again", "HARD", "same law", f"{STIFFER} K",
              "F", "")  # fmt: skip
    lines = [f"| {' | '.join(titles)} |", "|---|" + "---:|" * (len(titles) - 2) + "---|"]
    for row in rows:
        cells = [row["name"], row.get("unknowns", ""), row.get("contacts", "")]
        cells += [shown(row.get(key)) for key in keys]
        cells += [row.get("said", REASONS.get(row["name"], ""))]
        lines.append(f"| {' | '.join(map(str, cells))} |")
    lines += ["", "What is not written:", "", "| model | reason |", "|---|---|"]
    lines += [f"| {name} | {' '.join(said.split())[-160:]} |" for name, said in refused]
    head = HEAD.format(version=version.group() if version else "", times=STIFFER)
    about = ", ".join(f"{k} {v}" for k, v in describe().items())
    return f"{head}{chr(10).join(lines)}\n\n{about}\n"


REASONS = {
    "example brake": "two solutions: released, and jammed",
    "example hild": "several solutions: CalculiX jumps to another one at 100 K",
    "example cube": "slips at points there, at nodes here",
    "friction, dragged 3D": "slips at points there, averages here",
    "tied 2D": "CalculiX ties 2D elements by a penalty at points, which locks at 100 K",
    "pair table": "NODE TO SURFACE there",
    **dict.fromkeys(
        (
            "pair 2D",
            "pair 3D",
            "pair 3D tetrahedra",
            "pair friction 2D",
            "pair friction 3D",
            "pair clearance",
            "pair heated",
            "pair linear law",
            "rings",
        ),
        "meshes that do not fit: points there, averages here",
    ),
    "pair 2D twice as fine": "falls with the size of facets",
    "pair 2D four times as fine": "falls with the size of facets",
    "tied 3D": "held slave nodes are tied by a penalty at points, which locks",
    "tied 3D, slave free": "meshes that do not fit: nodes are tied there",
    **dict.fromkeys(
        ("contact1", "contact4", "plate", "punch1", "punch2", "cubef2f1", "cubef2f3"),
        "few facets under an edge, see [the decks](decks.md)",
    ),
}


if __name__ == "__main__":
    main()
