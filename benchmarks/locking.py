"""Cook's membrane and a pressed block at poisson 0.4999, on ever finer meshes.

    python benchmarks/locking.py

Cells are integrated as they are by default.  Prints errors in percent against a fine mesh.
"""

import numpy as np

import amontons as am

LINEAR = am.LinearElastic(240.565, 0.4999)
RUBBER = am.NeoHookean(240.565, 0.4999)  # shear 80.2: Simo & Armero 1992
LAWS = {"linear": LINEAR, "rubber": RUBBER}
CELLS = (("quad", 1), ("quad", 2), ("tri", 2), ("tri", 1), ("hex", 1), ("hex", 2), ("tet", 2),
         ("tet", 1))  # fmt: skip
SIZES = {"cook": (2, 4, 8, 16, 32), "block": (2, 4, 8, 16)}
REFERENCE = {  # of tri6 and tet10 on ever finer meshes, right to 0.1 percent
    ("cook", "linear", 2): 8.073, ("cook", "rubber", 2): 6.933,
    ("block", "linear", 2): 24.170, ("block", "rubber", 2): 25.356,
    ("block", "linear", 3): 7.7465, ("block", "rubber", 3): 7.9835,
}  # fmt: skip
TOO_LARGE = 2e4  # unknowns, in 3D


def cook(n, law, kind, order):
    """Deflection of the upper corner of Cook's panel, clamped left, sheared right by 100.

    3D: a slice of n x n x 1 cells between two smooth planes, so that it is plane strain, too.
    """
    flat = kind in ("quad", "tri")
    box = am.box((1, 1), n, kind) if flat else am.box((1, 1, 1), (n, n, 1), kind)
    s, t = box.points.T[:2]
    points = np.column_stack([48 * s, 44 * s + t * (44 - 28 * s), *box.points.T[2:]])
    body = am.Body(am.Mesh(points, box.cells, box.surfaces), law, order=order)
    zero, up = (0.0,) * body.mesh.dim, np.eye(body.mesh.dim)[1]
    supports = [am.Fix("left", zero)]
    if not flat:
        supports += [am.Fix(side, (None, None, 0)) for side in ("bottom", "top")]
    side = "bottom" if flat else "front"
    far = am.Contact(side, am.Plane(up, -99 * up), mu=0.0)
    pull = am.Traction("right", 6.25 * up)
    solution = am.solve(am.Model([body], supports, [far], [pull]), tolerance=1e-7)
    corner = np.abs(body.mesh.points[:, :2] - (48, 60)).sum(axis=1) < 1e-9
    return float(solution.displacement[0][corner, 1].mean())


def block(n, law, kind, order):
    """Force on the block of `solved_block`."""
    return float(solved_block(n, law, kind, order).resultant[-1])


def solved_block(n, law, kind, order):
    """A block of 2 x 1, n cells high, bonded on top, pressed by 2 %, friction 0.5.

    3D: a quarter of a block of 2 x 2 x 1, with two planes of symmetry.
    """
    flat = kind in ("quad", "tri")
    mesh = am.box((2, 1), (2 * n, n), kind) if flat else am.box((1, 1, 1), n, kind)
    up = np.eye(mesh.dim)[-1]
    supports = [am.Fix("top", tuple(-0.02 * up))]
    if not flat:
        supports += [am.Fix("left", (0, None, None)), am.Fix("front", (None, 0, None))]
    floor = am.Contact("bottom", am.Plane(up), mu=0.5)
    body = am.Body(mesh, law, order=order)
    return am.solve(am.Model([body], supports, [floor]))


def row(problem, law, kind, order):
    """Errors in percent on all meshes."""
    dim = 2 if kind in ("quad", "tri") else 3
    reference = REFERENCE[problem, law, 2 if problem == "cook" else dim]
    out = []
    for n in SIZES[problem]:
        if problem == "block" and dim == 3 and 3 * (order * n + 1) ** 3 > TOO_LARGE:
            break
        value = (cook if problem == "cook" else block)(n, LAWS[law], kind, order)
        out.append(f"{100 * (value / reference - 1):.1f}")
    return out


def main():
    from machine import options  # beside this file where it runs, not where a test takes it

    options(__doc__).parse_args()
    for problem, sizes in SIZES.items():
        for law in LAWS:
            print(f"\n| {problem}, {law} | {' | '.join(map(str, sizes))} |")
            print("|---" * (len(sizes) + 1) + "|", flush=True)
            for kind, order in CELLS:
                name = {"quad": "quad9", "tri": "tri6", "hex": "hex27", "tet": "tet10"}[kind]
                cells = " | ".join(row(problem, law, kind, order))
                print(f"| {name if order == 2 else kind} | {cells} |", flush=True)


if __name__ == "__main__":
    main()
