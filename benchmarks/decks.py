"""The decks of CalculiX' own tests: solved unedited, beside the answers that come with them.

    python benchmarks/decks.py [--decks DIR] [--ccx PROGRAM] [--only NAME ...] [--explain]

DIR holds *.inp or *.inp.gz with *.dat.ref and *.frd.ref, packed or not; by default what
AMONTONS_DECKS says, else where Debian's calculix-ccx-test puts them.  Every deck that is not
solved must end with exit code 2 and one message with file and line.  Where `ccx` is installed,
decks with a stiffness of contact are solved again by both with 100 times of it, and hard by
us: a difference that comes from the stiffness falls with it.  Writes results/decks.md; with
--explain results/decks_explained.md, see decks_explained.py.
"""

import argparse
import contextlib
import gzip
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections import Counter, defaultdict
from pathlib import Path

import numpy as np
from click.testing import CliRunner
from decks_explained import explain, stiffness

import amontons as am
from amontons.app.cli import main as command
from amontons.io.decks.cards import read_cards
from amontons.io.decks.flat import flatten
from amontons.io.readers import read
from amontons.mechanics.contact import frames
from amontons.mechanics.model.formulation import has_finite_strains
from amontons.mechanics.model.nonlinear_parts import nonlinear_parts

HERE = Path(__file__).parent / "results"
PLACE = "/usr/share/doc/calculix-ccx-test/examples/test"
HEAD = """# Decks of CalculiX' own tests

Solved unedited, beside the answers that come with them.
Regenerate: `python benchmarks/decks.py`.

u: largest difference of displacements, over the largest displacement; RF: the same of reaction
forces, where they are printed. "hard": contact hard here, beside the same answer. "100 K":
CalculiX 2.20 run again with contact a hundred times as stiff, beside ours with that stiffness
("both") and beside ours with hard contact: what comes from the stiffness falls there.

"""
TIMES = 100  # the stiffness of the deck in the second comparison
SECONDS = 300  # of one solve
PATIENCE = 60  # seconds for ccx
FIRST = (
    "hueeber1 hueeber2 hueeber3 hueeber4 contactenergy contact1 contact3 contact6 friction1 "
    "friction2 cubespring changefric fricloop contact4 punch1"
).split()


# ------------------------------------------------------------------------------- references
def text_of(path):
    """A file, packed or not."""
    data = path.read_bytes()
    return (gzip.decompress(data) if data[:2] == b"\x1f\x8b" else data).decode("latin-1")


def dat_blocks(text, word):
    """{time: {node: values}} of a .dat file: displacements or forces."""
    found, now = {}, None
    for line in text.splitlines():
        if " for set " in line or " for all " in line:
            head = line.strip().startswith(f"{word} (")
            at = re.search(r"time\s+(\S+)", line)
            now = found.setdefault(float(at.group(1)), {}) if head and at else None
        elif now is not None and (parts := line.split()):
            if len(parts) != 4:
                now = None
                continue
            now[int(parts[0])] = [float(x) for x in parts[1:]]
    return found


def frd_blocks(text):
    """{time: {node: displacement}} of an .frd file."""
    found, time_, now = {}, None, None
    for line in text.splitlines():
        if line.startswith("  100CL"):
            time_ = float(line[12:24])
        elif line.startswith(" -4"):
            now = found.setdefault(time_, {}) if line.split()[1] == "DISP" else None
        elif line.startswith(" -3"):
            now = None
        elif now is not None and line.startswith(" -1"):
            now[int(line[3:13])] = [float(line[13 + 12 * k : 25 + 12 * k]) for k in range(3)]
    return found


def references(folder, name):
    """(displacements, forces), {time: {node: values}} each."""
    moved, forces = {}, {}
    for path in sorted(folder.glob(f"{name}.*")):
        if re.search(r"\.dat(\.ref)?(\.gz)?$", path.name):
            text = text_of(path)
            moved |= dat_blocks(text, "displacements")
            forces |= dat_blocks(text, "forces")
    for path in sorted(folder.glob(f"{name}.frd*")):
        for at, values in frd_blocks(text_of(path)).items():
            if not any(np.isclose(at, t) for t in moved):
                moved[at] = values
    return moved, forces


# ------------------------------------------------------------------------------------- ours
def nodes_of(path):
    """Number in the mesh of each label of a deck without parts."""
    deck = flatten(read_cards(path))
    used = np.zeros(len(deck.points), dtype=bool)
    for block in deck.blocks:
        used[block.nodes] = True
    at = np.where(used, np.cumsum(used) - 1, -1)
    own = deck.top.own
    return dict(zip(own.node_labels.tolist(), at[own.node_at].tolist(), strict=True))


