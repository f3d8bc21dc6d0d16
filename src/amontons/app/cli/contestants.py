"""Methods of a race as they are typed: `auto,NM=semismooth-newton:function=natural-map`.

    METHOD                       auto
    METHOD:FIELD=VALUE,…         hybrid:first.batch=100,main.line_search=none
    NAME=METHOD:FIELD=VALUE,…    UPK=gauss-seidel:local=projection,local_steps=3
    package.module:Class         a solver from outside, with options after another colon

Fields and values as in `--set solver.FIELD=VALUE`.  A comma begins the next method unless what
follows it is FIELD=VALUE; a name of one's own needs the colon.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from ...core.errors import InvalidInput
from ...io.case.overrides import set_value, split_override
from ...io.case.settings import GENERAL, Settings, make_solver
from ...solvers import METHODS


@dataclass(frozen=True)
class Contestant:
    """A method with options, under the name that tables and figures give it."""

    name: str
    method: str
    options: dict[str, Any] = field(default_factory=dict)

    @property
    def settings(self) -> Settings:
        """What makes its solver."""
        return Settings(self.method, options=self.options)


def contestants(texts: Sequence[str]) -> list[Contestant]:
    """The methods of all texts; raises InvalidInput for an unknown one, field or value."""
    found: list[Contestant] = []
    for text in texts:
        for words in _split(text):
            found.append(_read(words))
    if not found:
        raise InvalidInput(
            f"methods: expected words with commas between them, got {', '.join(texts)!r}"
        )
    names = [each.name for each in found]
    for name in names:
        if names.count(name) > 1:
            raise InvalidInput(
                f"methods: {name} stands there twice; give names, NAME={name}:…"
            )
    return found


def _split(text: str) -> list[list[str]]:
    """The words of every method: its own and one for each of its options."""
    out: list[list[str]] = []
    for word in (word.strip() for word in text.split(",")):
        if not word:
            continue
        if "=" in word and ":" not in word:
            if not out or ":" not in out[-1][0]:
                raise InvalidInput(
                    f"methods: {word!r} is no method; options follow a colon, as in "
                    "semismooth-newton:line_search=none"
                )
            out[-1].append(word)
        else:
            out.append([word])
    return out


def _read(words: list[str]) -> Contestant:
    """The method of its words; it is made once, so that all that is wrong shows."""
    head, _, first = words[0].partition(":")
    name, equals, method = head.rpartition("=")
    kind, _, rest = first.partition(":")
    if method not in METHODS and kind.isidentifier():
        method, first = f"{method}:{kind}", rest
    options: dict[str, Any] = {}
    for text in [first] * bool(first.strip()) + words[1:]:
        try:
            path, value = split_override(text)
        except InvalidInput:
            raise InvalidInput(
                f"methods: {method}:{text}: expected FIELD=VALUE after the colon"
            ) from None
        if path[0] in GENERAL:
            raise InvalidInput(
                f"methods: {method}:{text}: {path[0]} holds for all methods, see --help"
            )
        set_value(options, path, value, f"methods: {method}:{text}")
    try:
        make_solver(method, options)
    except InvalidInput as reason:
        raise InvalidInput(f"methods: {','.join(words)}: {reason}") from None
    label = name.strip() if equals else ",".join(words).rstrip(":")
    if not label:
        raise InvalidInput(f"methods: {','.join(words)}: expected a name before '='")
    return Contestant(label, method, options)
