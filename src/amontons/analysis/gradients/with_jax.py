"""A friction problem as a function of JAX, with its own rule for reverse mode."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from ...core.errors import InvalidInput, MissingDependency
from ...problem.friction import FrictionProblem
from .solved import TOLERANCE, Solved


def jax_function(
    problem: FrictionProblem, *, solver: Any = None, tolerance: float = TOLERANCE
) -> Callable[[Mapping[str, Any]], dict[str, Any]]:
    """data -> {"r", "u"} and "v" in the global form, of arrays of JAX, for grad, vjp and jit.

    data: {"load": f (n,) or q (nc, d), "w": (nc, d), "mu": (nc,), "bound": (nc,)}, any of them;
    the rest is that of the problem.  Every solve starts from the one before.  Raises
    MissingDependency without jax, InvalidInput where it computes in single precision;
    NotConverged comes out of calls as JAX hands it on.
    """
    try:
        import jax  # type: ignore[import-not-found]  # an extra
    except ImportError as reason:
        raise MissingDependency(
            "jax_function: needs jax, pip install 'amontons[jax]'"
        ) from reason
    if not jax.config.jax_enable_x64:
        raise InvalidInput(
            "jax_function: expected double precision; call "
            'jax.config.update("jax_enable_x64", True) first'
        )
    made = Solved(problem, solver, tolerance)
    shapes, double = made.shapes, np.dtype(np.float64)

    def told(names: Any) -> Any:
        return {name: jax.ShapeDtypeStruct(shapes[name], double) for name in names}

    def forward(data: Any) -> Any:
        return dict(zip(made.answers, made.forward(data), strict=True))

    @jax.custom_vjp
    def solved(data: Any) -> Any:
        made.checked(data)
        return jax.pure_callback(forward, told(made.answers), dict(data))

    def with_residual(data: Any) -> Any:
        return solved(data), data

    def back(data: Any, slopes: Any) -> Any:
        return (jax.pure_callback(made.backward, told(data), dict(data), slopes),)

    ruled: Any = solved
    ruled.defvjp(with_residual, back)
    return ruled
