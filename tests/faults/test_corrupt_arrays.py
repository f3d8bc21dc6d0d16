"""Arrays that are no arrays of numbers, and sparse ones whose indices lead astray."""

import copy
import datetime
from contextlib import suppress

import numpy as np
import pytest
from scipy import sparse

import amontons as am
from amontons.core.arrays import compressed
from amontons.mechanics.meshes import Cells, Facets

W = np.eye(4) + 0.1
Q = -np.ones((2, 2))
MU = [0.3, 0.3]
CORNERS = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])


def delassus(matrix=W, q=Q, mu=MU):
    return am.FrictionProblem.from_delassus(matrix, q, mu)


def in_velocities(**changed):
    given = {"M": 2 * np.eye(6), "H": np.eye(6)[:, :4], "f": -np.ones(6), "w": np.zeros((2, 2))}
    return am.FrictionProblem.from_global(**{**given, "mu": MU, **changed})


def csr(**changed):
    matrix = sparse.csr_array(np.eye(4))
    for name, values in changed.items():
        setattr(matrix, name, np.array(values))
    return matrix


def coo():
    matrix = sparse.coo_array(np.eye(4))
    matrix.coords[0][0] = 99
    return matrix


def lil(columns, values=(1.0,)):
    matrix = sparse.lil_array(np.eye(4))
    matrix.rows[0], matrix.data[0] = list(columns), list(values)
    return matrix


def bsr():
    matrix = sparse.bsr_array(np.eye(4), blocksize=(2, 2))
    matrix.indices[0] = 9
    return matrix


CORRUPT = {
    "index above": (csr(indices=[99, 1, 2, 3]), r"indices\[0\]: expected a column from 0 to 3"),
    "index below": (csr(indices=[-5, 1, 2, 3]), r"indices\[0\].*got -5"),
    "index huge": (csr(indices=[0, 2**31 - 1, 2, 3]), r"indices\[1\].*got 2147483647"),
    "starts fall": (csr(indptr=[0, 1, 1000, 3, 4]), r"indptr\[3\].*never fall"),
    "starts after 0": (csr(indptr=[1, 1, 2, 3, 4]), r"indptr\[0\].*begin with 0"),
    "end beyond": (csr(indptr=[0, 1, 2, 3, 10**6]), "expected 1000000 indices and values"),
    "too few starts": (csr(indptr=[0, 1]), "expected 5 starts"),
    "too few values": (csr(data=[1.0]), "expected 4 indices and values"),
    "float indices": (csr(indices=[0.0, 1, 2, 3]), "expected a list of whole numbers"),
    "texts": (csr(data=["1", "1", "1", "1"]), "expected numbers, got texts"),
    "truth values": (sparse.csr_array(np.eye(4, dtype=bool)), "got truth values"),
    "complex": (sparse.csr_array(np.eye(4) * 1j), "got complex"),
    "triplets": (coo(), "expected a row from 0 to 3, got 99"),
    "lists": (lil([77]), "not a valid sparse matrix"),
    "lists of other lengths": (lil([0], [1.0, 2.0, 3.0]), "as many columns as values"),
    "blocks": (bsr(), "expected a column of blocks from 0 to 1, got 9"),
    "a vector": (sparse.coo_array(np.ones(4)), "expected a matrix"),
}


@pytest.mark.parametrize("name", CORRUPT)
def test_corrupt_sparse_arrays_are_named(name):
    matrix, message = CORRUPT[name]
    with pytest.raises(am.InvalidInput, match=message):
        delassus(copy.deepcopy(matrix))


@pytest.mark.parametrize("argument", ["M", "H", "levels"])
def test_every_sparse_argument_is_checked(argument):
    shapes = {"M": (6, 6), "H": (6, 4), "levels": (6, 2)}
    matrix = sparse.csr_array(np.eye(*shapes[argument]))
    matrix.indices[0] = 99
    given = {argument: [matrix] if argument == "levels" else matrix}
    with pytest.raises(am.InvalidInput, match=argument):
        in_velocities(**given)


