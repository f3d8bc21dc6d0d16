"""What holds for every vector: Moreau's decomposition and properties of projections."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from amontons.problem.law.cones import project_cone, project_disk

number = st.floats(-1e6, 1e6, allow_nan=False, allow_subnormal=False)
rows = arrays(float, (4, 3), elements=number)
friction = arrays(float, (4,), elements=st.floats(0, 5, allow_subnormal=False))


@given(rows, friction)
def test_moreau_decomposition(x, mu):
    p = project_cone(x, mu)
    rest = x - p
    size = 1 + np.abs(x).max()
    assert (np.linalg.norm(p[:, 1:], axis=1) <= mu * p[:, 0] + 1e-12 * size).all()
    assert (mu * np.linalg.norm(rest[:, 1:], axis=1) <= -rest[:, 0] + 1e-11 * size).all()
    assert (np.abs((p * rest).sum(axis=1)) <= 1e-11 * size**2).all()
    np.testing.assert_allclose(project_cone(p, mu), p, atol=1e-11 * size)


@given(rows, rows, friction)
def test_projections_do_not_expand(x, y, mu):
    size = 1 + max(np.abs(x).max(), np.abs(y).max())
    apart = np.linalg.norm(x - y, axis=1) + 1e-11 * size
    assert (np.linalg.norm(project_cone(x, mu) - project_cone(y, mu), axis=1) <= apart).all()
    near = np.linalg.norm(project_disk(x[:, 1:], mu) - project_disk(y[:, 1:], mu), axis=1)
    assert (near <= apart).all()


@given(rows, friction, st.floats(1e-6, 1e6))
def test_projection_is_homogeneous(x, mu, factor):
    size = factor * (1 + np.abs(x).max())
    np.testing.assert_allclose(
        project_cone(factor * x, mu), factor * project_cone(x, mu), atol=1e-11 * size
    )
