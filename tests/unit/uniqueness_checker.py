"""Checks bounds on the critical friction from their data: numpy, nothing of the package."""

import itertools

import numpy as np


def piece_matrix(W, pattern, m):
    """E W R of a pattern: rows u_N of closed, u_T of stuck contacts; columns r(x)."""
    rows, columns = [], []
    for i, letter in enumerate(pattern):
        n, t = 2 * i, 2 * i + 1
        if letter == "f":
            continue
        column = np.zeros(len(W))
        column[n] = 1
        rows.append(n)
        columns.append(column)
        if letter == "s":
            column = np.zeros(len(W))
            column[t] = 1
            rows.append(t)
            columns.append(column)
        else:
            column[t] = m[i]
    R = np.array(columns).reshape(-1, len(W)).T
    return (W @ R)[rows]


def check_witness(W, mu, witness, t, tolerance=1e-9):
    """True when the null vector belongs to the pattern and its friction is at most t mu."""
    r = witness.null_vector
    assert np.abs(r).max() > 0
    u = (W @ r.ravel()).reshape(-1, 2)
    size = (np.abs(W) @ np.abs(r.ravel())).reshape(-1, 2)
    for i, letter in enumerate(witness.pattern):
        m = witness.coefficients[i]
        if abs(m) > t * mu[i] * (1 + 1e-12):
            return False
        if letter == "f":
            fine = (r[i] == 0).all()
        elif letter == "s":
            fine = (np.abs(u[i]) <= tolerance * size[i]).all() and mu[i] > 0
        else:
            fine = abs(u[i, 0]) <= tolerance * size[i, 0]
            fine &= abs(r[i, 1] - m * r[i, 0]) <= tolerance * np.abs(r).max()
            fine &= (m >= 0) == (letter == "+") or m == 0
        if not fine:
            return False
    return True


def smallest_determinant(W, mu, states="fs+-"):
    """Smallest determinant over all patterns at friction mu, relative to its size; 4^n LUs."""
    worst = np.inf
    for pattern in itertools.product(states, repeat=len(mu)):
        if any(letter == "s" and mu[i] == 0 for i, letter in enumerate(pattern)):
            continue
        m = [mu[i] * (-1 if letter == "-" else 1) for i, letter in enumerate(pattern)]
        E = piece_matrix(W, pattern, m)
        if len(E):
            size = np.prod(np.linalg.norm(E, axis=1))
            worst = min(worst, np.linalg.det(E) / size)
    return worst
