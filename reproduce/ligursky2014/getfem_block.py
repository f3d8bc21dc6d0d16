"""The block by GetFEM: reference values for `reference.json`, from another program.

    python3 reproduce/ligursky2014/getfem_block.py 20 40=PATTERN,PATTERN,...

with a Python that has GetFEM (5.4; Debian's python3-getfem) and SciPy; cells along the width,
alone for the whole curve, with statuses for the solutions at 0.495 that have them (all
conditions of the contacts are checked).  The whole curve on 40 takes a quarter of an hour.
Nothing of amontons is used.  Forces and tangents of the body are GetFEM's (its law
"Ciarlet Geymonat", bilinear squares, 2 x 2 Gauss points).  The rest is written here: for given
statuses of the contact nodes the problem is smooth, its curve is followed by arclength, the
point where a status ends is solved for together with gamma, and the curve goes on, with the new
status, on the side where its condition holds.

Statuses: f free, s stick, - slip to the right, + slip to the left.  Reactions r are the forces
on the body, r_N > 0 in compression; signs of the paper in what is written: u_nu = -u_y,
T_nu = -r_N / h, T_tau = r_T / h.
"""

import json
import sys

import getfem as gf
import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

LAME, SHEAR, A = 4000.0, 120.0, 30.0  # N/mm2
TURN, MU, GAMMA = 0.023, 1.8, 0.495
ALONG = (0.25, 0.45, 0.52, 0.75, 1.0)
SMALL = 1e-10  # N, mm: what counts as zero in a margin