@pytest.mark.parametrize("kind", ["bsr", "coo", "csc", "csr", "dia", "dok", "lil"])
@pytest.mark.parametrize("flavour", ["array", "matrix"])
def test_every_format_is_taken_and_left_alone(kind, flavour):
    matrix = getattr(sparse, f"{kind}_{flavour}")(W)
    before = copy.deepcopy(matrix)
    problem = delassus(matrix)
    assert problem.W.toarray() == pytest.approx(W)
    assert (matrix != before).nnz == 0
    arrays = [part for part in vars(matrix).values() if isinstance(part, np.ndarray)]
    assert all(part.flags.writeable for part in arrays)


def test_levels_are_copied_unless_nobody_can_change_them():
    level = sparse.csr_array(np.eye(6, 2))
    kept = in_velocities(levels=[level]).levels
    assert level.data.flags.writeable
    assert in_velocities(levels=kept).levels[0] is kept[0]


def test_what_is_stored_by_rows_is_checked_without_a_copy():
    matrix = sparse.csr_array(W)
    assert compressed("W", matrix) is matrix


NO_NUMBERS = {
    "texts": np.array([["1", "2"], ["3", "4"]]),
    "bytes": np.array([[b"1", b"2"], [b"3", b"4"]]),
    "dates": Q.astype("datetime64[s]"),
    "lengths of time": Q.astype("timedelta64[s]"),
    "truth values": np.ones((2, 2), dtype=bool),
    "complex": Q + 0j,
    "masked": np.ma.masked_array(Q, mask=[[1, 0], [0, 0]]),
    "'1'": np.array([["1", 2.0], [3.0, 4.0]], dtype=object),
    "None": np.array([[None, 2.0], [3.0, 4.0]], dtype=object),
    "date": np.array([[datetime.date(2000, 1, 1), 2.0], [3.0, 4.0]], dtype=object),
    "too large": [[10**400, 2.0], [3.0, 4.0]],
    "inhomogeneous": [[1.0], [2.0, 3.0]],
    "type": np.zeros((2, 2), dtype=[("a", "f8")]),
    "sparse": sparse.csr_array(Q),
}


class Start:
    def __init__(self, r, v=None):
        self.r, self.v = r, v


@pytest.mark.parametrize("word", NO_NUMBERS)
def test_arrays_that_are_no_numbers_are_named(word):
    values = NO_NUMBERS[word]
    problem = delassus()
    for use in (
        lambda: delassus(q=values),
        lambda: delassus(mu=values),
        lambda: am.Tresca(values),
        lambda: problem.with_load(values),
        lambda: problem.with_mu(values),
        lambda: am.solve(problem, start=Start(values)),
        lambda: am.solve(in_velocities(), start=Start(np.zeros((2, 2)), values)),
        lambda: in_velocities(near_nullspace=values),
        lambda: in_velocities(guess=values),
        lambda: am.State(0, 0.0, values, np.zeros(4), np.zeros((1, 2)), np.zeros((1, 1))),
        lambda: am.Mesh(values, (Cells("tri", [[0, 1, 2]]),)),
        lambda: am.Mesh(CORNERS, (Cells("tri", values),)),
        lambda: am.box(values, 2),
        lambda: am.Plane(values),
        lambda: am.performance_profile(values),
    ):
        with pytest.raises(am.InvalidInput, match=word):
            use()


def test_numbers_of_any_type_are_taken():
    for values in (Q.astype(np.float32), Q.astype(int), np.longdouble(Q), Q.astype(object),
                   np.ma.masked_array(Q), Q.tolist(), np.asfortranarray(Q)):  # fmt: skip
        assert delassus(q=values).q == pytest.approx(Q)


@pytest.mark.parametrize("name", ["load_scale", "u_scale"])
@pytest.mark.parametrize("value", ["1", np.nan, np.inf, -1.0, 1e300, None, [1.0], True])
def test_sizes_are_numbers(name, value):
    if value is None:
        assert getattr(in_velocities(**{name: value}), name) is None
        return
    with pytest.raises(am.InvalidInput, match=name):
        in_velocities(**{name: value})


@pytest.mark.parametrize("contacts", [[99], [-1], [0.5], [1, 0], [[0]], ["0"]])
def test_a_part_takes_contacts_that_there_are(contacts):
    with pytest.raises(am.InvalidInput, match="contacts"):
        delassus().restricted(np.array(contacts))


@pytest.mark.parametrize("mu", [1e101, 1e300])
def test_friction_whose_square_is_no_number_is_refused(mu):
    for make in (lambda: delassus(mu=[mu, 1.0]), lambda: delassus().with_mu(mu),
                 lambda: delassus(mu=am.Tresca([mu, 1.0]))):  # fmt: skip
        with pytest.raises(am.InvalidInput, match="expected at most 1e.100"):
            make()


