"""Hild's triangle: the published matrix, the exact fields, and listed solutions on any mesh."""

import json

import numpy as np
import pytest

import amontons as am
from amontons.app.cli.sources import DATA
from amontons.core.errors import InvalidInput
from amontons.io.case import read_case
from amontons.mechanics.ready.hild import (
    free_displacement,
    hild_triangle,
    mesh_of_triangle,
    stick_displacement,
    triangle_mesh,
)


def sorted_contacts(mesh):
    """Places of the contacts in order of increasing x, and their x."""
    x = mesh.points[mesh.surface_nodes("AB"), 0]
    x = x[x < 1 - 1e-9]  # B is held
    return np.argsort(x), np.sort(x)


def nodal_values(model, v):
    """Displacement (k, 2) of all nodes from the unknowns v."""
    parts = model.discretisation
    values = np.array(parts.prescribed)
    values[parts.free] = v
    return values.reshape(-1, 2)


def test_one_triangle_has_the_published_matrix():
    problem = hild_triangle(1).assemble().condensed()
    # [Rey] section 5.2, their order (T, N) and the sign of their normal change nothing here
    assert problem.W.toarray() == pytest.approx(np.array([[6.6, -3], [-3, 6.6]]))
    assert problem.q == pytest.approx(np.array([[1.0, -7.0]]))


@pytest.mark.parametrize("n", [1, 2, 5])
@pytest.mark.parametrize("delta", [1.0, 0.25])
def test_free_and_stick_fields_are_exact(n, delta):
    model = hild_triangle(n, mu=3.0 + 1e-9, delta=delta)
    problem = model.assemble()
    points = model.bodies[0].mesh.points
    u, v = problem.velocity(np.zeros((n, 2)))
    assert u[:, 0].min() > 0
    assert nodal_values(model, v) == pytest.approx(delta * free_displacement(points))
    local = problem.condensed()
    r = np.linalg.solve(local.W.toarray(), -local.q.ravel()).reshape(n, 2)
    assert r[:, 1] == pytest.approx(3 * r[:, 0])
    assert problem.error(r) < 1e-8
    assert problem.with_mu(2.99).error(r) > 1e-4
    assert nodal_values(model, problem.velocity(r)[1]) == pytest.approx(
        delta * stick_displacement(points)
    )


def test_case_file_is_the_structured_triangle():
    case = read_case(DATA / "hild.toml", ["mesh.refine=2"]).model.assemble().condensed()
    own = hild_triangle(4).assemble().condensed()
    assert case.mu == pytest.approx(own.mu)
    assert np.sort(case.q, axis=0) == pytest.approx(np.sort(own.q, axis=0))
    assert np.linalg.eigvalsh(case.W.toarray()) == pytest.approx(
        np.linalg.eigvalsh(own.W.toarray())
    )


def test_listed_solutions_solve_our_problem_on_every_mesh(shared):
    data = json.loads((shared / "reference" / "rey" / "enumeration.json").read_text())
    for family, meshes in data["families"].items():
        for n, listed in meshes.items():
            mesh = mesh_of_triangle(listed["nodes"], listed["triangles"])
            if family.startswith("structured"):
                assert triangle_mesh(int(n)).points == pytest.approx(mesh.points)
            problem = hild_triangle(mesh).assemble()
            order, x = sorted_contacts(mesh)
            assert x == pytest.approx(listed["x"])
            for mu, solutions in listed["solutions"].items():
                for solution in solutions:
                    r = np.empty((int(n), 2))
                    r[order] = np.reshape(solution["r"], (-1, 2))[:, ::-1]
                    assert problem.with_mu(float(mu)).error(r) < 1e-8


def test_all_listed_solutions_are_found_and_no_other(shared):
    data = json.loads((shared / "reference" / "rey" / "enumeration.json").read_text())
    for meshes in data["families"].values():
        for listed in meshes.values():
            mesh = mesh_of_triangle(listed["nodes"], listed["triangles"])
            problem = hild_triangle(mesh).assemble().condensed()
            order, _ = sorted_contacts(mesh)
            for mu, solutions in listed["solutions"].items():
                found = am.all_solutions(problem.with_mu(float(mu)))
                assert found.complete
                words = {"".join(np.array(list(s.pattern))[order]) for s in found.solutions}
                assert words == {s["word"] for s in solutions}
                by_word = {s["word"]: np.reshape(s["r"], (-1, 2)) for s in solutions}
                for s in found.solutions:
                    word = "".join(np.array(list(s.pattern))[order])
                    assert s.r[order, ::-1] == pytest.approx(by_word[word], abs=1e-8)


def test_counts_over_friction_are_those_listed(shared):
    data = json.loads((shared / "reference" / "rey" / "enumeration.json").read_text())
    for meshes in data["families"].values():
        for listed in meshes.values():
            mesh = mesh_of_triangle(listed["nodes"], listed["triangles"])
            problem = hild_triangle(mesh).assemble().condensed()
            for first, last, count in listed["runs_mu_from_to_count"]:
                for mu in {first, last}:
                    found = am.all_solutions(problem.with_mu(mu))
                    assert (len(found), found.complete) == (count, True), (mesh, mu)


@pytest.mark.parametrize(("n", "mu", "count"), [(10, 3.5, 3), (10, 4.8, 3), (15, 3.5, 3)])
def test_larger_triangles_are_finished_with_proof(n, mu, count):
    found = am.all_solutions(hild_triangle(n, mu=mu))
    assert found.complete
    assert len(found) == count
    assert sum(s.orientation for s in found.solutions) == 1


def test_bad_input_is_refused():
    with pytest.raises(InvalidInput, match="n: expected a whole number >= 1, got 0"):
        triangle_mesh(0)
    with pytest.raises(InvalidInput, match="delta: .* got 2"):
        hild_triangle(2, delta=2)
    with pytest.raises(InvalidInput, match="a mesh of the triangle"):
        mesh_of_triangle([[0, 0], [1, 0], [0, 1]], [[0, 1, 2]])