class Block:
    """The body with its contact nodes; unknowns y: free displacements, and gamma."""

    def __init__(self, cells):
        grid = np.linspace(0, 40, cells + 1), np.linspace(0, 80, 2 * cells + 1)
        mesh = gf.Mesh("cartesian", *grid)
        space = gf.MeshFem(mesh, 2)
        space.set_fem(gf.Fem("FEM_QK(2,1)"))
        rule = gf.MeshIm(mesh, gf.Integ("IM_GAUSS_PARALLELEPIPED(2,3)"))
        self.kept = mesh, space, rule  # GetFEM does not keep them itself
        self.model = gf.Model("real")
        self.model.add_fem_variable("u", space)
        self.model.add_initialized_data("law", [LAME, SHEAR, A])
        self.model.add_finite_strain_elasticity_brick(rule, "Ciarlet Geymonat", "u", "law")
        X = space.basic_dof_nodes()  # (2, dofs): of every dof; components take turns
        self.X, self.h = X, 40 / cells
        top = np.isclose(X[1], 80)
        self.free, self.fixed = np.flatnonzero(~top), np.flatnonzero(top)
        bottom = np.flatnonzero(np.isclose(X[1], 0))[::2]
        bottom = bottom[np.argsort(X[0, bottom])]
        self.at = np.stack([bottom, bottom + 1], axis=1)  # (nc, 2): x, y
        place = np.full(X.shape[1], -1)
        place[self.free] = np.arange(len(self.free))
        self.rows = place[self.at]
        c, s = -2 * np.sin(TURN / 2) ** 2, np.sin(TURN)
        x = X[0, self.fixed]
        self.lift = np.where(np.arange(len(x)) % 2 == 0, x * c, x * s)
        self.down = np.where(np.arange(len(x)) % 2 == 0, 0.0, -1.0)
        even = np.arange(X.shape[1]) % 2 == 0
        rotated = np.where(even, X[0] * c - (X[1] - 80) * s, X[0] * s + (X[1] - 80) * c)
        self.start = rotated[self.free]

    def body(self, y, gamma):
        """(u (dofs,), forces (dofs,), tangent (dofs, dofs)) of the body."""
        u = np.empty(self.X.shape[1])
        u[self.free], u[self.fixed] = y, self.lift + gamma * self.down
        self.model.set_variable("u", u)
        self.model.assembly("build_all")
        K = self.model.tangent_matrix()
        pointers, rows = K.csc_ind()
        size = len(u)
        matrix = sparse.csc_matrix((K.csc_val(), rows, pointers), shape=(size, size))
        return u, -np.asarray(self.model.rhs()), matrix

    def system(self, y, gamma, statuses):
        """(H (n,), dH/dy (n, n), dH/dgamma (n,), u, forces, K) for given statuses."""
        u, forces, K = self.body(y, gamma)
        K = K.tocsr()
        H, J = forces[self.free].copy(), K[self.free].tolil()
        for k, (x, z) in enumerate(self.at):
            laws = self.laws(statuses[k], u, forces, K, x, z)
            for row, (value, slope) in zip(self.rows[k], laws, strict=True):
                H[row], J[row] = value, slope
        J = J.tocsr()
        by_gamma = J[:, self.fixed] @ self.down
        return H, J[:, self.free].tocsc(), by_gamma, u, forces, K

    def laws(self, status, u, forces, K, x, z):
        """Two conditions of a contact with their derivatives."""
        held = [(u[i], sparse.csr_matrix(([1.0], ([0], [i])), (1, len(u)))) for i in (x, z)]
        pushed = [(forces[i], K[[i]]) for i in (x, z)]
        if status == "f":
            return pushed
        if status == "s":
            return held
        sign = MU if status == "-" else -MU
        slip = (forces[x] + sign * forces[z], pushed[0][1] + sign * pushed[1][1])
        return slip, held[1]

    def margins(self, statuses, u, forces, K=None):
        """[(contact, name, value, derivative by u or None)]: all >= 0 on the piece."""
        out = []
        for k, (x, z) in enumerate(self.at):
            one = {i: ({"u": (i, 1.0)}) for i in (x, z)}
            if statuses[k] == "f":
                out.append((k, "opens", u[z], one[z]))
                continue
            out.append((k, "presses", forces[z], {"f": [(z, 1.0)]}))
            if statuses[k] == "s":
                for sign in (1.0, -1.0):
                    out.append((k, f"holds {sign:+.0f}", MU * forces[z] + sign * forces[x],
                                {"f": [(z, MU), (x, sign)]}))  # fmt: skip
            else:
                sign = 1.0 if statuses[k] == "-" else -1.0
                out.append((k, "slips", sign * u[x], {"u": (x, sign)}))
        return out

    def slope(self, what, K):
        """The derivative of a margin by u, (dofs,)."""
        row = np.zeros(self.X.shape[1])
        if "u" in what:
            i, factor = what["u"]
            row[i] = factor
        for i, factor in what.get("f", ()):
            row += factor * K[[i]].toarray().ravel()
        return row

    def node(self, u, forces):
        """The node at (10, 0), signs of the paper."""
        k = int(np.argmin(np.abs(self.X[0, self.at[:, 0]] - 10)))
        x, z = self.at[k]
        return {"u_nu": -u[z], "u_tau": u[x],
                "T_nu": -forces[z] / self.h, "T_tau": forces[x] / self.h}  # fmt: skip


