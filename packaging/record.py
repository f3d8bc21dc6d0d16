"""Write `signatures.txt`: for which types the package calls its compiled functions.

    python packaging/record.py [MORE_COMMANDS...]

Runs every verb of the command line on every built-in example that it fits, and the methods on
small problems (`calls.py`); minutes.  More commands are run too, for instance

    python packaging/record.py "python -m pytest tests/unit/mechanics"

Signatures are added to those that are there; with `--anew` the list is begun again.
"""

import os
import re
import shlex
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
LIST = HERE / "signatures.txt"
LIMIT = 300.0  # seconds of a command
LOCK = ", readonly=True"
ARRAY_END = re.compile(r"(?<='[CFA]')((?:, readonly=True)?)")  # where a lock is, or may be
AMONTONS = [sys.executable, "-m", "amontons"]
EXAMPLES = (
    "block brake cube cylinder dome hertz hild one-contact release slab spheres tower tresca "
    "vee wall"
).split()
VERBS = {
    "solve": [name for name in EXAMPLES if name not in ("release", "wall")],
    "run": ["release", "wall"],
    "uniqueness": "brake cylinder hertz hild one-contact slab spheres vee".split(),
    "enumerate": ["brake", "hild", "one-contact", "vee", "hertz"],
    "follow": ["brake", "one-contact", "vee", "hild"],
    "basins": ["brake", "one-contact", "hild"],
}
MORE = {
    "follow": ["--parameter", "friction", "--from", "0.3", "--to", "1"],
    "basins": ["--draws", "2"],
}


def commands():
    """Every command whose kernels should be there at once."""
    for verb, names in VERBS.items():
        for name in names:
            out = [] if verb in ("uniqueness", "enumerate", "basins") else ["-o", name + verb]
            yield [*AMONTONS, verb, f"example:{name}", *MORE.get(verb, []), *out]
    for name in ("one-contact", "spheres", "tower"):
        yield [*AMONTONS, "convert", f"example:{name}", f"{name}.hdf5"]
    files = ["one-contact.hdf5", "spheres.hdf5", "tower.hdf5"]
    yield [*AMONTONS, "bench", *files, "--tolerances", "1e-3", "--time-limit", "5"]
    yield [sys.executable, str(HERE / "calls.py")]


def _ended(command, **options):
    """How a command ended; what it has called by the limit is noted even so."""
    try:
        done = subprocess.run(command, capture_output=True, timeout=LIMIT, **options)
    except subprocess.TimeoutExpired:
        return "cut off:"
    tail = done.stderr.decode().splitlines()[-1:]
    return f"{done.returncode} {tail[0][:90]}:" if done.returncode > 1 and tail else "done:"


def locked(lines):
    """One signature for those that differ by whether arrays may be written, with all locks.

    A kernel that has once been compiled for a locked array never writes there, and takes arrays
    that are open as well (`Kept.load_overload`).
    """
    kernels = {}
    for line in lines:
        kernels.setdefault(line.replace(LOCK, ""), []).append(ARRAY_END.split(line))
    for parts in kernels.values():
        tight = [max(versions, key=len) for versions in zip(*parts, strict=True)]
        yield "".join(tight)


def main():
    """Run all, add what is new."""
    known = set() if "--anew" in sys.argv else set(LIST.read_text().splitlines())
    with tempfile.TemporaryDirectory() as folder:
        noted = Path(folder) / "noted"
        noted.touch()
        environment = {**os.environ, "AMONTONS_RECORD_KERNELS": str(noted)}
        for command in commands():
            print(_ended(command, env=environment, cwd=folder), *command[1:], flush=True)
        for more in (x for x in sys.argv[1:] if x != "--anew"):
            print(subprocess.run(shlex.split(more), env=environment).returncode, more)
        found = known | set(noted.read_text().splitlines())
    found = set(locked(x for x in found if x.startswith("amontons.")))
    LIST.write_text("\n".join(sorted(found)) + "\n")
    print(len(found - known), "new,", len(found), "in all")


if __name__ == "__main__":
    main()