def ours(path, *overrides, times=()):
    """{time: (displacements (nodes, dim), forces (nodes, dim))}, contact force, seconds."""
    began = time.process_time()
    case = read(path, overrides)
    out = {}
    if case.moving is not None and len(times) <= 1:
        found = am.solve(case.model, tolerance=1e-9, time_limit=SECONDS)
        u = np.concatenate([*found.displacement])
        out[case.evolution.until] = (u, forces_of(case.model, u, found.solution.r))
        last = found.fields
    else:
        for step in am.evolve(
            case.in_time,
            case.evolution.method,
            until=case.evolution.until,
            tolerance=1e-8,
            time_limit=SECONDS,
        ):
            u = step.state.displacement.reshape(-1, case.model.dimension)
            out[step.time] = (u, forces_of(step.model, u, step.state.force))
        last = step.fields
    return out, last, time.process_time() - began


def forces_of(model, u, r):
    """What acts on nodes from outside: supports and loads."""
    if has_finite_strains(model.bodies):
        parts = nonlinear_parts(model)
        moved = u.reshape(parts.X.shape)
        meeting = parts.meet(moved)
        pushed = meeting.columns(frames(meeting.normals)) @ r.ravel()
        return parts.forces(moved).reshape(u.shape) - pushed.reshape(u.shape)
    parts = model.discretisation
    n = u.size  # without what stands beside the nodes
    K, H = parts.K.tocsr()[:n, :n], parts.whole_H.tocsr()[:n]
    return (K @ u.ravel() - H @ r.ravel()).reshape(u.shape)


def deviation(found, wanted, nodes):
    """Largest difference over the largest reference, at the last time that both have."""
    common = [(t, s) for t in wanted for s in found if np.isclose(t, s, rtol=1e-5)]
    if not common:
        return None
    t, s = max(common)
    worst = size = 0.0
    for node, value in wanted[t].items():
        at = nodes.get(node, -1)
        if at < 0:
            continue
        mine = found[s][at]
        worst = max(worst, float(np.abs(mine - np.array(value)[: len(mine)]).max()))
        size = max(size, float(np.linalg.norm(value)))
    return worst / size if size else None


def part(found, k):
    return {t: values[k] for t, values in found.items()}


# ------------------------------------------------------------------------------------ theirs
def stiffer(text):
    """The deck with TIMES the stiffness of contact and sticking; None without one."""
    more = stiffness(TIMES)(text)
    return more if more != text else None


def theirs(program, text, name, folder):
    """What ccx says of a deck, or None where it ends with an error or never."""
    text = re.sub(r"(?im)^(?=\*END STEP)", "*NODE FILE\nU\n", text)
    (folder / f"{name}.inp").write_text(text, encoding="latin-1")
    try:
        subprocess.run(
            [program, name], cwd=folder, capture_output=True, timeout=PATIENCE, check=True
        )
    except (subprocess.SubprocessError, OSError):
        return None
    return references(folder, name)


# ------------------------------------------------------------------------------------- table
def remarks(text, by, notes):
    """What makes another's answer another one: small strains, solvers that stop early."""
    found = [] if by == "reference" else [f"beside {by}"]
    upper = text.upper()
    small = any(said.startswith("NLGEOM: strains are taken as small") for said in notes)
    found += ["NLGEOM: theirs at finite rotations"] if small else []
    return found + (["theirs solved to few digits"] if "SOLVER=ITERATIVE" in upper else [])


def compared(path, name, program):
    """A row: what deviates from what."""
    moved, forces = references(path.parent, name)
    nodes, by = nodes_of(path), "reference"
    if not moved and program is not None:  # it prints stresses alone
        with tempfile.TemporaryDirectory() as place:
            moved = (theirs(program, text_of(path), name, Path(place)) or ({}, {}))[0]
        by = "ccx 2.20"
    found, fields, seconds = ours(path, times=moved)
    row = {
        "name": name, "u": deviation(part(found, 0), moved, nodes), "seconds": seconds,
        "rf": deviation(part(found, 1), forces, nodes), "contacts": len(fields.gap),
        "nodes": len(nodes), "said": ", ".join(remarks(text_of(path), by, read(path).notes)),
    }  # fmt: skip
    hard = contextlib.suppress(am.AmontonsError)
    with hard:
        found, _, _ = ours(path, "deck.hard=true", times=moved)
        row["hard"] = deviation(part(found, 0), moved, nodes)
    text = stiffer(text_of(path))
    if program is None or text is None:
        return row
    with tempfile.TemporaryDirectory() as place:
        other = theirs(program, text, name, Path(place))
        if other is None or not other[0]:
            return row
        with contextlib.suppress(am.AmontonsError):
            stiff, _, _ = ours(Path(place) / f"{name}.inp", times=other[0])
            row["stiff"] = deviation(part(stiff, 0), other[0], nodes)
        row["hard stiff"] = deviation(part(found, 0), other[0], nodes)
    return row