class Curve:
    """A point of the curve, its statuses and tangent."""

    def __init__(self, block):
        self.block, self.y, self.gamma = block, block.start, 0.0
        self.statuses = ["f"] * len(block.at)
        self.kappa = 1.0 / len(self.y)
        self.tangent = np.r_[np.zeros(len(self.y)), 1.0]
        self.tangent = self.tangent_at(self.y, self.gamma)
        self.folds, self.solutions, self.along = [], [], []

    def product(self, a, b):
        """The weighted product of two directions (y, gamma)."""
        return self.kappa * (a[:-1] @ b[:-1]) + a[-1] * b[-1]

    def bordered(self, J, by_gamma, row):
        """The factors of the derivatives with one more row."""
        return splu(sparse.bmat([[J, by_gamma[:, None]], [row[None, :-1], row[-1:, None]]],
                                format="csc"))  # fmt: skip

    def border(self, t):
        """The row that makes the product with a direction."""
        return np.r_[self.kappa * t[:-1], t[-1]]

    def tangent_at(self, y, gamma):
        """The unit tangent that agrees with the last one."""
        _, J, by_gamma, *_ = self.block.system(y, gamma, self.statuses)
        right = np.zeros(len(y) + 1)
        right[-1] = 1.0
        t = self.bordered(J, by_gamma, self.border(self.tangent)).solve(right)
        return t / np.sqrt(self.product(t, t))

    def solved(self, z, row, target):
        """Newton's method on H = 0 and row . (y, gamma) = target(u, forces, K)."""
        for _ in range(12):
            H, J, by_gamma, u, forces, K = self.block.system(z[:-1], z[-1], self.statuses)
            rest, slope = row(z, u, forces, K)
            step = self.bordered(J, by_gamma, slope).solve(-np.r_[H, rest])
            z = z + step
            if np.sqrt(self.product(step, step)) < target:
                return z
        return None

    def ahead(self, step):
        """The point a step along the tangent, on the hyperplane across it."""
        here, row = np.r_[self.y, self.gamma], self.border(self.tangent)
        goal = here + step * self.tangent
        return self.solved(goal, lambda z, u, f, K: (row @ (z - goal), row), 1e-11)

    def at_gamma(self, z, gamma):
        """The point of this piece at a fixed gamma."""
        last = np.r_[np.zeros(len(self.y)), 1.0]
        z = z.copy()
        z[-1] = gamma
        return self.solved(z, lambda z, u, f, K: (z[-1] - gamma, last), 1e-12)

    def where_ends(self, z, what):
        """The point at which a margin is zero."""
        b = self.block

        def row(z, u, forces, K):
            whole = b.slope(what, K)
            value = sum(c * forces[i] for i, c in what.get("f", ()))
            if "u" in what:
                i, factor = what["u"]
                value = factor * u[i]
            return value, np.r_[whole[b.free], whole[b.fixed] @ b.down]

        return self.solved(z, row, 1e-12)

    def check(self, z):
        """(u, forces) of a point, with all margins >= 0; raises where they are not."""
        _, _, _, u, forces, K = self.block.system(z[:-1], z[-1], self.statuses)
        worst = min(value for _, _, value, _ in self.block.margins(self.statuses, u, forces))
        if worst < -SMALL * 10:
            raise RuntimeError(f"a margin is {worst} at gamma = {z[-1]}")
        return u, forces, K

    def note(self, new):
        """Solutions at the values that are asked for, on the way to a new point."""
        for gamma in (GAMMA, *ALONG):
            if min(self.gamma, new[-1]) < gamma <= max(self.gamma, new[-1]):
                share = (gamma - self.gamma) / (new[-1] - self.gamma)
                here = np.r_[self.y, self.gamma]
                z = self.at_gamma(here + share * (new - here), gamma)
                u, forces, _ = self.check(z)
                row = self.block.node(u, forces)
                if gamma == GAMMA:
                    pattern = "".join(self.statuses)
                    self.solutions.append({"corner": pattern[-1], "pattern": pattern, **row})
                else:
                    self.along.append({"gamma": gamma, **row})

    def move(self, z):
        """On to a point of this piece."""
        self.note(z)
        self.y, self.gamma = z[:-1], z[-1]

    def turn(self, contact, name, sense):
        """The next piece, on the side where the new status of a contact holds."""
        b = self.block
        u, forces, K = b.body(self.y, self.gamma)
        x, _ = b.at[contact]
        old = self.statuses[contact]
        if name == "opens":
            new = "-" if u[x] > 0 else "+"
        elif name == "presses":
            new = "f"
        elif name == "slips":
            new = "s"
        else:
            new = "-" if name == "holds +1" else "+"
        self.statuses[contact] = new
        K = K.tocsr()
        shows = {("f", "-"): "presses", ("f", "+"): "presses", ("s", "-"): "slips",
                 ("s", "+"): "slips"}.get((old, new))  # fmt: skip
        shows = shows or {"f": "opens", "s": name_of_hold(old)}[new]
        (what,) = [w for k, n, _, w in b.margins(self.statuses, u, forces)
                   if k == contact and n == shows]  # fmt: skip
        self.tangent = self.tangent_at(self.y, self.gamma)
        whole = b.slope(what, K)
        rate = whole[b.free] @ self.tangent[:-1] + whole[b.fixed] @ b.down * self.tangent[-1]
        self.tangent = self.tangent * np.sign(rate)
        if self.tangent[-1] * sense < 0:
            self.folds.append(self.gamma)

    def follow(self, longest=0.05):
        """To gamma = 1."""
        b, step = self.block, 1e-3
        while self.gamma < 1.0:
            z = self.ahead(step)
            if z is None or self.product(self.tangent, self.tangent) < 0.5:
                step /= 3
                continue
            _, _, _, u0, f0, _ = b.system(self.y, self.gamma, self.statuses)
            _, _, _, u1, f1, _ = b.system(z[:-1], z[-1], self.statuses)
            before, after = b.margins(self.statuses, u0, f0), b.margins(self.statuses, u1, f1)
            ended = [
                (m0[2] / (m0[2] - m1[2]), m0) for m0, m1 in zip(before, after, strict=True)
                if m1[2] < -SMALL and m0[2] > m1[2] + SMALL
            ]  # fmt: skip
            if not ended:
                if z[-1] >= 1.0:
                    z = self.at_gamma(z, 1.0)
                self.move(z)
                old = self.tangent
                self.tangent = self.tangent_at(self.y, self.gamma)
                if old[-1] * self.tangent[-1] < 0:
                    raise RuntimeError("a smooth fold, which this script does not locate")
                step = min(1.5 * step, longest)
                continue
            if len(ended) > 1 and step > 1e-5:
                step /= 3
                continue
            share, (contact, name, _, what) = min(ended, key=lambda e: e[0])
            here = np.r_[self.y, self.gamma]
            border = self.where_ends(here + max(share, 0.0) * (z - here), what)
            if border is None:
                step /= 3
                continue
            sense = self.tangent[-1]
            self.move(border)
            self.turn(contact, name, sense)
            step = min(step, 5e-3)


