"""Elastic constants and expansion of the materials of a deck, and the axes of a section."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...core.errors import InvalidInput
from ...mechanics.elements.elasticity import LinearElastic
from ...mechanics.elements.energies import SaintVenantKirchhoff
from ...mechanics.elements.orthotropic import X_AND_Y, OrthotropicElastic
from ...mechanics.elements.plasticity import ElastoPlastic
from .cards import Card, Row, number
from .rubber import Rubber
from .scopes import missing

Flow = tuple[tuple[tuple[float, float], ...], Card]
PLANES = {"": "strain", "strain": "strain", "stress": "stress", "axisymmetric": "strain"}
CONSTANTS = 9  # of an orthotropic material
Three = tuple[float, float, float]
Axes = Sequence[Sequence[float]]
Material = LinearElastic | OrthotropicElastic | Rubber | SaintVenantKirchhoff


@dataclass(frozen=True)
class Elastic:
    """Young's moduli and Poisson's ratios, three of each where they differ; then also shear.

    density: where one is given; expansion: strain per temperature, one or three; flow: rows
    (yield stress, plastic strain) and their card, None of a material that does not yield;
    rubber: its law, of which young and poisson are those at rest.
    """

    young: float | Three
    poisson: float | Three
    density: float | None
    card: Card
    shear: Three | None = None
    expansion: float | Three = 0.0
    flow: Flow | None = None
    rubber: Rubber | None = None

    def law(self, plane: str, axes: Axes | None = None, *, finite: bool = False) -> Material:
        """The material for a plane state, its axes turned; FileFormatError for what is none.

        finite: of finite strains.
        """
        state = PLANES[plane]
        if finite:
            return self._finite(plane)
        if self.flow is not None:
            return self._yielding(state)
        try:
            if self.shear is None and not isinstance(self.expansion, tuple):
                assert not isinstance(self.young, tuple | list)
                assert not isinstance(self.poisson, tuple | list)
                return LinearElastic(
                    self.young, self.poisson, state, self.density, self.expansion
                )
            young, poisson, shear = self._three
            return OrthotropicElastic(
                young, poisson, shear, axes or X_AND_Y, state, self.density, self.expansion
            )
        except InvalidInput as reason:
            raise self.card.error(str(reason)) from None

    def _finite(self, plane: str) -> Rubber | SaintVenantKirchhoff:
        if plane == "axisymmetric":
            raise self.card.error("finite strains around an axis are not read")
        plane = plane or "strain"
        for there, what in (
            (self.flow is not None, "*PLASTIC"), (self.grows, "*EXPANSION"),
            (self.shear is not None, "other constants than isotropic ones"),
        ):  # fmt: skip
            if there:
                raise self.card.error(f"{what}: small strains alone have it")
        if self.rubber is not None:
            return replace(self.rubber, plane=plane)
        try:
            return SaintVenantKirchhoff(float(self.young), float(self.poisson), plane=plane)  # type: ignore[arg-type]
        except InvalidInput as reason:
            raise self.card.error(str(reason)) from None

    def _yielding(self, state: str) -> ElastoPlastic:
        assert self.flow is not None
        rows, card = self.flow
        if self.shear is not None or isinstance(self.expansion, tuple):
            raise card.error("expected isotropic *ELASTIC and *EXPANSION beside it")
        young, poisson = float(self.young), float(self.poisson)  # type: ignore[arg-type]
        try:
            return ElastoPlastic(young, poisson, state, self.density, self.expansion, rows)
        except InvalidInput as reason:
            raise card.error(str(reason)) from None

    @property
    def grows(self) -> bool:
        """Whether a change of temperature does anything."""
        return bool(np.any(self.expansion))

    @property
    def _three(self) -> tuple[Three, Three, Three]:
        """All constants, also of an isotropic material."""
        if self.shear is not None:
            return self.young, self.poisson, self.shear  # type: ignore[return-value]
        E, nu = float(self.young), float(self.poisson)  # type: ignore[arg-type]
        G = E / (2 * (1 + nu))
        return (E, E, E), (nu, nu, nu), (G, G, G)


def elastic(card: Card) -> Elastic:
    """The constants of *ELASTIC; raises FileFormatError for those of another law."""
    kind = "".join((card.label("TYPE") or "ISO").split())
    rows = list(card.rows())
    if not rows:
        raise card.error("expected a line of data, got none")
    values = [number(text, row, "*ELASTIC") for row in rows for text in row.fields if text]
    if kind in ("ISO", "ISOTROPIC"):
        if len(rows) > 1:
            raise rows[1].error("*ELASTIC: constants at several temperatures are not read")
        if len(values) < 2:
            raise rows[0].error(f"*ELASTIC: expected two constants, got {len(values)}")
        return Elastic(values[0], values[1], None, card)
    if kind not in ("ENGINEERINGCONSTANTS", "ORTHO", "ORTHOTROPIC"):
        raise card.error(
            f"TYPE={card.label('TYPE')}: is not read, expected ISOTROPIC, ENGINEERING "
            "CONSTANTS or ORTHO"
        )
    if not CONSTANTS <= len(values) <= CONSTANTS + 1:
        raise rows[-1].error(
            f"*ELASTIC: expected {CONSTANTS} constants at one temperature, got {len(values)} "
            "numbers"
        )
    if kind == "ENGINEERINGCONSTANTS":
        young, poisson, shear = (_of(values[k : k + 3]) for k in (0, 3, 6))
        return Elastic(young, poisson, None, card, shear)
    return _of_stiffness(values, card)


def elastic_rubber(law: Rubber, card: Card) -> Elastic:
    """The material of *HYPERELASTIC."""
    return Elastic(law.young, law.poisson, None, card, rubber=law)


def _of(values: Sequence[float]) -> Three:
    first, second, third = (float(value) for value in values)
    return first, second, third


def _of_stiffness(values: Sequence[float], card: Card) -> Elastic:
    """From D1111, D1122, D2222, D1133, D2233, D3333, D1212, D1313, D2323."""
    a, b, c, d, e, f = values[:6]
    D = np.array([[a, b, d], [b, c, e], [d, e, f]])
    if not (np.isfinite(D).all() and np.linalg.eigvalsh(D).min() > 0):
        raise card.error("expected a stiffness with positive eigenvalues")
    S = np.linalg.inv(D)
    young = _of((1 / S.diagonal()).tolist())
    poisson = _of([-S[0, 1] * young[0], -S[0, 2] * young[0], -S[1, 2] * young[1]])
    return Elastic(young, poisson, None, card, _of(values[6:9]))


def flow(card: Card) -> Flow:
    """The rows of *PLASTIC; raises FileFormatError for other hardening and temperatures."""
    kind = card.label("HARDENING") or "ISOTROPIC"
    if kind != "ISOTROPIC":
        raise card.error(f"HARDENING={kind}: is not read, expected ISOTROPIC")
    rows, first = [], None
    for row in card.rows():
        values = [number(text, row, "*PLASTIC") for text in row.fields if text]
        if len(values) not in (2, 3):
            raise row.error(
                f"*PLASTIC: expected a stress and a strain, got {len(values)} numbers"
            )
        if first is not None and values[2:] != first:
            raise row.error("*PLASTIC: yield stresses at several temperatures are not read")
        first = values[2:]
        rows.append((values[0], values[1]))
    if not rows:
        raise card.error("expected a line of data, got none")
    return tuple(rows), card


def expansion(card: Card) -> float | Three:
    """The constants of *EXPANSION; those that change with the temperature are not read."""
    rows = list(card.rows())
    if not rows:
        raise card.error("expected a line of data, got none")
    if len(rows) > 1:
        raise rows[1].error("*EXPANSION: constants at several temperatures are not read")
    kind = card.label("TYPE") or "ISO"
    count = {"ISO": 1, "ISOTROPIC": 1, "ORTHO": 3, "ORTHOTROPIC": 3}.get(kind)
    if count is None:
        raise card.error(f"TYPE={kind}: is not read, expected ISO or ORTHO")
    if len(rows[0].fields) < count:
        raise rows[0].error(f"*EXPANSION: expected {count} numbers, got {len(rows[0].fields)}")
    values = [number(text, rows[0], "*EXPANSION") for text in rows[0].fields[:count]]
    return _of(values) if count > 1 else values[0]


def read_orientations(cards: Sequence[Card]) -> dict[str, Axes]:
    """Axes of all *ORIENTATION, a vector along the first and one beside it, by name."""
    found: dict[str, Axes] = {}
    for card in cards:
        if card.keyword != "ORIENTATION":
            continue
        if (card.label("SYSTEM") or "RECTANGULAR") != "RECTANGULAR":
            raise card.error(
                f"SYSTEM={card.label('SYSTEM')}: is not read, expected RECTANGULAR"
            )
        rows = list(card.rows())
        values = [number(text, row, "*ORIENTATION") for row in rows[:1] for text in row.fields]
        if len(values) != 6:
            raise card.error(f"expected two points, six numbers, got {len(values)}")
        if len(rows) > 1 and any(number(t, rows[1], "angle") for t in rows[1].fields[1:2]):
            raise rows[1].error("*ORIENTATION: another rotation about an axis is not read")
        found[card.name("NAME")] = (tuple(values[:3]), tuple(values[3:]))
    return found


def axes_of(card: Card, known: dict[str, Axes]) -> Axes | None:
    """The axes that *SOLID SECTION asks for."""
    if "ORIENTATION" not in card.options:
        return None
    name = card.name("ORIENTATION")
    if name not in known:
        raise card.error(missing("orientation", name, known))
    return known[name]


def first_row(card: Card) -> Row:
    """The first data line."""
    for row in card.rows():
        return row
    raise card.error("expected a line of data, got none")
