"""Do kernels of a wheel run as fast as kernels compiled where they run?  CPU seconds, in turns.

    python benchmarks/shipped_kernels.py [--runs 15]

Four copies of this package solve the same problems, each in a process of its own, one after the
other, in an order that turns: kernels compiled for this machine and put into the package (what
`pip install .` does), for any x86-64-v3 processor (what published wheels bring), and twice
without any, so that numba compiles them at first use and keeps them in its own cache.  The
second of those is the control: its ratio to the first is what chance alone gives.  Then the
machine code of every kernel that was used is compared, instruction by instruction (needs
objdump).  Writes results/shipped_kernels.md beside this file.
"""

import argparse
import os
import pickle
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import against_before
from machine import describe

HERE = Path(__file__).parent
ROOT = HERE.parent
EVERY = 3  # of the files of FCLib, a third
OWN = "compiled at first use"
MADE = {"as installed": "", "x86-64-v3": "x86-64-v3", OWN: None, "the control": None}
CODE = """
import pickle, sys
from numba.core.codegen import JITCPUCodegen
codes, load = {}, JITCPUCodegen.unserialize_library
def noted(self, content):
    codes[content[-3]] = codes.get(content[-3], []) + [content[-1][0]]
    return load(self, content)
JITCPUCodegen.unserialize_library = noted
import amontons as am
for cells in (8, 16):
    body = am.Body(am.box((1, 1, 1), cells=(cells,) * 3), am.LinearElastic(200, 0.3))
    slide = am.Fix("top", lambda x: (0, 0.2, 0.06 - 0.15 * x[0]))
    floor = am.Contact("bottom", am.Plane(normal=(0, 0, 1)), mu=1.0)
    am.solve(am.Model([body], [slide], [floor]))
pickle.dump(codes, open(sys.argv[1], "wb"))
"""


def copied(folder, level):
    """A copy of the package with kernels for a level of processor, "" for this one, or none."""
    shutil.copytree(
        ROOT / "src/amontons", folder / "amontons",
        ignore=shutil.ignore_patterns("__pycache__", "kernels.bin"),
    )  # fmt: skip
    if level is None:
        return folder
    path = folder / "amontons/kernels.bin"
    command = [sys.executable, ROOT / "packaging/compile.py", path, folder]
    environment = os.environ | {"AMONTONS_BASELINE": level, "PYTHONPATH": str(folder)}
    subprocess.run(command, check=True, env=environment)
    return folder


def machine_code(source, folder):
    """Instructions of the kernels of a cube's solve, by name; addresses are left out."""
    file = folder / "codes.pickle"
    environment = os.environ | {"PYTHONPATH": str(source)}
    for _ in range(2):  # what the first one compiles, the second one loads
        subprocess.run([sys.executable, "-c", CODE, file], check=True, env=environment)
    found = {}
    for name, codes in pickle.loads(file.read_bytes()).items():
        found[name] = sorted(disassembled(code, folder) for code in codes)
    return found


def disassembled(code, folder):
    """The instructions of an object file as text without addresses."""
    path = folder / "code.o"
    path.write_bytes(code)
    command = ["objdump", "-d", "--no-show-raw-insn", path]
    text = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    lines = [re.sub(r"<[^>]*>|^ *[0-9a-f]+:", "", line) for line in text.splitlines()]
    return [re.sub(r"0x[0-9a-f]+|\b[0-9a-f]{3,}\b", "", line).strip() for line in lines[4:]]


def page(rounds, equal, runs):
    """The tables, each copy against kernels compiled at first use."""
    machine = "; ".join(f"{key} {value}" for key, value in describe().items())
    lines = [
        "# Kernels of a wheel against kernels compiled here", "",
        f"Regenerate: `python benchmarks/shipped_kernels.py --runs {runs}`.", "",
        f"{machine}; one thread. CPU seconds, {len(rounds)} rounds of processes in turns: "
        "median (lower and upper quartile) of the ratios to a copy whose kernels numba "
        "compiled at first use. The control is one more such copy. FCLib: every "
        f"{EVERY}rd file by size.",
    ]  # fmt: skip
    if equal:
        lines += ["", equal]
    for title in MADE:
        if title == OWN:
            continue
        ratios = [
            against_before._ratios(found[title], against_before.SUM, found[OWN])
            for found in rounds
        ]
        lines += ["", f"## {title[0].upper()}{title[1:]} / {OWN}", ""]
        lines += against_before._table(ratios)[:8]
    return "\n".join(lines) + "\n"


def main():
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    shared = Path(os.environ.get("AMONTONS_SHARED", "../shared"))
    parser.add_argument("--runs", type=int, default=15)
    parser.add_argument("--folder", type=Path, default=shared / "data/fclib")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as above:
        os.environ["NUMBA_CACHE_DIR"] = f"{above}/kept"
        files = Path(above) / "files"
        files.mkdir()
        every = sorted(options.folder.glob("*.hdf5"), key=lambda path: path.stat().st_size)
        for path in every[::EVERY]:
            (files / path.name).symlink_to(path.resolve())
        sources = {}
        for title, level in MADE.items():
            sources[title] = copied(Path(above) / title.replace(" ", "-"), level)
            against_before.measured(sources[title], files)  # compiles
        equal = compared(sources, Path(above))
        print(equal, flush=True)
        rounds = []
        titles = list(MADE)
        for k in range(options.runs):
            order = titles[k % 4 :] + titles[: k % 4]
            rounds.append({t: against_before.measured(sources[t], files) for t in order})
            print(f"{k + 1} of {options.runs}", flush=True)
            text = page(rounds, equal, options.runs)
            (HERE / "results/shipped_kernels.md").write_text(text, encoding="utf-8")
    return 0


def compared(sources, folder):
    """A sentence on the machine code; empty without objdump."""
    if not shutil.which("objdump"):
        return ""
    here, own = (machine_code(sources[title], folder) for title in ("as installed", OWN))
    same = sum(here[name] == own.get(name) for name in here)
    return (
        f"Machine code of the {len(here)} kernels that a cube's solve needs, as installed and "
        f"as compiled at first use: the same instructions in {same} of {len(here)}."
    )


if __name__ == "__main__":
    sys.exit(main())
