"""Name of the machine and versions, so that a committed figure says where it was measured."""

import os
import platform
from argparse import ArgumentParser, RawDescriptionHelpFormatter
from collections.abc import Callable, Iterable
from importlib.metadata import version
from pathlib import Path

PACKAGES = ("amontons", "numpy", "scipy", "numba", "rslab")


def describe() -> dict[str, str]:
    """CPU, cores, Python and package versions."""
    info = Path("/proc/cpuinfo")
    cpu = platform.processor() or platform.machine()
    if info.exists():
        lines = [x for x in info.read_text().splitlines() if x.startswith("model name")]
        cpu = lines[0].split(":", 1)[1].strip() if lines else cpu
    versions = {name: version(name) for name in PACKAGES}
    cores = str(os.cpu_count())
    return {"cpu": cpu, "cores": cores, "python": platform.python_version(), **versions}


def options(doc: str | None) -> ArgumentParser:
    """A parser whose --help prints the words of the module as they stand there."""
    return ArgumentParser(description=doc, formatter_class=RawDescriptionHelpFormatter)


def asked_cases(doc: str | None, cases: Iterable[str]) -> list[str]:
    """Names of cases on the command line, all where none is given; ends at an unknown one."""
    known = list(cases)
    parser = options(doc)
    parser.add_argument("names", nargs="*", metavar="NAME", help="; ".join(known))
    names = parser.parse_args().names
    for name in names:
        if name not in known:
            parser.error(f"no case {name!r}; there are: {'; '.join(known)}")
    return names or known


def with_kept(rows: list[str], names: Iterable[str], page: Path) -> list[str]:
    """Rows of all names in their order, those that were not made again from the page."""
    known = page.read_text(encoding="utf-8").splitlines() if page.exists() else []
    made = {line.split("|")[1].strip(): line for line in known if line.startswith("| ")}
    made |= {row.split("|")[1].strip(): row for row in rows}
    return [made.get(name, f"| {name} | not run |") for name in names]


def printed(row: Callable[[str], str], cases: Iterable[str]) -> list[str]:
    """The rows of a table, one for each case, each printed as soon as it is there."""
    rows = []
    for case in cases:
        rows.append(row(case))
        print(rows[-1], flush=True)
    return rows
