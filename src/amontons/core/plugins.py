"""Parts from outside of the package: by "package.module:Name", or by entry points.

Naming a module runs its code.  Nothing is added to the places where Python looks for modules:
what is named has to be installed, or found by PYTHONPATH.
"""

from __future__ import annotations

import importlib
import re
from importlib.metadata import EntryPoint, entry_points
from typing import Any

from .errors import InvalidInput

REFERENCE = re.compile(r"([^\W\d]\w*(?:\.[^\W\d]\w*)*):([^\W\d]\w*)")


def load(reference: str) -> Any:
    """What "package.module:Name" names; raises InvalidInput for what can not be found."""
    found = REFERENCE.fullmatch(reference)
    if found is None:
        raise InvalidInput(f"expected package.module:Name, got '{reference}'")
    module, name = found.groups()
    try:
        home = importlib.import_module(module)
    except (ImportError, SyntaxError) as reason:
        raise InvalidInput(
            f"'{reference}': module {module} can not be imported: {reason}; it has to be "
            "installed, the current folder is not searched"
        ) from reason
    if not hasattr(home, name):
        raise InvalidInput(f"'{reference}': module {module} has no {name}")
    return getattr(home, name)


def installed(group: str) -> dict[str, EntryPoint]:
    """The entry points of a group that installed packages offer, by name."""
    return {point.name: point for point in entry_points(group=group)}


def loaded(point: EntryPoint) -> Any:
    """What an entry point names; raises InvalidInput that names both where it is not there."""
    try:
        return point.load()
    except (ImportError, SyntaxError, AttributeError) as reason:
        raise InvalidInput(
            f"entry point '{point.name}' of {point.group}: {point.value} can not be loaded: "
            f"{reason}"
        ) from reason
