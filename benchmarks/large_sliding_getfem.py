"""A setting of `large_sliding` with GetFEM's large sliding contact brick (ray tracing).

    /usr/bin/python3 benchmarks/large_sliding_getfem.py given.json found.json

Run with an interpreter that has GetFEM.  Bodies are quadrilaterals or hexahedra of first order;
the contact stress is of first order on the slave, r = `augmentation` times the softer modulus,
as its manual advises a number near the modulus.  Driven nodes have multipliers, supports a
penalty of 1e6 moduli.  What is found is written after every load step.
"""

import json
import sys
import time

import getfem as gf
import numpy as np

DRIVEN, SLAVE, MASTER, HELD = 1, 2, 3, 10
ORDER = {4: [0, 1, 3, 2], 8: [0, 1, 3, 2, 4, 5, 7, 6]}


def mesh_of(points, cells):
    """(mesh, our number of each of its points)."""
    points, cells = np.array(points), np.array(cells)
    d = points.shape[1]
    mesh = gf.Mesh("empty", d)
    numbers = {int(k): i for i, k in enumerate(mesh.add_point(points.T))}
    transform = gf.GeoTrans(f"GT_QK({d},1)")
    for cell in cells:
        mesh.add_convex(transform, points[cell[ORDER[len(cell)]]].T)
    return mesh, numbers


def region(mesh, numbers, name, nodes, facets=None):
    """Mark the outer faces whose nodes are all among `nodes`, or are one of the facets."""
    nodes = set(nodes)
    wanted = None if facets is None else {frozenset(f) for f in facets}
    faces = []
    for cell, face in mesh.outer_faces().T:
        ends = [numbers[int(p)] for p in mesh.pid_in_faces(np.array([[cell], [face]]))]
        if set(ends) <= nodes and (wanted is None or frozenset(ends) in wanted):
            faces.append([cell, face])
    mesh.set_region(name, np.array(faces).T)


def main(source, target):
    """Solve all load steps; stop where one does not converge."""
    given = json.load(open(source))
    md = gf.Model("real")
    parts = []
    softest = min(body["young"] for body in given["bodies"])
    for k, body in enumerate(given["bodies"]):
        mesh, numbers = mesh_of(body["points"], body["cells"])
        d = mesh.dim()
        mf = gf.MeshFem(mesh, d)
        mf.set_classical_fem(1)
        mim = gf.MeshIm(mesh, 4)
        md.add_fem_variable(f"u{k}", mf)
        md.add_initialized_data(f"law{k}", [body["lame"], body["shear"]])
        md.add_finite_strain_elasticity_brick(mim, "Compressible Neo Hookean Bonet", f"u{k}",
                                              f"law{k}")
        md.add_initialized_fem_data(f"w{k}", mf, np.zeros(mf.nbdof()))
        at = np.array(body["points"])
        places = mf.basic_dof_nodes()[:, ::d].T  # of every node of mf
        apart = np.abs(at[:, None] - places).sum(axis=2)
        parts.append((mesh, numbers, mf, mim, apart.argmin(axis=1), apart.argmin(axis=0)))
    for i, (k, nodes, components) in enumerate(given["supports"]):
        mesh, numbers, mf, mim, *_ = parts[k]
        region(mesh, numbers, HELD + i, nodes)
        for c in components:
            md.add_linear_term(mim, f"{1e6 * softest}*u{k}({c + 1})*Test_u{k}({c + 1})",
                               HELD + i)
    k, nodes, ways = given["driven"]
    nodes, ways = np.array(nodes), np.array(ways)
    mesh, numbers, mf, mim, mine, _ = parts[k]
    d = mesh.dim()
    region(mesh, numbers, DRIVEN, nodes.tolist())
    slots = mine[nodes][:, None] * d + np.arange(d)
    md.add_initialized_fem_data("way", mf, np.zeros(mf.nbdof()))
    held = md.add_Dirichlet_condition_with_multipliers(mim, f"u{k}", 1, DRIVEN, "way")
    reaction, driven = md.mult_varname_Dirichlet(held), k
    md.add_initialized_data("r", given["augmentation"] * softest)
    md.add_initialized_data("mu", given["mu"])
    md.add_initialized_data("alpha", 1.0)
    brick = md.add_integral_large_sliding_contact_brick_raytracing(
        "r", given["release"], "mu", "alpha", 0)  # fmt: skip
    (k, facets), (other, theirs) = given["sides"]
    mesh, numbers, _, mim, *_ = parts[k]
    region(mesh, numbers, SLAVE, np.unique(facets).tolist(), facets)
    stress = gf.MeshFem(mesh, d)
    stress.set_classical_fem(1)
    md.add_filtered_fem_variable("lambda", stress, SLAVE)
    md.add_slave_contact_boundary_to_large_sliding_contact_brick(brick, mim, SLAVE, f"u{k}",
                                                                "lambda", f"w{k}")
    mesh, numbers, _, mim, *_ = parts[other]
    region(mesh, numbers, MASTER, np.unique(theirs).tolist(), theirs)
    md.add_master_contact_boundary_to_large_sliding_contact_brick(brick, mim, MASTER,
                                                                 f"u{other}", f"w{other}")
    out = {"newton": 0, "states": [], "forces": [], "why": "", "seconds": 0.0}
    began = time.process_time()
    for way in ways[1:]:
        held = np.zeros(len(md.variable("way")))
        held[slots] = way
        md.set_variable("way", held)
        try:
            count = md.solve("very noisy", "max_iter", 60,
                             "max_res", 1e-8, "lsearch", "simplest")
        except Exception as error:
            out["why"] = str(error)[:200]
            break
        out["newton"] += count[0] if isinstance(count, (tuple, list)) else int(count)
        mesh, _, mf, mim, *_ = parts[driven]
        turned = f"(X(1)+u{driven}(1))*{reaction}(2)-(X(2)+u{driven}(2))*{reaction}(1)"
        out["forces"].append([
            float(gf.asm_generic(mim, 0, what, DRIVEN, md))
            for what in (f"{reaction}(1)", f"{reaction}({d})", turned)
        ])
        states = [md.variable(f"u{k}").reshape(-1, d)[part[4]] for k, part in enumerate(parts)]
        out["states"].append([state.tolist() for state in states])
        for k in range(len(parts)):
            md.set_variable(f"w{k}", md.variable(f"u{k}"))
        out["seconds"] = time.process_time() - began
        json.dump(out, open(target, "w"))
        if out["seconds"] > given["limit"]:
            break
    out["seconds"] = time.process_time() - began
    json.dump(out, open(target, "w"))


main(sys.argv[1], sys.argv[2])
