"""Nodes that slide off the master's edge, or onto it: their law fades, nothing drops out.

Of a slave node s of which hardly anything faces the master the gap is told by a sliver of its
facets, and a force that keeps it would act there.  It gets the mean pressure of its neighbours
instead; in between the law is mixed so that forces are continuous in the positions, without
which no equilibrium need exist.  With M_sq = int phi_s phi_q on what faces the master, D_s as
in `current_mortar`, A_s the undeformed area around s and c_s = D_s / A_s its covered part,

    p_s = sum_q M_sq lambda_q / A_q / a_s,    a_s = sum_q M_sq c_q,    q != s,              (1)
    kappa_s = c_s (sum_q M_sq) / a_s,         w_s = t^2 (3 - 2 t),  t = min(kappa_s / FULL, 1),

p is the mean of the pressures lambda_q / D_q with weights M_sq c_q, and kappa compares the part
of s with that of its neighbours; where it is largest w is 1, so that each part of the surface
that takes part carries.  The law (2) of `current` takes

    lambda - rho u  ->  w (lambda - rho u) + (1 - w) D_s p_s,                               (2)

u of gap and motion, its own compliance and offset among them: for w = 1 the law as it is, for
w = 0 the mean force as far as it is within the cone.  A uniform pressure is no error of either.
That is the law of g' and s' in the place of g and s, H = (lambda - D p) / rho,

    g' = w g + (1 - w) (n . H - C n . lambda - o),
    s' = w s + (1 - w) (H - C_T D p_T),    q' = w q,                                        (3)

C_T and q of springs along the surface (`framed_point`), else zero, which `local` of `current`
tells, so that statuses and errors are those of the law; but g of who bears nothing and is open
by g as well, as g' goes to zero with w however far away the master is.  What slid while open,
`closing`, is taken off z_T as (2) has it: for w = 0 off the mean force.  A bound that is a
given stress says itself how much a node bears of what faces it: Tresca's law does not fade.

Whose neighbours have no row, or a sliver as well, compares with nobody: kappa is infinite, or
1, and w is 1.  That its averages are extrapolations from a sliver the covered part itself says,
and how far its force is believed away from a solution, (3) of `model.moved_pairs`:

    theta_s = w_s S(c_s / FULL),    S(t) = t^2 (3 - 2 t) for t < 1, else 1.                 (4)

Where the master ends with a facet kappa_s is 1/2, at a corner of quadrilaterals 5/12, and 1/3
where the facet beyond is twice as long, or at a corner with one of six triangles: such nodes
bear whole, and FULL is less.  With a facet beyond k times as long kappa_s is 1 / (1 + k): a
node at the end fades where the facet beyond it is more than three times as long.
How much of a node beyond the end bears tells how wide the master acts.  So does the side that
ends if it is the slave: its last node presses all of the master's facet that it stands within.
Between evenly fine sides both are equally wide, in the mean over places of the end, with FULL
of 0.21 to 0.31: stiffness ratios 1 to 100, with and without friction, quadrilaterals, triangles
and second order.  With 1/4 exchange of slave and master changes the force on a block 10 times
as stiff as a slab, with five facets under it, by 0.2 % (root mean square over places), with 0.4
by 2.3 %; with a coarser side that ends by more, as that is wider by its own facets.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...linear.sums import Blocks, sum_of_blocks, sum_of_products
from .current_slopes import blocks_of

if TYPE_CHECKING:
    from .current import Partials
    from .current_mortar import MortarMeeting

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
FULL = 0.25  # part of a node, of that of its neighbours, from which on it bears for itself
NOTHING = 1e-9  # of the largest force: one that is none, beside tolerances
RESOLVED = 1e-12  # of the force that would close a gap: what rounding leaves, where none bears


@dataclass(frozen=True, eq=False)
class Fading:
    """(1) of a meeting whose pair has the areas A (nc,) around its slaves."""

    at: MortarMeeting
    areas: Array

    # ---------------------------------------------------------------- at facets
    @cached_property
    def _beside(self) -> Array:
        """M on facets without its diagonal, of nodes that carry, (f, a, a)."""
        parts = self.at.shared
        kept = self.at.rows >= 0
        both = kept[:, :, None] & kept[:, None, :]
        return np.where(both, parts.mass, 0.0) * (1 - np.eye(kept.shape[1]))

    def _there(self, values: Array) -> Array:
        """Values (nc, ...) at the nodes of facets, (f, a, ...), zero for none."""
        rows = self.at.rows
        kept = (rows >= 0).reshape(rows.shape + (1,) * (values.ndim - 1))
        return np.where(kept, values[rows], 0.0)

    def _summed(self, parts: Array) -> Array:
        """Sums (nc,) of parts (f, a)."""
        rows = self.at.rows
        kept = rows >= 0
        found = np.bincount(rows[kept], parts[kept], minlength=len(self.areas))
        return np.asarray(found, dtype=np.float64)

    # ---------------------------------------------------------------- at nodes
    @cached_property
    def _covered(self) -> Array:
        """c, (nc,)."""
        return self.at.weights / self.areas

    @cached_property
    def _sums(self) -> tuple[Array, Array]:
        """a and sum_q M_sq, (nc,)."""
        c = self._there(self._covered)
        a = self._summed((self._beside @ c[:, :, None])[:, :, 0])
        return a, self._summed(self._beside.sum(axis=2))

    @cached_property
    def _kappa(self) -> Array:
        """kappa, (nc,), infinite where nobody is beside."""
        a, whole = self._sums
        alone = ~(a > 0)
        return np.where(alone, np.inf, self._covered * whole / np.where(alone, 1.0, a))

    @cached_property
    def faint(self) -> Mask:
        """Whose law is mixed, (nc,)."""
        return self.at.met & (self._kappa < FULL)

    @cached_property
    def weights(self) -> Array:
        """w, (nc,)."""
        return _smooth(np.where(self.faint, self._kappa / FULL, 1.0))

    @cached_property
    def hardly(self) -> Mask:
        """Whose theta of (4) is less than 1, (nc,)."""
        return self.at.met & ((self._covered < FULL) | self.faint)

    @cached_property
    def _believed(self) -> tuple[Array, Array]:
        """S of (4) and its derivative by c, (nc,) each; 1 and 0 of who meets nobody."""
        t = np.where(self.at.met, np.minimum(self._covered / FULL, 1.0), 1.0)
        return _smooth(t), 6 * t * (1 - t) / FULL

    @property
    def theta(self) -> Array:
        """(4), (nc,)."""
        return self.weights * self._believed[0]

    def theta_slopes(self, factors: Array) -> sparse.csr_array:
        """Derivative by x of factors_s theta_s, (nc m, nodes d); factors (nc, m), held."""
        nc, m = factors.shape
        whole, steep = self._believed
        by_D = factors * (self.weights * steep / self.areas)[:, None]
        spread = blocks_of(by_D[:, :, None])
        out = sparse.csr_array(spread @ self.at.slopes.weights.matrix)
        if not self.faint.any():
            return out
        d = self.at.x.shape[1]
        nothing = np.zeros((nc, d)), np.zeros((nc, m, d))
        return sparse.csr_array(out + self.slopes(*nothing, factors * whole[:, None]))

    @cached_property
    def _factor(self) -> Array:
        """D / a of the faint, (nc,), zero for others."""
        a = np.where(self.faint, self._sums[0], 1.0)
        return np.where(self.faint, self.at.weights / a, 0.0)

    @cached_property
    def shares(self) -> sparse.csr_array:
        """D_s p_s per force lambda_q, (nc, nc), of the faint alone."""
        nc, rows = len(self.areas), self.at.rows
        some = self._some
        values = self._beside[some] * self._there(self._factor)[some][:, :, None]
        values = values * self._there(1 / self.areas)[some][:, None, :]
        return sum_of_blocks(
            [(values, rows[some], np.maximum(rows[some], 0))], (nc, nc)
        )

    @cached_property
    def _some(self) -> Mask:
        """Facets (f,) with a faint node."""
        rows = self.at.rows
        return np.asarray((self.faint[rows] & (rows >= 0)).any(axis=1))

    def slopes(self, force: Array, by_share: Array, by_weight: Array) -> sparse.csr_array:
        """Derivative by x of by_share_s D_s p_s + by_weight_s w_s, (nc m, nodes d).

        force (nc, d): lambda, held; by_share (nc, m, d), by_weight (nc, m).
        """
        rows, (nc, m), n = self.at.rows, by_weight.shape, self.at.x.size
        if not self.faint.any():
            return sparse.csr_array((nc * m, n))
        a, whole = (np.where(self.faint, part, 1.0) for part in self._sums)
        kappa = np.where(self.faint, self._kappa, 0.0)
        steep = 6 * kappa / FULL * (1 - kappa / FULL) * kappa / FULL  # kappa dw/dkappa
        by_kappa = by_weight * steep[:, None]
        by_share = np.where(self.faint[:, None, None], by_share, 0.0)
        grown = np.einsum("pmd,pd->pm", by_share, self.shares @ force) + by_kappa
        by_a = -grown / a[:, None]
        D = np.where(self.faint, self.at.weights, 1.0)
        by_own = grown / D[:, None]
        some = self._some
        taken = self._there(by_share * self._factor[:, None, None])[some]  # (f, s, m, d)
        by_M = np.einsum(
            "fsmd,fqd->fsqm", taken, self._there(force / self.areas[:, None])[some]
        )
        covered = self._there(self._covered)[some]
        by_M += self._there(by_a)[some][:, :, None] * covered[:, None, :, None]
        by_M += self._there(by_kappa / whole[:, None])[some][:, :, None]
        # by D of the neighbours in a_s, (f, s, m, q)
        through = (self._beside * self._there(1 / self.areas)[:, None])[some][:, :, None]
        through = through * self._there(by_a)[some][..., None]
        f, slots = rows[some].shape
        blocks = [(through.reshape(f, slots * m, slots), _rows_of_each(rows[some], m),
                   np.maximum(rows[some], 0)),
                  (by_own[:, :, None], np.arange(nc)[:, None] * m + np.arange(m),
                   np.arange(nc)[:, None])]  # fmt: skip
        by_weights = sum_of_blocks(blocks, (nc * m, nc))
        direct = sum_of_blocks([self._by_facets(by_M)], (nc * m, n))
        return sum_of_products(
            [(None, direct), (by_weights, self.at.slopes.weights)], (nc * m, n)
        )

    def _by_facets(self, by_M: Array) -> Blocks:
        """Entries of derivatives by_M (f, s, q, m) by M_sq on facets with a faint node."""
        of, some, m = self.at.shared.of, self._some, by_M.shape[3]
        rows, slots = self.at.rows, by_M.shape[1]
        kept = (rows >= 0)[some]
        both = kept[:, :, None] & kept[:, None, :] & ~np.eye(slots, dtype=bool)
        by_M = np.where(both[..., None], by_M, 0.0)
        own, _, dofs = self.at.slopes.integrals
        pairs = np.flatnonzero(some[of])
        place = (np.cumsum(some) - 1)[of[pairs]]
        values = np.einsum("ksqm,ksqw->ksmw", by_M[place], own[pairs][:, :, :slots])
        return (values.reshape(len(pairs), slots * m, dofs.shape[1]),
                _rows_of_each(rows[of[pairs]], m), dofs[pairs])  # fmt: skip


def _smooth(t: Array) -> Array:
    """t^2 (3 - 2 t)."""
    return t * t * (3 - 2 * t)


def _rows_of_each(rows: NDArray[np.int64], m: int) -> NDArray[np.int64]:
    """The m rows of each contact in rows (f, a), -1 for none; (f, a m)."""
    each = np.where(rows[:, :, None] >= 0, rows[:, :, None] * m + np.arange(m), -1)
    return each.reshape(len(rows), rows.shape[1] * m)


@dataclass(frozen=True, eq=False)
class Mixture:
    """(3) of all contacts at forces lambda and motions s (nc, d), gaps (nc,), normals (nc, d).

    weights w and theta of (4) (nc,); passed D p (nc, d); rho (nc,); give C and C_T (nc, 2);
    offset o (nc,); free (nc, d); drawn q (nc, d), without what supports hold, None for zero.
    """

    weights: Array
    theta: Array
    passed: Array
    rho: Array
    give: Array
    offset: Array | float
    free: Mask
    force: Array
    own_motion: Array
    own_gap: Array
    normals: Array
    drawn: Array | None = None

    @cached_property
    def _apart(self) -> Array:
        """H, (nc, d)."""
        return (self.force - self.passed) * self.free / self.rho[:, None]

    @cached_property
    def _gap_of_share(self) -> Array:
        """What takes the place of the gap, (nc,)."""
        along = (self.normals * self._apart).sum(axis=1)
        return along - self.give[:, 0] * (self.normals * self.force).sum(axis=1) - self.offset

    @cached_property
    def _motion_of_share(self) -> Array:
        """What takes the place of the motion, (nc, d)."""
        n, passed = self.normals, self.passed
        along = passed - n * (n * passed).sum(axis=1)[:, None]
        return self._apart - self.give[:, 1, None] * along * self.free

    @property
    def gap(self) -> Array:
        """g', (nc,)."""
        w = self.weights
        return np.where(w < 1, w * self.own_gap + (1 - w) * self._gap_of_share, self.own_gap)

    @property
    def told_gap(self) -> Array:
        """g', (nc,), or g where that is more and no force is there: the law holds by either."""
        along = (self.normals * self.force).sum(axis=1)
        most = np.linalg.norm(self.force, axis=1).max(initial=0.0)
        bears = along > np.maximum(NOTHING * most, RESOLVED * self.rho * self.own_gap)
        return np.where(bears, self.gap, np.maximum(self.gap, self.own_gap))

    @property
    def motion(self) -> Array:
        """s', (nc, d)."""
        w = self.weights[:, None]
        mixed = w * self.own_motion + (1 - w) * self._motion_of_share
        return np.where(w < 1, mixed, self.own_motion)

    def chained(self, partials: Partials) -> tuple[Partials, Array, Array]:
        """Partials by lambda, n, g, s and E of those by g' and s', and two more.

        These are by D p (nc, d, d) and by w (nc, d).
        """
        by_force, by_normal, by_gap, by_motion, by_axis = partials
        w, n, free = self.weights, self.normals, self.free[:, None, :]
        less = ((1 - w) / self.rho)[:, None, None]
        by_apart = less * (by_gap[:, :, None] * n[:, None, :] + by_motion) * free
        softer, slipped = ((1 - w)[:, None] * self.give).T[:, :, None, None]
        by_force = by_force + by_apart
        by_force = by_force - softer * by_gap[:, :, None] * n[:, None, :] * free
        turned = (1 - w)[:, None] * self._apart - softer[:, :, 0] * self.force
        by_normal = by_normal + by_gap[:, :, None] * turned[:, None, :]
        by_slip, across = slipped * by_motion * free, n[:, :, None] * n[:, None, :]
        along = (n * self.passed).sum(axis=1)[:, None, None] * np.eye(n.shape[1])
        by_normal = by_normal + by_slip @ (along + n[:, :, None] * self.passed[:, None, :])
        by_share = -by_apart - by_slip @ (np.eye(n.shape[1]) - across)
        faint = w < 1
        change = np.where(faint, self.own_gap - self._gap_of_share, 0.0)
        moved = self.own_motion - self._motion_of_share
        moved = moved if self.drawn is None else moved + self.drawn
        moved = np.where(faint[:, None], moved, 0.0)
        by_weight = by_gap * change[:, None] + np.einsum("pij,pj->pi", by_motion, moved)
        out = (by_force, by_normal, by_gap * w[:, None], by_motion * w[:, None, None], by_axis)
        return out, by_share, by_weight
