"""The solved problem as a function of JAX and of PyTorch, against its own gradient."""

import numpy as np
import pytest

import amontons as am
from amontons.mechanics.ready.hild import hild_triangle


@pytest.fixture(scope="module")
def problem():
    return hild_triangle(3, mu=0.5).assemble()


def wanted(problem, mu):
    s = am.solve(problem.with_mu(mu), tolerance=1e-10)
    return float((s.r**2).sum() + s.v @ s.v), s.vjp(r=2 * s.r, v=2 * s.v)


def test_jax(problem):
    jax = pytest.importorskip("jax")
    jax.config.update("jax_enable_x64", True)
    solved = am.jax_function(problem)

    def number(data):
        found = solved(data)
        return (found["r"] ** 2).sum() + (found["v"] ** 2).sum()

    mu = np.full(problem.contacts, 0.4)
    value, gradient = jax.value_and_grad(number)({"mu": mu, "load": problem.f})
    own, known = wanted(problem, mu)
    assert float(value) == pytest.approx(own, rel=1e-9)
    assert np.asarray(gradient["mu"]) == pytest.approx(known.mu, rel=1e-7, abs=1e-9)
    assert np.asarray(gradient["load"]) == pytest.approx(known.load, rel=1e-7, abs=1e-9)
    assert float(jax.jit(number)({"mu": mu})) == pytest.approx(own, rel=1e-9)


def test_torch(problem):
    torch = pytest.importorskip("torch")
    solved = am.torch_function(problem)
    mu = torch.full((problem.contacts,), 0.4, dtype=torch.float64, requires_grad=True)
    found = solved({"mu": mu})
    value = (found["r"] ** 2).sum() + (found["v"] ** 2).sum()
    value.backward()
    own, known = wanted(problem, mu.detach().numpy())
    assert float(value.detach()) == pytest.approx(own, rel=1e-9)
    assert mu.grad.numpy() == pytest.approx(known.mu, rel=1e-7, abs=1e-9)


def test_data_are_checked(problem):
    from amontons.analysis.gradients.solved import Solved

    made = Solved(problem)
    with pytest.raises(am.InvalidInput, match="expected load, w, mu, bound"):
        made.checked({"friction": 1})
    with pytest.raises(am.InvalidInput, match="mu: expected shape"):
        made.checked({"mu": np.zeros(1)})
    with pytest.raises(am.InvalidInput, match="expected a FrictionProblem"):
        Solved(hild_triangle())
    mu = np.full(problem.contacts, 0.4)
    r, u, v = made.forward({"mu": mu})
    own, known = wanted(problem, mu)
    assert (r**2).sum() + v @ v == pytest.approx(own, rel=1e-9)
    back = made.backward({"mu": mu}, {"r": 2 * r, "v": 2 * v})
    assert back["mu"] == pytest.approx(known.mu, rel=1e-7, abs=1e-9)
    assert u.shape == r.shape
