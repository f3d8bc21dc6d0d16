"""A page: what a report says and shows, and the one file that it becomes.

All text comes from users and is escaped here; numbers go into the page as JSON, arrays as one
block.  The file needs no network and may load nothing, which its policy says too.
"""

from __future__ import annotations

import json
import re
from dataclasses import dataclass, field
from functools import cache
from html import escape
from importlib.resources import files
from typing import Any

import numpy as np

from ... import __version__
from ..units import Units
from .packing import Packer
from .states import Stage, State, largest_forces

STATIC = files("amontons.io.report") / "static"
SCRIPTS = ("format.js", "charts.js", "bodies.js", "camera.js", "view.js", "page.js")
FULL_NUMBERS = 250_000  # numbers of all states up to which they keep 32 bits
FIELDS = ("status", "pressure", "shear", "slip", "gap", "displacement", "von Mises stress")
SENTENCE = 60  # letters from which a cell of a table takes several lines
TOKEN = re.compile(r"\{\{(\w+)\}\}")


@dataclass(frozen=True)
class Table:
    """Rows of text below a title; columns "" for names and values."""

    title: str
    columns: tuple[str, ...]
    rows: list[list[str]]


@dataclass(frozen=True, eq=False)
class Page:
    """All that a report says.

    verdict: title and text on uniqueness.  facts: tables of names and values.  charts: see
    `charts`.  stage and states: bodies in 3D, where there is a model.  by: what tells states
    apart, "" for one, "time", "load", "friction" or "solution".
    """

    kind: str
    title: str
    headline: str = ""
    outcome: str = ""
    stamp: str = ""
    verdict: tuple[str, str] | None = None
    facts: list[Table] = field(default_factory=list)
    tables: list[Table] = field(default_factory=list)
    warnings: tuple[str, ...] = ()
    charts: list[dict[str, Any]] = field(default_factory=list)
    stage: Stage | None = None
    states: list[State] = field(default_factory=list)
    by: str = ""
    note: str = ""
    units: Units = field(default_factory=Units)

    @property
    def html(self) -> str:
        """The file."""
        packer = Packer(small=self._numbers > FULL_NUMBERS)
        data = self._data(packer)
        return _filled({
            "title": escape(_clean(self.title)), "version": escape(__version__),
            "css": _static("report.css"), "stamp": self._stamp, "top": self._top,
            "has_view": "" if self.stage else "hidden", "verdict": self._verdict,
            "facts": "".join(map(_table, self.facts)),
            "warnings": self._warnings, "tables": "".join(map(_table, self.tables)),
            "three": _static("three.min.js") if self.stage else "",
            "script": "\n".join(_static(name) for name in SCRIPTS),
            "data": as_json(data), "arrays": packer.text,
        })  # fmt: skip

    @property
    def _numbers(self) -> int:
        return sum(
            s.moved.size + s.stress.size + len(s.values) * s.status.size for s in self.states
        )

    @property
    def _stamp(self) -> str:
        if not self.stamp:
            return ""
        return f'<p class="stamp" role="alert">{escape(_clean(self.stamp))}</p>'

    @property
    def _top(self) -> str:
        outcome = f'<span class="outcome {"bad" if self.stamp else "good"}">' \
                  f"{escape(self.outcome)}</span>" if self.outcome else ""  # fmt: skip
        return f"<p>{outcome} {escape(_clean(self.headline))}</p>"

    @property
    def _verdict(self) -> str:
        if self.verdict is None:
            return ""
        title, text = (escape(_clean(part)) for part in self.verdict)
        return (f'<section class="card" id="verdict"><h2>The only solution?</h2>'
                f"<p><strong>{title}</strong></p><p>{text}</p></section>")  # fmt: skip

    @property
    def _warnings(self) -> str:
        if not self.warnings:
            return ""
        items = "".join(f"<li>{escape(_clean(text))}</li>" for text in self.warnings)
        return (f'<section class="card warn" id="warnings"><h2>Warnings</h2><ul>{items}</ul>'
                "</section>")  # fmt: skip

    # ---------------------------------------------------------------------------- numbers
    def _data(self, packer: Packer) -> dict[str, Any]:
        return {
            "schema": "amontons/report/1", "kind": self.kind, "title": _clean(self.title),
            "stamp": self.stamp.partition(" (")[0], "by": self.by, "note": self.note,
            "units": self.units.named, "charts": self.charts,
            "view": None if self.stage is None else self._view(self.stage, packer),
        }  # fmt: skip

    def _view(self, stage: Stage, packer: Packer) -> dict[str, Any]:
        skin = stage.skin
        arrows = largest_forces(self.states)
        place = np.full(len(skin.points), -1)
        place[stage.contacts] = np.arange(len(stage.contacts))
        return {
            "dimension": skin.model.dimension,
            "bodies": [_clean(body.name) for body in skin.model.bodies],
            "size": skin.size,
            "points": packer.floats(skin.points, small=False),
            "node": packer.indices(skin.node), "body": packer.indices(skin.body),
            "triangles": packer.indices(skin.triangles), "ends": skin.ends.tolist(),
            "edges": packer.indices(skin.edges), "sharp": packer.indices(skin.sharp),
            "contacts": packer.indices(stage.contacts), "arrows": packer.indices(arrows),
            "zones": [
                {"slave": _clean(z.slave), "master": _clean(z.master),
                 "outward": z.outward.tolist(), "pieces": packer.indices(z.pieces),
                 "masterPieces": packer.indices(z.master_pieces),
                 "rigidPoints": packer.floats(z.rigid_points, small=False),
                 "rigidPieces": packer.indices(z.rigid_pieces)}
                for z in skin.zones
            ],
            "fields": list(FIELDS),
            "states": [self._state(state, arrows, packer) for state in self.states],
        }  # fmt: skip

    def _state(self, state: State, arrows: Any, packer: Packer) -> dict[str, Any]:
        return {
            "label": _clean(state.label), "parameter": state.parameter, "stamp": state.stamp,
            "counts": state.counts, "moved": packer.floats(state.moved),
            "status": packer.signs(state.status),
            "values": {name: packer.floats(array) for name, array in state.values.items()},
            "force": packer.floats(state.force[arrows]), "stress": packer.floats(state.stress),
        }  # fmt: skip


