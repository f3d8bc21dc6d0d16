"""Kernels that were compiled when the package was built, and come with it in one file.

The file is for one Python, one numba, one kind of processor and the very sources beside it.
Where any of them differs, or the file is damaged, nothing of it is used and kernels compile.

It holds numba's own compile results, as numba's cache on disk does; parts of numba that are
not public are used here, in `kept.py` and nowhere else (docs/startup.md lists them).

    b"amontons kernels" | length of the head, 8 bytes | head, JSON | the kernels, one by one

head: {"made_for": what `here` says, "needs": processor features, "kernels": {name: [offset from
the end of the head, length, first half of the SHA-256]}}.
"""

from __future__ import annotations

import builtins
import hashlib
import importlib
import json
import logging
import pickle
import sys
from collections.abc import Mapping, Sequence
from functools import cache, cached_property
from operator import ge
from pathlib import Path
from typing import Any

import llvmlite
import llvmlite.binding as llvm
import numba
from numba.core import serialize
from numba.core.compiler import CompileResult
from numba.core.environment import Environment, lookup_environment
from numba.core.runtime.nrt import rtsys

from .source_digest import PACKAGE, sources

FILE = PACKAGE / "kernels.bin"
START = b"amontons kernels"
LOCK = "readonly "  # before the type of an array that may not be written, in numba's words
logger = logging.getLogger(__name__)


def here() -> dict[str, str]:
    """What compiled kernels depend on beside the processor's features."""
    return {
        "python": sys.implementation.cache_tag,
        "numba": numba.__version__,
        "llvmlite": llvmlite.__version__,
        "system": llvm.get_process_triple(),
        "sources": sources(),
    }


def processor() -> set[str]:
    """Features of this processor that the compiler knows."""
    return {name for name, there in llvm.get_host_cpu_features().items() if there}


def name_of(function: Any, types: Sequence[Any]) -> str:
    """Under which name a function for arguments of these types is kept."""
    return f"{function.__module__}.{function.__qualname__}({', '.join(map(str, types))})"


class Shipped:
    """The kernels of a file; none where it is absent, damaged or made for something else.

    why_not: why nothing of the file is used, empty where something is.
    """

    def __init__(self, path: Path) -> None:
        self.path, self.names, self.base = path, {}, 0
        self.loaded: dict[str, CompileResult] = {}
        try:
            head, self.base = _head(path)
            self.why_not = _misfit(head)
            if not self.why_not:
                self.names = head["kernels"]
        except FileNotFoundError:
            self.why_not = "none were installed"
        except (OSError, ValueError, KeyError, TypeError, AttributeError):
            self.why_not = "their file can not be read"

    @cached_property
    def unlocked(self) -> dict[str, list[str]]:
        """Names of kernels by what they are called without the locks of arrays."""
        found: dict[str, list[str]] = {}
        for name in self.names:
            found.setdefault(name.replace(LOCK, ""), []).append(name)
        return found

    def that_writes_less(self, name: str) -> str:
        """A kernel like this that leaves more arrays as they are; empty where there is none."""
        asked = _locks(name)
        for other in self.unlocked.get(name.replace(LOCK, ""), ()):
            if other in self.names and all(map(ge, _locks(other), asked)):
                return other
        return ""

    def result(self, name: str, target: Any) -> CompileResult | None:
        """The kernel of this name, ready to be called; None where there is none."""
        if name in self.loaded:  # loading twice would define its symbols twice
            return self.loaded[name]
        if name not in self.names:
            return None
        try:
            offset, length, digest = self.names[name]
            with self.path.open("rb") as file:
                file.seek(self.base + offset)
                content = file.read(length)
            if _digest(content) != digest:
                raise ValueError("damaged")
            rtsys.initialize(target)  # all that loading needs of numba's (slow) `refresh`
            self.loaded[name] = _unpacked(content, target)
            return self.loaded[name]
        except Exception as error:  # what can be wrong is numba's, and compiling is the answer
            logger.warning("%s: %s: %s; it is compiled instead", self.path, name, error)
            self.names, self.why_not = {}, "their file is damaged"
            return None


def _locks(name: str) -> list[bool]:
    """Which of the arrays in a name are locked, one after the other."""
    return [before.endswith(LOCK) for before in name.split("array(")[:-1]]


@cache
def shipped() -> Shipped:
    """The kernels that came with this package."""
    return Shipped(FILE)


def _head(path: Path) -> tuple[dict[str, Any], int]:
    """The head of a file and where it ends; raises ValueError where it is none of ours."""
    with path.open("rb") as file:
        if file.read(len(START)) != START:
            raise ValueError(f"{path}: not a file of kernels")
        length = int.from_bytes(file.read(8), "little")
        if length > path.stat().st_size:
            raise ValueError(f"{path}: too short")
        return json.loads(file.read(length)), file.tell()


def _misfit(head: Mapping[str, Any]) -> str:
    """In what this process differs from what a file was made for; empty where it does not."""
    if "why_not" in head:  # building them failed
        return str(head["why_not"])
    made_for = head["made_for"]
    for what, found in here().items():
        if made_for[what] != found:
            return f"they are for {what} {made_for[what]}, here it is {found}"
    missing = sorted(set(head["needs"]) - processor())
    return f"this processor lacks {', '.join(missing)}" if missing else ""


def _digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()[:32]


def write(path: Path, kernels: Mapping[str, bytes], needs: Sequence[str]) -> None:
    """Write a file of kernels, of the results of `packed`."""
    places, at = {}, 0
    for name, content in kernels.items():
        places[name] = [at, len(content), _digest(content)]
        at += len(content)
    head = {"made_for": here(), "needs": sorted(needs), "kernels": places}
    text = json.dumps(head, separators=(",", ":")).encode()
    start = START + len(text).to_bytes(8, "little") + text
    path.write_bytes(b"".join([start, *kernels.values()]))


def packed(result: CompileResult) -> bytes:
    """A compile result as bytes, the environments of what it calls as plain values."""
    *most, environments = result._reduce()
    plain = [(e.globals["__name__"], list(e.consts), e.env_name) for e in environments]
    return serialize.dumps((*most, plain))


def _unpacked(content: bytes, target: Any) -> CompileResult:
    *most, plain = pickle.loads(content)
    return CompileResult._rebuild(target, *most, [_environment(*values) for values in plain])


def _environment(module: str, constants: list[Any], name: str) -> Environment:
    """As numba makes them, but modules of numba itself are not imported for it, which is slow.

    Their names are looked up by code in object mode alone, of which there is none here.
    """
    if (known := lookup_environment(name)) is not None:
        return known
    if module.startswith("numba.") and module not in sys.modules:
        made = Environment({"__name__": module, "__builtins__": builtins})
    else:
        made = Environment(importlib.import_module(module).__dict__)
    made.consts[:] = constants
    made.env_name = name
    Environment._memo[name] = made
    return made
