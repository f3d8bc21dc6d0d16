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


# ------------------------------------------------------------- proofs by multipliers
LETTERS = "f+-s"


def planes(m):
    """Planes of z = (r_N, r_T, u_N, u_T) by letter."""
    return {
        "f": np.array([[0, 0], [0, 0], [1, 0], [0, 1.0]]),
        "s": np.array([[1, 0], [0, 1.0], [0, 0], [0, 0]]),
        "+": np.array([[1, 0], [m, 0], [0, 0], [0, 1.0]]),
        "-": np.array([[1, 0], [-m, 0], [0, 0], [0, 1.0]]),
    }


def left_over(W, contacts, letters, mu):
    """(determinant of what is decided, S of the others in ascending order)."""
    m = np.zeros(len(mu))
    pattern = ["f"] * len(mu)
    for contact, letter in zip(contacts, letters, strict=True):
        pattern[contact], m[contact] = letter, -mu[contact] if letter == "-" else mu[contact]
    E = piece_matrix(W, pattern, m)
    rest = [i for i in range(len(mu)) if i not in contacts]
    rows = np.array([[2 * i, 2 * i + 1] for i in rest], dtype=int).ravel()
    if not len(E):
        return 1.0, W[np.ix_(rows, rows)]
    closed = [2 * i for i in contacts if pattern[i] != "f"]
    closed = sorted(closed + [2 * i + 1 for i in contacts if pattern[i] == "s"])
    reaction = np.zeros((len(W), len(closed)))
    for k, row in enumerate(closed):
        reaction[row, k] = 1
        if row % 2 == 0 and pattern[row // 2] in "+-":
            reaction[row + 1, k] = m[row // 2]
    left = (W @ reaction)[rows]
    S = W[np.ix_(rows, rows)] - left @ np.linalg.solve(E, W[np.ix_(closed, rows)])
    return np.linalg.det(E), S


def multipliers_hold(S, mu, found):
    """True when the multipliers exclude every pattern of contacts with u = S r."""
    k = len(mu)
    Q = np.zeros((4 * k, 4 * k))
    pairs, W = found.pairs, found.W
    if set(np.r_[pairs.ravel(), found.singles]) != set(range(k)):
        return False
    for p, block in zip(found.singles, found.V, strict=True):
        for G in planes(mu[p]).values():
            if np.linalg.eigvalsh(G.T @ block @ G)[-1] >= 0:
                return False
        Q[4 * p : 4 * p + 4, 4 * p : 4 * p + 4] += block
    for (p, q), block in zip(pairs, W, strict=True):
        for a in planes(mu[p]).values():
            for b in planes(mu[q]).values():
                G = np.zeros((8, 4))
                G[:4, :2], G[4:, 2:] = a, b
                if np.linalg.eigvalsh(G.T @ block @ G)[-1] >= 0:
                    return False
        rows = [*range(4 * p, 4 * p + 4), *range(4 * q, 4 * q + 4)]
        Q[np.ix_(rows, rows)] += block
    z = np.zeros((4 * k, 2 * k))
    for p in range(k):
        z[4 * p, 2 * p] = z[4 * p + 1, 2 * p + 1] = 1
        z[4 * p + 2 : 4 * p + 4] = S[2 * p : 2 * p + 2]
    M = z.T @ Q @ z
    size = np.sqrt(np.diag(M).clip(1e-300))
    if np.linalg.eigvalsh(M / size / size[:, None])[0] <= 1e-12:
        return False
    for p in range(k):
        own = Q[4 * p : 4 * p + 4, 4 * p : 4 * p + 4]
        plane = planes(mu[p])
        signs = [np.linalg.det(-plane["s"].T @ own @ plane[b]) for b in "f+-"]
        if np.linalg.eigvalsh(own)[2] <= 0 or not (signs[0] > 0 > max(signs[1:])):
            return False
    return True


def check_proof(W, mu, leaves):
    """True when the leaves are all patterns, and every one excludes its own."""
    by_path = {tuple(zip(leaf.contacts, leaf.states, strict=True)): leaf for leaf in leaves}

    def covered(path):
        if path in by_path:
            return holds(by_path[path])
        following = {p[len(path)] for p in by_path if p[: len(path)] == path}
        contacts = {contact for contact, _ in following}
        if len(contacts) != 1:
            return False
        needed = 4 if mu[contacts.pop()] > 0 else 2
        return len(following) == needed and all(covered((*path, step)) for step in following)

    def holds(leaf):
        letters = [LETTERS[s] for s in leaf.states]
        det, S = left_over(W, leaf.contacts, letters, mu)
        rest = np.array([mu[i] for i in range(len(mu)) if i not in leaf.contacts])
        if det <= 0 or len(leaf.left) != len(rest) or set(leaf.left) & set(leaf.contacts):
            return False
        if leaf.multipliers is None:
            return smallest_determinant(S, rest) > 0
        return multipliers_hold(S, rest, leaf.multipliers)

    return covered(())