def as_json(data: Any) -> str:
    """JSON for a script element, the same for the same data: no text in it can end that."""
    text = json.dumps(data, ensure_ascii=True, allow_nan=False, sort_keys=True,
                      separators=(",", ":"))  # fmt: skip
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def _clean(text: str) -> str:
    """Text that a page can hold: no control letters, no halves of letters."""
    whole = str(text).encode("utf-8", "replace").decode("utf-8")
    return "".join(c if c.isprintable() or c in "\n\t" else "\ufffd" for c in whole)


def _table(table: Table) -> str:
    head = ""
    if any(table.columns):
        cells = "".join(f'<th scope="col">{escape(_clean(c))}</th>' for c in table.columns)
        head = f"<thead><tr>{cells}</tr></thead>"
    rows = []
    for first, *rest in table.rows:
        cells = "".join(f"<td{_words(cell)}>{escape(_clean(cell))}</td>" for cell in rest)
        rows.append(f'<tr><th scope="row">{escape(_clean(first))}</th>{cells}</tr>')
    kind = "table" if head else "facts"
    wide = " span" if len(table.columns) > 3 else ""
    return (f'<section class="card{wide}"><h2>{escape(_clean(table.title))}</h2>'
            f'<div class="scroll"><table class="{kind}">{head}<tbody>{"".join(rows)}</tbody>'
            "</table></div></section>")  # fmt: skip


def _words(cell: str) -> str:
    """The class of a cell with a sentence, which may go on in the next line."""
    return ' class="words"' if len(str(cell)) > SENTENCE else ""


@cache
def _static(name: str) -> str:
    return (STATIC / name).read_text(encoding="utf-8")


def _filled(values: dict[str, str]) -> str:
    """The template with its tokens replaced once: what is filled in is not read again."""
    return TOKEN.sub(lambda found: values[found[1]], _static("page.html"))
