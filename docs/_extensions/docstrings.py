"""Docstrings are plain words; Sphinx reads reStructuredText.

Here a docstring becomes what it looks like in a terminal: names in backticks are code, bars of
|r| and stars of a * b are themselves, indented lines are set as they stand, and a list begins
without an empty line before it.
"""

import contextlib
import inspect
import re

BACKTICKS = re.compile(r"(``.+?``|`[^`]+`)")
SPECIAL = re.compile(r"(\\|\*|\||(?<=\w)_(?!\w))")
ITEM = re.compile(r"- \S")


def escaped(line: str) -> str:
    """A line whose special signs stand for themselves, but in backticks."""
    parts = BACKTICKS.split(line)
    for k in range(0, len(parts), 2):
        parts[k] = SPECIAL.sub(r"\\\1", parts[k])
    return "".join(parts)


def as_rst(lines: list[str]) -> list[str]:
    """The lines of a docstring as reStructuredText."""
    out: list[str] = []
    literal = False
    for k, line in enumerate(lines):
        before = lines[k - 1] if k else ""
        deep = line.startswith(" ")
        if not line.strip():
            out.append("")
        elif _in_doctest(lines, k):
            out.append(line)
        elif deep and not _in_list(lines, k):
            if not literal:
                out += ["", "::", ""]
            literal = True
            out.append(line)
            continue
        else:
            if literal:
                out.append("")
            if ITEM.match(line) and before.strip() and not _in_list(lines, k - 1):
                out.append("")
            elif not deep and not ITEM.match(line) and k and _in_list(lines, k - 1):
                out.append("")
            out.append(escaped(line))
        literal = literal and not line.strip()
    return out


def _in_doctest(lines: list[str], k: int) -> bool:
    while k >= 0 and lines[k].strip():
        if lines[k].startswith(">>>"):
            return True
        k -= 1
    return False


def _in_list(lines: list[str], k: int) -> bool:
    """True within an item: its first line, or an indented one below it."""
    while k >= 0 and lines[k].startswith(" "):
        k -= 1
    return k >= 0 and bool(ITEM.match(lines[k]))


def named(lines: list[str], parameters: set[str]) -> list[str]:
    """The lines with parameters in bold where a sentence begins to explain them."""
    if not parameters:
        return lines
    names = "|".join(sorted(map(re.escape, parameters), key=len, reverse=True))
    start = re.compile(rf"(^|(?<=[.;] ))((?:{names})(?:, (?:{names}))*)(?=: )")
    return [line if line.startswith(" ") else start.sub(r"**\2**", line) for line in lines]


def process(app, what, name, obj, options, lines) -> None:
    """The handler of autodoc's event."""
    lines[:] = as_rst(lines)
    with contextlib.suppress(TypeError, ValueError):  # built-in things have no signature
        if callable(obj):
            lines[:] = named(lines, set(inspect.signature(obj).parameters))


def setup(app):
    """Connect it."""
    app.connect("autodoc-process-docstring", process)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