def refused(path):
    """The answer of the command to a deck that is not solved: its exit code and message."""
    done = CliRunner().invoke(command, ["info", str(path)])
    broken = done.exception is not None and not isinstance(done.exception, SystemExit)
    return done.exit_code, "traceback" if broken else done.output.strip()


def reason_of(message):
    """The class of a message: the keyword, or the element type."""
    text = message.split(": ", 2)
    known = re.search(r"TYPE=(\w+): elements of", message)
    if known:
        return f"elements {known.group(1).rstrip('R')}"
    card = re.search(r"(\*[A-Z][A-Z -]+)", message)
    return card.group(1).strip() if card else text[-1][:60]


def shown(value):
    return "" if value is None else f"{value:.1e}"


def table(rows, answers, elsewhere, program):
    """The page of results."""
    columns = ("deck", "nodes", "contacts", "u", "RF", "u, hard", f"u, {TIMES} K both",
               f"u, hard / {TIMES} K", "CPU s", "")  # fmt: skip
    lines = [f"| {' | '.join(columns)} |", "|---|" + "---:|" * (len(columns) - 2) + "---|"]
    for row in rows:
        cells = [row["name"], row.get("nodes", ""), row.get("contacts", "")]
        cells += [shown(row.get(key)) for key in ("u", "rf", "hard", "stiff", "hard stiff")]
        cells += [f"{row['seconds']:.1f}" if "seconds" in row else "", row.get("said", "")]
        lines.append(f"| {' | '.join(map(str, cells))} |")
    counts = Counter(answers.values())
    by = defaultdict(list)
    for name, reason in answers.items():
        by[reason].append(name)
    lines += [
        "", f"{len(answers)} other decks, one answer each, exit code 2, file and line; "
        f"{elsewhere} without a line, tracebacks: none.", "",
        "| reason | decks | such as |", "|---|---:|---|",
    ]  # fmt: skip
    lines += [f"| {r} | {n} | {', '.join(by[r][:3])} |" for r, n in counts.most_common()]
    return lines


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--decks", default=os.environ.get("AMONTONS_DECKS", PLACE))
    parser.add_argument("--ccx", default=shutil.which("ccx"))
    parser.add_argument("--only", nargs="*")
    parser.add_argument("--explain", action="store_true")
    asked = parser.parse_args()
    place = Path(asked.decks)
    if not place.is_dir():
        print(f"{place}: no such folder, nothing is done; --decks DIR or AMONTONS_DECKS")
        return
    if asked.explain:
        explain(place, asked.ccx, asked.only, sys.modules[__name__])
        return
    rows, answers, odd, lineless = [], {}, [], 0
    for path in sorted((*place.glob("*.inp"), *place.glob("*.inp.gz"))):
        name = path.name.split(".inp")[0]
        if asked.only and name not in asked.only:
            continue
        try:
            read(path)
        except am.AmontonsError:
            code, said = refused(path)
            if code != 2 or path.name not in said:
                odd.append((name, code, said[-300:]))
            lineless += not re.search(rf"{re.escape(path.name)}:\d+", said)
            answers[name] = reason_of(said)
            continue
        try:
            rows.append(compared(path, name, asked.ccx))
        except am.AmontonsError as error:
            rows.append({"name": name, "said": " ".join(str(error).split())[:160]})
        print(rows[-1], flush=True)
    rows.sort(key=lambda row: (row["name"] not in FIRST, row["name"]))
    for name, code, said in odd:
        print("ODD:", name, code, said)
    text = "\n".join(table(rows, answers, lineless, asked.ccx))
    text = text.replace("tracebacks: none", f"tracebacks or other codes: {len(odd) or 'none'}")
    print(text)
    if not asked.only:
        (HERE / "decks.md").write_text(HEAD + text + "\n")


if __name__ == "__main__":
    main()
