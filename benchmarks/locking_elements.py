"""Cook's membrane at poisson 0.4999 with other quadrilaterals of four nodes, plane strain.

    python benchmarks/locking_elements.py

Small strains, n x n cells, the corner's deflection in percent off the reference of `locking`.
Elements of the literature, written out here and nowhere else in the project:

    enhanced strains with 4, 5 and 7 parameters   Simo, Rifai 1990 (E4 is Simo, Armero 1992)
    incompatible modes                            Taylor, Beresford, Wilson 1976
    assumed stress with 5 parameters              Pian, Sumihara 1984
    mean dilatation                               Nagtegaal, Parks, Rice 1974
    mean dilatation, E4 in the deviatoric part
"""

import numpy as np
from locking import LINEAR, REFERENCE, SIZES
from scipy import sparse
from scipy.sparse.linalg import spsolve

SHEAR = LINEAR.young / (2 * (1 + LINEAR.poisson))
LAME = 2 * SHEAR * LINEAR.poisson / (1 - 2 * LINEAR.poisson)
ONE = np.array([1.0, 1.0, 0.0])
DEVIATORIC = SHEAR * np.array([[4 / 3, -2 / 3, 0], [-2 / 3, 4 / 3, 0], [0, 0, 1]])
MODULI = DEVIATORIC + (LAME + 2 * SHEAR / 3) * np.outer(ONE, ONE)
XI, ETA = np.array([-1, 1, 1, -1.0]), np.array([-1, -1, 1, 1.0])
POINTS = [(s / np.sqrt(3), t / np.sqrt(3)) for s in (-1, 1) for t in (-1, 1)]


def slopes(s, t, x):
    """(dN/dx (2, 4), det J, J) at a point of the cell x (4, 2); rows of J: dx/ds, dx/dt."""
    by_reference = 0.25 * np.array([XI * (1 + ETA * t), ETA * (1 + XI * s)])
    jac = by_reference @ x
    return np.linalg.solve(jac, by_reference), np.linalg.det(jac), jac


def strain(by_place):
    """B (3, 2 k) of functions with the slopes (2, k)."""
    out = np.zeros((3, 2 * by_place.shape[1]))
    out[0, 0::2], out[1, 1::2] = by_place
    out[2, 0::2], out[2, 1::2] = by_place[::-1]
    return out


def pushed(jac):
    """Stresses in the frame of the cell's centre to those along x and y, (3, 3)."""
    (a, b), (c, d) = jac.T
    return np.array([[a * a, b * b, 2 * a * b], [c * c, d * d, 2 * c * d],
                     [a * c, b * d, a * d + b * c]])  # fmt: skip


def enhanced(s, t, count):
    """Strains (3, count) in the frame of the cell's centre."""
    out = np.zeros((3, count))
    out[0, 0], out[1, 1], out[2, 2], out[2, 3] = s, t, s, t
    if count == 5:
        out[:, 4] = s * t, -s * t, s * s - t * t
    if count == 7:
        out[0, 4] = out[1, 5] = out[2, 6] = s * t
    return out


def condensed(x, moduli, modes):
    """Stiffness (8, 8) with strains modes(s, t, J of the centre) eliminated."""
    _, det_0, jac_0 = slopes(0, 0, x)
    own, mixed, inner = 0, 0, 0
    for s, t in POINTS:
        by_place, det, _ = slopes(s, t, x)
        b, m = strain(by_place), modes(s, t, jac_0) * det_0 / det
        own = own + det * b.T @ moduli @ b
        mixed = mixed + det * b.T @ moduli @ m
        inner = inner + det * m.T @ moduli @ m
    return own - mixed @ np.linalg.solve(inner, mixed.T)


def with_enhanced(count, moduli=MODULI):
    """The element with that many enhanced strains."""
    return lambda x: condensed(x, moduli, lambda s, t, jac: np.linalg.solve(
        pushed(jac).T, enhanced(s, t, count)))  # fmt: skip


def incompatible(x):
    """1 - s^2 and 1 - t^2 in both directions, slopes by the centre's J."""
    return condensed(x, MODULI, lambda s, t, jac: strain(
        np.linalg.solve(jac, np.diag([-2.0 * s, -2.0 * t]))))  # fmt: skip


def assumed_stress(x):
    """Five stresses, linear ones along the centre's axes."""
    at = [(s, t, *slopes(s, t, x)) for s, t in POINTS]
    size = sum(det for _, _, _, det, _ in at)
    middle = [sum(one[3] * one[k] for one in at) / size for k in (0, 1)]
    axes = pushed(slopes(0, 0, x)[2])
    compliance, onto = 0, 0
    for s, t, by_place, det, _ in at:
        stress = np.column_stack([np.eye(3), axes[:, 0] * (t - middle[1]),
                                  axes[:, 1] * (s - middle[0])])  # fmt: skip
        compliance = compliance + det * stress.T @ np.linalg.solve(MODULI, stress)
        onto = onto + det * stress.T @ strain(by_place)
    return onto.T @ np.linalg.solve(compliance, onto)


def volume(x):
    """Stiffness of the mean dilatation, (8, 8)."""
    at = [slopes(s, t, x) for s, t in POINTS]
    size = sum(det for _, det, _ in at)
    mean = sum(det * (ONE @ strain(by_place)) for by_place, det, _ in at) / size
    return (LAME + 2 * SHEAR / 3) * size * np.outer(mean, mean)


def mean_dilatation(x):
    """Deviatoric part in full."""
    at = [slopes(s, t, x) for s, t in POINTS]
    return volume(x) + sum(det * strain(by_place).T @ DEVIATORIC @ strain(by_place)
                           for by_place, det, _ in at)  # fmt: skip


ELEMENTS = {
    "enhanced strains, 4": with_enhanced(4), "enhanced strains, 5": with_enhanced(5),
    "enhanced strains, 7": with_enhanced(7), "incompatible modes": incompatible,
    "assumed stress": assumed_stress, "mean dilatation": mean_dilatation,
    "mean dilatation, 4 in the deviatoric part":
        lambda x: volume(x) + with_enhanced(4, DEVIATORIC)(x),
}  # fmt: skip


def deflection(n, stiffness):
    """Of the upper corner, as in `locking.cook`."""
    ticks = np.linspace(0, 1, n + 1)
    s, t = np.repeat(ticks, n + 1), np.tile(ticks, n + 1)
    points = np.column_stack([48 * s, 44 * s + t * (44 - 28 * s)])
    first = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    cells = first[:, None] + [0, n + 1, n + 2, 1]
    dofs = (2 * cells[:, :, None] + [0, 1]).reshape(-1, 8)
    values = np.array([stiffness(points[cell]) for cell in cells])
    where = (np.repeat(dofs, 8, axis=1).ravel(), np.tile(dofs, (1, 8)).ravel())
    K = sparse.csc_array((values.ravel(), where))
    load, free = np.zeros(2 * len(points)), np.arange(2 * (n + 1), 2 * len(points))
    load[2 * n * (n + 1) + 1 :: 2] = 100 / n
    load[[2 * n * (n + 1) + 1, -1]] /= 2
    return spsolve(K[free][:, free], load[free])[-1]


def main():
    """Print the table."""
    reference = REFERENCE["cook", "linear", 2]
    for name, stiffness in ELEMENTS.items():
        errors = [100 * (deflection(n, stiffness) / reference - 1) for n in SIZES["cook"]]
        print(f"| {name} | {' | '.join(f'{error:.1f}' for error in errors)} |", flush=True)


if __name__ == "__main__":
    main()