def name_of_hold(old):
    """The condition of stick that ends where slip of this status begins."""
    return "holds +1" if old == "-" else "holds -1"


def record(cells):
    """What `reference.json` holds of one mesh."""
    curve = Curve(Block(cells))
    curve.follow()
    return {"folds": curve.folds, "at 0.495": curve.solutions, "along": curve.along}


def with_statuses(cells, patterns):
    """The solutions at 0.495 that have given statuses; raises where a condition fails."""
    curve = Curve(Block(cells))
    begin, rows = np.r_[curve.y, 0.0], []
    last = np.r_[np.zeros(len(curve.y)), 1.0]
    for pattern in patterns:
        curve.statuses = list(pattern)
        z = curve.solved(begin, lambda z, u, f, K: (z[-1] - GAMMA, last), 1e-12)
        u, forces, _ = curve.check(z)
        rows.append({"corner": pattern[-1], "pattern": pattern,
                     **curve.block.node(u, forces)})  # fmt: skip
    return {"at 0.495": rows}


def asked(argument):
    """(squares, record) of one argument."""
    cells, _, patterns = argument.partition("=")
    found = with_statuses(int(cells), patterns.split(",")) if patterns else record(int(cells))
    return str(2 * int(cells) ** 2), found


if __name__ == "__main__":
    gf.util_trace_level(0)
    found = dict(asked(argument) for argument in sys.argv[1:])
    print(json.dumps(found, indent=1, default=float))
