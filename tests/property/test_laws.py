"""A contact solved exactly obeys its law, for whatever hypothesis thinks of."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from amontons.problem.law import Coulomb, Tresca
from amontons.problem.law.single import solve_one
from amontons.problem.law.states import OPEN, SLIP, STICK

entry = st.floats(-3, 3).map(lambda x: round(x, 9))  # squares must not underflow
matrix = arrays(float, (3, 3), elements=entry)
vector = arrays(float, 3, elements=entry)
number = st.floats(0, 3).map(lambda x: round(x, 9))


def definite(root):
    return root @ root.T + 0.1 * np.eye(3)


@settings(max_examples=300)
@given(matrix, vector, number)
def test_coulomb(root, b, mu):
    A = definite(root)
    r, u, state = solve_one(A, b, mu)
    rho = np.array([1 / np.linalg.norm(A, 2)])
    residual = Coulomb([mu]).natural_map(r[None], u[None], rho)
    size = np.linalg.norm(r) + rho[0] * np.linalg.norm(b)
    assert np.abs(residual).max() <= 1e-9 * size + 1e-300
    assert state in (OPEN, SLIP, STICK)
    if state == OPEN:
        assert not r.any()
    if state == STICK:
        assert np.abs(u).max() <= 1e-9 * (1 + np.linalg.norm(A) * np.linalg.norm(r))


@settings(max_examples=300)
@given(matrix, vector, number)
def test_tresca(root, b, bound):
    A = definite(root)
    r, u, _ = solve_one(A, b, Tresca([bound]))
    rho = np.array([1 / np.linalg.norm(A, 2)])
    residual = Tresca([bound]).natural_map(r[None], u[None], rho)
    size = np.linalg.norm(r) + rho[0] * np.linalg.norm(b)
    assert np.abs(residual).max() <= 1e-9 * size + 1e-300
