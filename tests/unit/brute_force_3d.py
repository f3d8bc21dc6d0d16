"""Solutions of small 3D problems by a fine search, with nothing from the package.

Every status pattern; slipping contacts start from a grid of directions e (u_T = s e), and
Newton's method with differences drives u_T x e to zero.
"""

import itertools

import numpy as np

NEAR = 1e-6  # relative distance of two solutions that are one
ROOM = 1e-10  # violation of a sign that is rounding


class Piece:
    """The linear system of one pattern for given directions of slip."""

    def __init__(self, W, q, mu, pattern):
        self.W, self.q, self.mu, self.pattern = W, q, mu, pattern
        self.slips = [i for i, letter in enumerate(pattern) if letter == "l"]

    def reactions(self, angle):
        """r (k, 3 nc) for directions (k, slips)."""
        A = np.zeros((len(angle), self.q.size, self.q.size))
        b = np.zeros((len(angle), self.q.size, 1))
        for i, letter in enumerate(self.pattern):
            rows = slice(3 * i, 3 * i + 3)
            if letter == "f":
                A[:, rows, rows] = np.eye(3)
            elif letter == "s":
                A[:, rows], b[:, rows, 0] = self.W[rows], -self.q[i]
            else:
                t = angle[:, self.slips.index(i)]
                A[:, 3 * i], b[:, 3 * i, 0] = self.W[3 * i], -self.q[i, 0]
                A[:, 3 * i + 1, 3 * i + 1] = A[:, 3 * i + 2, 3 * i + 2] = 1
                A[:, 3 * i + 1, 3 * i] = self.mu[i] * np.cos(t)
                A[:, 3 * i + 2, 3 * i] = self.mu[i] * np.sin(t)
        return np.linalg.solve(A, b)[..., 0]

    def turn(self, angle):
        """(r, u, e x u_T of the slipping contacts)."""
        r = self.reactions(angle)
        u = r @ self.W.T + self.q.ravel()
        across = [np.cos(t) * u[:, 3 * i + 2] - np.sin(t) * u[:, 3 * i + 1]
                  for i, t in zip(self.slips, angle.T, strict=True)]  # fmt: skip
        return r, u, np.array(across).reshape(len(self.slips), len(angle)).T

    def settle(self, angle):
        """Directions after Newton's method."""
        slips = len(self.slips)
        for _ in range(40 if slips else 0):
            value = self.turn(angle)[2]
            J = np.empty((len(angle), slips, slips))
            for j in range(slips):
                J[:, :, j] = (self.turn(angle + 1e-6 * np.eye(slips)[j])[2] - value) / 1e-6
            step = np.linalg.solve(J + 1e-13 * np.eye(slips), value[..., None])[..., 0]
            angle = angle - np.clip(step, -0.5, 0.5)
        return angle

    def accepted(self, angle):
        """Reactions, (nc, 3) each, that obey the law."""
        r, u, across = self.turn(angle)
        size = 1 + np.abs(u).max(axis=1)
        good = np.abs(across).max(axis=1, initial=0) <= 1e-8 * size
        for i, letter in enumerate(self.pattern):
            own_r, own_u = r[:, 3 * i : 3 * i + 3], u[:, 3 * i : 3 * i + 3]
            if letter == "f":
                good &= own_u[:, 0] >= -ROOM
            elif letter == "s":
                tangent = np.hypot(own_r[:, 1], own_r[:, 2])
                good &= (own_r[:, 0] >= -ROOM) & (tangent <= self.mu[i] * own_r[:, 0] + ROOM)
            else:
                t = angle[:, self.slips.index(i)]
                along = own_u[:, 1] * np.cos(t) + own_u[:, 2] * np.sin(t)
                good &= (own_r[:, 0] >= -ROOM) & (along >= -ROOM)
        return r[good].reshape(-1, len(self.mu), 3)


def solutions_by_brute_force(W, q, mu, *, angles=24, most=4000, seed=0):
    """[(pattern, r)]: `angles` directions per slipping contact, `most` combinations of them."""
    random, found = np.random.default_rng(seed), []
    for pattern in itertools.product("fsl", repeat=len(mu)):
        piece = Piece(W, q, mu, pattern)
        slips = len(piece.slips)
        if angles**slips <= most:
            grid = 2 * np.pi * (np.arange(angles) + 0.37) / angles
            starts = np.array(list(itertools.product(grid, repeat=slips)))
        else:
            starts = random.uniform(0, 2 * np.pi, (most, slips))
        for r in piece.accepted(piece.settle(starts)):
            size = 1 + np.abs(r).max()
            if all(np.abs(r - other).max() > NEAR * size for _, other in found):
                found.append(("".join(pattern), r))
    return found


def random_problem_3d(seed, contacts=None):
    """(W, q, mu): strong coupling, any load; every third has many solutions."""
    random = np.random.default_rng(seed)
    nc = contacts or int(random.integers(1, 4))
    A = random.standard_normal((3 * nc, 3 * nc))
    if seed % 3:
        W = A @ A.T / (3 * nc) + 0.05 * np.eye(3 * nc)
        return W, random.standard_normal((nc, 3)) * [1, 2, 2], random.uniform(0.2, 3.0, nc)
    along = random.standard_normal((nc, 2))
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    W = np.eye(3 * nc) + 0.03 * A @ A.T
    for i in range(nc):
        W[3 * i, 3 * i + 1 : 3 * i + 3] += 0.8 * along[i]
        W[3 * i + 1 : 3 * i + 3, 3 * i] += 0.8 * along[i]
    q = np.column_stack([random.uniform(0.1, 0.3, nc), along])
    q[:, 1:] += 0.1 * random.standard_normal((nc, 2))
    return W, q, np.full(nc, 2.0)
