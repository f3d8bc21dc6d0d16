"""What the commands share: numbers of each part kept in results.json, and the page of all."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import click

from amontons.core.errors import AmontonsError
from amontons.core.files import replacing
from benchmarks.machine import describe


def check_parts(parts: Sequence[str], known: Sequence[str]) -> None:
    """Raise UsageError for a part that there is not."""
    for part in parts:
        if part not in known:
            raise click.UsageError(f"PART: {part!r} is none of {', '.join(known)}")


def levels_of(text: str, low: int, high: int) -> list[int]:
    """The levels of --levels, ascending; raises UsageError for what are none."""
    try:
        chosen = sorted({int(x) for x in text.split(",")})
    except ValueError as error:
        raise click.UsageError(f"--levels: expected numbers, got {text!r}") from error
    if chosen[0] < low or chosen[-1] > high:
        raise click.UsageError(f"--levels: expected numbers from {low} to {high}, got {text!r}")
    return chosen


def regenerate(
    out: Path, parts: Sequence[str], work: Callable[[str], tuple[str, Any]],
    page: Callable[[dict[str, Any]], str],
) -> str:  # fmt: skip
    """Compute parts, each stored beside the others when it is there; the page, also written.

    work(part): a name and the numbers to store under it, or an iterator of dictionaries, one
    per level, each stored when it is there beside those of other levels.
    """
    out.mkdir(parents=True, exist_ok=True)
    try:
        for part in parts:
            click.echo(f"{part} …")
            name, found = work(part)
            if not isinstance(found, Iterator):
                _store(out, name, found)
                continue
            for level in found:
                _store(out, name, stored(out).get(name, {}) | level)
    except AmontonsError as reason:
        raise click.ClickException(str(reason)) from reason
    text = page(stored(out))
    with replacing(out / "results.md") as path:
        path.write_text(text)
    return text


def _store(out: Path, name: str, found: Any) -> None:
    record = stored(out)
    record["machine"] = describe()
    record[name] = found
    with replacing(out / "results.json") as path:
        path.write_text(json.dumps(record) + "\n")


def stored(out: Path) -> dict[str, Any]:
    """All numbers of a folder of results, by part; empty where there are none."""
    target = out / "results.json"
    return json.loads(target.read_text()) if target.exists() else {}


def heading(name: str, record: dict[str, Any]) -> list[str]:
    """First lines of a page: how to make it again, and on what it was made."""
    machine = "; ".join(f"{k} {v}" for k, v in record["machine"].items())
    return [f"# {name}: results", "", f"Regenerate: `python -m reproduce.{name}`.", "",
            f"{machine}.", ""]  # fmt: skip
