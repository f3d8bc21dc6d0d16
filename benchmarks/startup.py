"""From `pip install .` to the first, the second and any later result, in CPU seconds.

    python benchmarks/startup.py [--before REVISION] [--examples cube,hertz]

Makes a fresh environment of this clone, and one of an earlier revision, without any cache, and
runs in each: every built-in example for the first time (with an empty cache, so that each is
the first), a second time, a second time without pictures; and a solve of one contact in Python.
CPU seconds (user and system) of whole processes, children included; the second ones are the
least of three.  Writes results/startup.md beside this file.
"""

import argparse
import math
import os
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from machine import describe

HERE = Path(__file__).parent
REPEATS = 3
IN_TIME = ("release", "wall")  # cases of `amontons run`
ONE = """
import amontons as am
problem = am.FrictionProblem.from_delassus(W=[[1, 0.2], [0.2, 1]], q=[[-1, 0.5]], mu=[0.3])
assert am.solve(problem).convergence.error < 1e-8
"""
HEAD = """# Start-up

Regenerate: `python benchmarks/startup.py --before {before}`.  CPU seconds of whole processes in
fresh environments; first: nothing was ever compiled or kept; second: least of {repeats} runs.

{machine}.

"""


def seconds(command, **options):
    """CPU seconds of a process and its children; nan where the command is refused."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run([str(x) for x in command], capture_output=True, text=True, **options)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode:
        print(*command, done.stderr.strip().splitlines()[-1:], file=sys.stderr)
        return math.nan
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


class Installed:
    """An environment with one revision of the package and nothing else."""

    def __init__(self, folder, revision):
        self.folder, self.venv = folder, folder / "venv"
        clone = folder / "clone"
        source = HERE.parent
        if revision is None:
            names = subprocess.run(
                ["git", "ls-files", "-co", "--exclude-standard"], cwd=source, text=True,
                capture_output=True, check=True,
            ).stdout.split("\n")  # fmt: skip
            for name in filter(None, names):
                (clone / name).parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(source / name, clone / name)
        else:
            clone.mkdir()
            packed = subprocess.run(
                ["git", "archive", revision], cwd=source, capture_output=True, check=True
            ).stdout
            subprocess.run(["tar", "-x"], input=packed, cwd=clone, check=True)
        subprocess.run([sys.executable, "-m", "venv", self.venv], check=True)
        began = time.perf_counter()
        self.install = seconds([self.bin("python"), "-m", "pip", "install", "-q", clone])
        self.install_wall = time.perf_counter() - began
        files = [x for x in self.venv.rglob("*") if x.is_file() and not x.is_symlink()]
        self.size = sum(x.stat().st_size for x in files) / 1e6

    def bin(self, name):
        """A program of the environment."""
        return self.venv / "bin" / name

    def environment(self, cache):
        """Variables of its processes."""
        dropped = ("PYTHONPATH", "XDG_CACHE_HOME", "VIRTUAL_ENV")
        kept = {k: v for k, v in os.environ.items() if k not in dropped}
        return {**kept, "NUMBA_CACHE_DIR": str(cache), "OMP_NUM_THREADS": "1"}

    def three(self, command, more=()):
        """First, second, and second with more arguments, None without any."""
        with tempfile.TemporaryDirectory(dir=self.folder) as folder:
            options = {"env": self.environment(Path(folder) / "cache"), "cwd": folder}
            first = seconds(command, **options)
            second = min(seconds(command, **options) for _ in range(REPEATS))
            if not more:
                return first, second, None
            third = min(seconds([*command, *more], **options) for _ in range(REPEATS))
            return first, second, third

    def example(self, name):
        """The three times of an example."""
        verb = "run" if name in IN_TIME else "solve"
        known = subprocess.run([self.bin("amontons"), verb, "--help"], text=True,
                               capture_output=True).stdout  # fmt: skip
        more = ["--no-figures"] if "--no-figures" in known else []
        return self.three([self.bin("amontons"), verb, f"example:{name}", "-o", "out"], more)

    def examples(self):
        """Names of all that it has."""
        listed = subprocess.run(
            [self.bin("amontons"), "examples"], text=True, capture_output=True, check=True
        ).stdout
        return [line.split()[0] for line in listed.splitlines() if line.strip()]


def shown(value):
    return "–" if value is None or math.isnan(value) else f"{value:.2f}"


def table(name, installed, examples):
    """The rows of one revision."""
    lines = [
        f"## {name}\n",
        f"`pip install .`: {installed.install:.0f} CPU s ({installed.install_wall:.0f} s); "
        f"environment {installed.size:.0f} MB.\n",
        "| what | first | second | second, `--no-figures` |", "|---|---|---|---|",
    ]  # fmt: skip
    rows = [("one contact, `am.solve`", installed.three([installed.bin("python"), "-c", ONE]))]
    for example in examples:
        rows.append((f"`example:{example}`", installed.example(example)))
        print(name, *rows[-1], flush=True)
    lines += [f"| {what} | " + " | ".join(map(shown, times)) + " |" for what, times in rows]
    return "\n".join(lines) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--before", help="a revision to compare with")
    parser.add_argument("--examples", help="only these, with commas between")
    asked = parser.parse_args()
    machine = "; ".join(f"{k} {v}" for k, v in describe().items())
    text = HEAD.format(before=asked.before or "REVISION", repeats=REPEATS, machine=machine)
    for name, revision in (("Now", None), ("Before", asked.before)):
        if name == "Before" and revision is None:
            continue
        with tempfile.TemporaryDirectory() as folder:
            installed = Installed(Path(folder), revision)
            names = asked.examples.split(",") if asked.examples else installed.examples()
            text += table(name, installed, names) + "\n"
        (HERE / "results/startup.md").write_text(text.rstrip() + "\n")
    print(text)


if __name__ == "__main__":
    main()