@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("law", [am.Coulomb, am.Tresca])
def test_no_contacts_are_solved_or_refused_in_words(d, law):
    empty = np.zeros((0, d))
    problem = delassus(np.zeros((0, 0)), empty, law([]))
    whole = in_velocities(H=np.zeros((6, 0)), w=empty, mu=law([]))
    for given in (problem, whole):
        assert am.solve(given).r.shape == (0, d)
        for ask in (am.all_solutions, am.multistart, am.uniqueness, am.critical_friction,
                    am.p_matrix_friction, am.full_contact_friction, am.follow,
                    am.diagram):  # fmt: skip
            with suppress(am.AmontonsError):
                ask(given)


@pytest.mark.parametrize("value", [1e-300, 1e-160, 1e160, 1e300])
def test_sizes_that_can_not_be_squared_end_in_words(value):
    for problem in (
        lambda: delassus(W * value),
        lambda: delassus(q=Q * value),
        lambda: delassus(np.diag([1.0, 1.0, value, value])),
        lambda: delassus(q=np.array([[-1.0, 1.0], [-value, value]])),
        lambda: in_velocities(M=np.eye(6) * value),
        lambda: in_velocities(f=np.full(6, value)),
    ):
        try:
            found = am.solve(problem(), time_limit=5.0)
        except am.AmontonsError:
            continue
        assert np.isfinite(found.r).all()


BAD_MESHES = {
    "no table": (lambda: am.Mesh(CORNERS, (Cells("tri", 3),)), "table of nodes"),
    "fractions": (lambda: am.Mesh(CORNERS, (Cells("tri", [[0, 1, 1.5]]),)), "whole numbers"),
    "huge nodes": (lambda: am.Mesh(CORNERS, (Cells("tri", [[0, 1, 1e300]]),)), "whole numbers"),
    "no blocks": (lambda: am.Mesh(CORNERS, [[0, 1, 2]]), "blocks of Cells"),
    "no names": (lambda: am.Mesh(CORNERS, (Cells("tri", [[0, 1, 2]]),), [1]), "name -> facets"),
    "texts in a surface": (
        lambda: am.Mesh(CORNERS, (Cells("tri", [[0, 1, 2]]),),
                        {"a": (Facets("line", [["0", "1"]]),)}), "surface 'a'.*texts",
    ),
    "far too large": (
        lambda: am.Mesh(1e300 * CORNERS, (Cells("tri", [[0, 1, 2]]),)), "points.*squared",
    ),
    "far too small": (
        lambda: am.Mesh(1e-300 * CORNERS, (Cells("tri", [[0, 1, 2]]),)), "points.*squared",
    ),
    "too many cells": (lambda: am.box((1, 1), 1e9), "expected at most"),
    "no end of cells": (lambda: am.box((1, 1), np.inf), "expected one whole number"),
    "refined forever": (lambda: am.refined(am.box((1, 1), 1), 10**9), "expected at most"),
    "no function": (lambda: am.Contact("a", am.Plane((0, 1)), mu=0.1, where=3), "where"),
}  # fmt: skip


@pytest.mark.parametrize("name", BAD_MESHES)
def test_bad_meshes_are_refused_in_words(name):
    make, message = BAD_MESHES[name]
    with pytest.raises(am.InvalidInput, match=message):
        make()


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("power", [-300, -150, -120, -99, -60, -12, 12, 60, 99, 120, 150, 300])
def test_lengths_of_any_unit_are_solved_or_refused(dim, power):
    size = 10.0**power
    try:
        body = am.Body(am.box([size] * dim, 2), am.LinearElastic(100.0, 0.3))
        normal = [0] * (dim - 1) + [1]
        model = am.Model(
            [body], [am.Fix("top", [0.0] * (dim - 1) + [-0.01 * size])],
            [am.Contact("bottom", am.Plane(normal), mu=0.3)],
        )  # fmt: skip
        found = am.solve(model)
    except am.AmontonsError:
        solved = False
    else:
        solved = bool(np.isfinite(found.pressure).all() and found.pressure.max() > 0)
    assert solved or abs(power) > 20
    assert not solved or abs(power) < 100
