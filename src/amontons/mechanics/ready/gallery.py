"""Small standard problems for documentation, tests and benchmarks: no mesh, no file."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...core.errors import InvalidInput
from ...problem.friction import FrictionProblem

Array = NDArray[np.float64]
GRAVITY = 9.81  # m / s^2


def one_contact_2d(mu: float = 2.0) -> FrictionProblem:
    """One 2D contact with three solutions for mu = 2: open, stick and slip.

    W = [[1, .8], [.8, 1]], q = (0.2, 1).  Up to mu = 1.2 it has the open solution only; at
    mu = 2 also stick r = (5/3, -7/3) and slip r = (1/3, -2/3).
    """
    W = np.array([[1.0, 0.8], [0.8, 1.0]])
    return FrictionProblem.from_delassus(W, [[0.2, 1.0]], [mu], name="one-contact-2d")


def random_delassus(
    seed: int, contacts: int, dimension: int = 3, *, rank: int | None = None, mu: float = 0.5
) -> FrictionProblem:
    """A random problem W = A A^T of the given rank (full by default) that has a solution.

    q = -W r0 + u0 with r0 inside the cone where u0 = 0 and r0 = 0 where u0_N > 0: it is built
    about one solution, whose contacts are open or stick.
    """
    m = contacts * dimension
    if contacts < 1 or dimension not in (2, 3):
        raise InvalidInput(
            f"random_delassus: expected contacts >= 1 in 2 or 3 dimensions, "
            f"got {contacts} in {dimension}"
        )
    random = np.random.default_rng(seed)
    A = random.standard_normal((m, rank if rank is not None else m)) / np.sqrt(m)
    W = A @ A.T
    closed = random.random(contacts) < 0.6
    r = np.zeros((contacts, dimension))
    r[:, 0] = random.uniform(0.5, 2.0, contacts)
    direction = random.standard_normal((contacts, dimension - 1))
    length = np.linalg.norm(direction, axis=1, keepdims=True)
    r[:, 1:] = 0.6 * mu * r[:, :1] * direction / length
    r[~closed] = 0
    u = np.zeros_like(r)
    u[~closed, 0] = random.uniform(0.1, 1.0, int((~closed).sum()))
    q = u - (W @ r.ravel()).reshape(r.shape)
    return FrictionProblem.from_delassus(W, q, np.full(contacts, mu), name=f"random-{seed}")


def cylinder_on_half_plane(
    strips: int = 101, *, approach: float = 5e-3, shift: float = 0.0, mu: float = 0.5
) -> FrictionProblem:
    """Cylinder pressed and then pushed sideways on an elastically similar half plane, in 2D.

    Hertz, and Cattaneo and Mindlin's partial slip: normal and tangential compliance are equal
    and do not couple.  Radius 1, modulus E* = 1 (plane strain), strips of constant traction on
    -0.2 <= x <= 0.2; each contact is a strip, r its force, u its gap and sliding.  approach and
    shift are the displacements of the cylinder against a point at depth 10.

    K. L. Johnson, "Contact Mechanics" (1985), section 2.1 (Flamant), 4.2 and 7.2.
    """
    half_width = 0.2
    x, h = np.linspace(-half_width, half_width, strips, retstep=True)

    def integral(s: Array) -> Array:
        """Integral of ln(10 / |s|)."""
        return s * (1 + np.log(10 / np.abs(s)))

    distance = x[:, None] - x[None, :]
    compliance = 2 / (np.pi * h) * (integral(distance + h / 2) - integral(distance - h / 2))
    W: Array = np.kron(compliance, np.eye(2)).astype(float, copy=False)
    q = np.column_stack([x**2 / 2 - approach, np.full(strips, shift)])
    return FrictionProblem.from_delassus(W, q, np.full(strips, mu), name="cylinder")


def box_tower(boxes: int = 4, *, mu: float = 0.6, push: float = 0.3) -> FrictionProblem:
    """Tower of rigid boxes, the top one pushed (one time step, global form).

    Each unit box of 1 kg has six velocities and touches the one below at four corners.  push:
    force on the top box as a part of its weight.  v is a velocity in m/s, r an impulse in N s;
    the step is 1 s.  W is singular: four corners are more than three unknowns can tell apart.
    """
    if boxes < 1:
        raise InvalidInput(f"boxes: expected at least 1, got {boxes}")
    n, nc = 6 * boxes, 4 * boxes
    inertia = 1 / 6  # kg m^2 of a unit cube of 1 kg
    M = sparse.diags_array(np.tile([1.0, 1.0, 1.0, inertia, inertia, inertia], boxes))
    f = np.zeros(n)
    f[2::6] = -GRAVITY
    f[6 * (boxes - 1)] = push * GRAVITY
    H = np.zeros((n, 3 * nc))
    corners = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)]
    for k in range(boxes):
        for c, (x, y) in enumerate(corners):
            columns = slice(3 * (4 * k + c), 3 * (4 * k + c) + 3)
            H[6 * k : 6 * k + 6, columns] = _point_forces(np.array([x, y, -0.5]))
            if k > 0:
                H[6 * k - 6 : 6 * k, columns] = -_point_forces(np.array([x, y, 0.5]))
    return FrictionProblem.from_global(
        M.tocsc(), sparse.csc_array(H), f, np.zeros((nc, 3)), np.full(nc, mu), name="tower"
    )


def _point_forces(arm: Array) -> Array:
    """Wrenches (6, 3) about the centre of unit forces along z, x, y at `arm`, shape (3,)."""
    axes = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    return np.vstack([axes.T, np.cross(arm, axes).T])


def sphere_packing(
    count: int = 5, *, layers: int = 4, mu: float = 0.3, seed: int = 1
) -> FrictionProblem:
    """Layers of spheres on a square grid, shaken (one time step, local form).

    count x count spheres a layer, of 1 kg and diameter 1 m, touch their six neighbours and the
    ground; random velocities and weight load them for one step of 1 s.
    """
    random = np.random.default_rng(seed)
    centres = np.array(
        [(x, y, z) for z in range(layers) for y in range(count) for x in range(count)], float
    )
    index = {tuple(c): k for k, c in enumerate(centres.astype(int))}
    pairs: list[tuple[int, int | None, Array]] = [
        (k, None, np.array([0.0, 0, 1])) for k, c in enumerate(centres) if c[2] == 0
    ]
    for k, c in enumerate(centres.astype(int)):
        for axis in np.eye(3, dtype=int):
            other = index.get(tuple(c + axis))
            if other is not None:
                pairs.append((other, k, axis.astype(float)))
    n, nc = 6 * len(centres), len(pairs)
    H = sparse.lil_array((n, 3 * nc))
    for i, (above, below, normal) in enumerate(pairs):
        frame = np.roll(np.eye(3), -int(np.argmax(normal)), axis=0)
        for body, side in ((above, -0.5), (below, 0.5)):
            if body is not None:
                sign = 1.0 if body == above else -1.0
                wrench = np.vstack([frame.T, np.cross(side * normal, frame).T])
                H[6 * body : 6 * body + 6, 3 * i : 3 * i + 3] = sign * wrench
    masses = np.tile([1.0, 1.0, 1.0, 0.1, 0.1, 0.1], len(centres))  # 2/5 m (d/2)^2 = 0.1
    f = masses * random.standard_normal(n)
    f[2::6] -= GRAVITY
    problem = FrictionProblem.from_global(
        sparse.diags_array(masses).tocsc(), H.tocsc(), f, np.zeros((nc, 3)),
        np.full(nc, mu), name="spheres",
    )  # fmt: skip
    return problem.condensed()


GALLERY: dict[str, Callable[[], FrictionProblem]] = {
    "cylinder": cylinder_on_half_plane,
    "one-contact": one_contact_2d,
    "spheres": sphere_packing,
    "tower": box_tower,
}
