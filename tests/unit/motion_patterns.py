"""The least load at which a motion begins, by brute force: all statuses of all contacts.

For a given pattern of free, stick and slip to either side the reactions and the motion of
plane blocks do not know of each other: two linear programs.  Shares nothing with the package.
"""

from itertools import product

import numpy as np
from scipy.optimize import linprog


def least_load(G, dead, live, mu):
    """The least x with G r + dead + x live = 0 and a motion w, live.w = 1; inf without one."""
    n, m = G.shape
    best = np.inf
    for pattern in product("fs+-", repeat=m // 2):
        fixed, most, least = [], [], []  # of u = G^T w: = 0, <= 0, >= 0
        limits = np.tile([-np.inf, np.inf], (m + 1, 1))
        limits[-1, 0] = 0.0
        equal, below = [], []
        for i, letter in enumerate(pattern):
            normal, tangent = G[:, 2 * i], G[:, 2 * i + 1]
            limits[2 * i, 0] = 0.0
            if letter == "f":
                least.append(normal)
                limits[2 * i : 2 * i + 2] = 0.0
                continue
            fixed.append(normal)
            sign = {"s": 0, "+": 1, "-": -1}[letter]
            row = np.zeros((2, m + 1))
            row[:, 2 * i], row[:, 2 * i + 1] = -mu[i], [1.0, -1.0]
            below += list(row)
            if sign:
                (least if sign > 0 else most).append(tangent)
                row = np.zeros(m + 1)
                row[2 * i], row[2 * i + 1] = sign * mu[i], 1.0
                equal.append(row)
            else:
                fixed.append(tangent)
        sides = np.array([*most, *(-row for row in least)]).reshape(-1, n)
        moves = linprog(np.zeros(n), sides, np.zeros(len(sides)), np.array([*fixed, live]),
                        np.append(np.zeros(len(fixed)), 1.0), (None, None))  # fmt: skip
        if moves.status != 0:
            continue
        balance = np.vstack([np.column_stack([G, live]), *equal])
        rows = np.array(below).reshape(-1, m + 1)
        found = linprog(np.eye(m + 1)[-1], rows, np.zeros(len(rows)), balance,
                        np.append(-dead, np.zeros(len(equal))), limits)  # fmt: skip
        if found.status == 0:
            best = min(best, found.x[-1])
    return best
