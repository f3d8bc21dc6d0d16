"""A case of `large_sliding` with GetFEM's large sliding contact brick (ray tracing, 2D).

    /usr/bin/python3 benchmarks/large_sliding_getfem.py case.json out.json

Run with an interpreter that has GetFEM.  case.json: points and quadrilaterals of both bodies
(counterclockwise), Lame constants, displacements of the top by load step, mu.  The contact
stress is of first order on the slave; r = 10 times the softer modulus, as its manual advises a
number near the modulus.
"""

import json
import sys
import time

import getfem as gf
import numpy as np

HELD, SIDE = 1, 2


def mesh_of(points, cells, held, side):
    """A mesh with regions HELD and SIDE; held, side: numbers of nodes."""
    mesh = gf.Mesh("empty", 2)
    where = mesh.add_point(np.array(points).T)
    numbers = {int(k): i for i, k in enumerate(where)}
    transform = gf.GeoTrans("GT_QK(2,1)")
    for cell in cells:
        mesh.add_convex(transform, np.array(points)[[cell[0], cell[1], cell[3], cell[2]]].T)
    outer = mesh.outer_faces()
    for region, nodes in ((HELD, set(held)), (SIDE, set(side))):
        faces = []
        for cell, face in outer.T:
            ends = mesh.pid_in_faces(np.array([[cell], [face]]))
            if all(numbers.get(int(p), -1) in nodes for p in ends):
                faces.append([cell, face])
        mesh.set_region(region, np.array(faces).T)
    return mesh


def main(source, target):
    """Solve all load steps; stop where one does not converge."""
    case = json.load(open(source))
    md = gf.Model("real")
    parts = []
    softest = min(body["young"] for body in case["bodies"])
    for k, body in enumerate(case["bodies"]):
        mesh = mesh_of(body["points"], body["cells"], body["held"], body["side"])
        mf = gf.MeshFem(mesh, 2)
        mf.set_classical_fem(1)
        mim = gf.MeshIm(mesh, 4)
        md.add_fem_variable(f"u{k}", mf)
        md.add_initialized_data(f"law{k}", [body["lame"], body["shear"]])
        md.add_finite_strain_elasticity_brick(mim, "Compressible Neo Hookean Bonet", f"u{k}",
                                              f"law{k}")
        md.add_initialized_data(f"held{k}", [0.0, 0.0])
        held = md.add_Dirichlet_condition_with_multipliers(mim, f"u{k}", 1, HELD, f"held{k}")
        md.add_initialized_fem_data(f"w{k}", mf, np.zeros(mf.nbdof()))
        parts.append((mesh, mf, mim))
    md.add_initialized_data("r", 10 * softest)
    md.add_initialized_data("mu", case["mu"])
    md.add_initialized_data("alpha", 1.0)
    mesh, _, mim = parts[1]
    stress = gf.MeshFem(mesh, 2)
    stress.set_classical_fem(1)
    md.add_filtered_fem_variable("lambda", stress, SIDE)
    brick = md.add_integral_large_sliding_contact_brick_raytracing(
        "r", case["release"], "mu", "alpha", 0)  # fmt: skip
    md.add_slave_contact_boundary_to_large_sliding_contact_brick(brick, mim, SIDE, "u1",
                                                                "lambda", "w1")
    md.add_master_contact_boundary_to_large_sliding_contact_brick(brick, parts[0][2], SIDE,
                                                                 "u0", "w0")
    reaction = md.mult_varname_Dirichlet(held)
    began, newton, states, forces, why = time.process_time(), 0, [], [], ""
    for top in case["tops"]:
        md.set_variable("held1", top)
        try:
            count = md.solve("very noisy", "max_iter", 60,
                             "max_res", 1e-8, "lsearch", "simplest")
        except Exception as error:
            why = str(error)[:200]
            break
        newton += count[0] if isinstance(count, (tuple, list)) else int(count)
        forces.append([float(gf.asm_generic(parts[1][2], 0, f"{reaction}({c})", HELD, md))
                       for c in (1, 2)])  # fmt: skip
        states.append([md.variable(f"u{k}").tolist() for k in (0, 1)])
        for k in (0, 1):
            md.set_variable(f"w{k}", md.variable(f"u{k}"))
    order = [part[1].basic_dof_nodes()[:, ::2].T.tolist() for part in parts]
    out = {"newton": newton, "states": states, "forces": forces, "why": why, "places": order,
           "seconds": time.process_time() - began}  # fmt: skip
    json.dump(out, open(target, "w"))


main(sys.argv[1], sys.argv[2])
