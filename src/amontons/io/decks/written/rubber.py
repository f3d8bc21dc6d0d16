"""Laws of finite strains as cards of a deck."""

from __future__ import annotations

from ....core.errors import InvalidInput, within
from ....mechanics.elements.elasticity import materials_by_region
from ....mechanics.elements.energies import (
    MooneyRivlin,
    Ogden,
    ReducedPolynomial,
    SaintVenantKirchhoff,
)
from ....mechanics.model import Model, Pressure
from ....mechanics.model.values import is_number
from .lines import value, values

FINITE = MooneyRivlin | ReducedPolynomial | Ogden | SaintVenantKirchhoff
WIDTH = 8  # numbers of a line
NONE = 1e20  # for D2 and further ones: 0 would be read as a number of its own


def check_finite(model: Model) -> None:
    """Raise InvalidInput for what a deck does not say of a model of finite strains."""
    for k, body in enumerate(model.bodies):
        for law in materials_by_region(body.mesh, body.material).values():  # type: ignore[arg-type]
            if not isinstance(law, FINITE):
                with within("bodies", k, "material"):
                    raise InvalidInput(
                        f"{type(law).__name__}: can not be said in a deck with large "
                        "deformations; expected MooneyRivlin, ReducedPolynomial, Ogden or "
                        "SaintVenantKirchhoff"
                    )
    for k, load in enumerate(model.loads):
        if isinstance(load, Pressure) and not is_number(load.value):
            with within("loads", k, "value"):
                raise InvalidInput("a pressure of the place: can not be said in a deck")


def cards_of(law: FINITE) -> list[str]:
    """*HYPERELASTIC, or *ELASTIC, which NLGEOM takes for Saint Venant's law."""
    if isinstance(law, SaintVenantKirchhoff):
        return ["*ELASTIC", values([law.young, law.poisson])]
    d1 = 2 / law.bulk
    if isinstance(law, MooneyRivlin):
        return ["*HYPERELASTIC, MOONEY-RIVLIN", values([law.c10, law.c01, d1])]
    if isinstance(law, Ogden):
        count = len(law.shears)
        pairs = zip(law.shears, law.exponents, strict=True)
        numbers = [number for pair in pairs for number in pair]
        head = f"*HYPERELASTIC, OGDEN, N={count}"
    else:
        count, numbers = len(law.coefficients), list(law.coefficients)
        head = f"*HYPERELASTIC, REDUCED POLYNOMIAL, N={count}"
    numbers += [d1, *[NONE] * (count - 1)]
    lines = [numbers[k : k + WIDTH] for k in range(0, len(numbers), WIDTH)]
    return [head, *(", ".join(value(x) for x in line) for line in lines)]
