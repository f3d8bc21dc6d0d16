"""A friction problem as a function of PyTorch, with its own rule for reverse mode."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from ...core.errors import MissingDependency
from ...problem.friction import FrictionProblem
from .solved import DATA, TOLERANCE, Solved


def torch_function(
    problem: FrictionProblem, *, solver: Any = None, tolerance: float = TOLERANCE
) -> Callable[[Mapping[str, Any]], dict[str, Any]]:
    """data -> {"r", "u"} and "v" in the global form, of tensors, for autograd.

    data: {"load": f (n,) or q (nc, d), "w": (nc, d), "mu": (nc,), "bound": (nc,)}, any of them,
    on any device; the rest is that of the problem.  All is computed on the CPU in double
    precision.  Every solve starts from the one before.  Raises MissingDependency without torch.
    """
    try:
        import torch  # type: ignore[import-not-found]  # an extra
    except ImportError as reason:
        raise MissingDependency(
            "torch_function: needs torch, pip install 'amontons[torch]'"
        ) from reason
    made = Solved(problem, solver, tolerance)

    def array(x: Any) -> Any:
        return x.detach().cpu().double().numpy()

    class Friction(torch.autograd.Function):
        @staticmethod
        def forward(ctx: Any, *values: Any) -> Any:
            data = {n: array(x) for n, x in zip(DATA, values, strict=True) if x is not None}
            ctx.data = data
            ctx.like = [None if x is None else (x.dtype, x.device) for x in values]
            first = next((x for x in values if x is not None), torch.zeros(0).double())
            return tuple(torch.as_tensor(x).to(first) for x in made.forward(data))

        @staticmethod
        def backward(ctx: Any, *slopes: Any) -> Any:
            given = {n: array(x) for n, x in zip(made.answers, slopes, strict=True)}
            found = made.backward(ctx.data, given)
            return tuple(
                None if like is None
                else torch.as_tensor(np.array(found[n])).to(dtype=like[0], device=like[1])
                for n, like in zip(DATA, ctx.like, strict=True)
            )  # fmt: skip

    def solved(data: Mapping[str, Any]) -> dict[str, Any]:
        made.checked(data)
        found = Friction.apply(*(data.get(name) for name in DATA))
        return dict(zip(made.answers, found, strict=True))

    return solved
