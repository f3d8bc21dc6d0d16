"""Modes, flutter and divergence against closed forms."""

import numpy as np
import pytest
from scipy import sparse

import amontons as am
from amontons.analysis.stability import coalescence
from amontons.analysis.stability import modes as module
from amontons.analysis.stability.coalescence import flutter_points
from amontons.analysis.stability.sliding import SlidingState

# the minimal model of Hoffmann, Fischer, Allgaier, Gaul (2002): a mass on a belt, held by two
# inclined springs; the third one is that of its contact
K1, ANGLE_1, K2, ANGLE_2, K3 = 11.0, np.radians(150), 20.0, np.radians(35), 11.0
K11, K12, K22 = (
    K1 * f(ANGLE_1) * g(ANGLE_1) + K2 * f(ANGLE_2) * g(ANGLE_2)
    for f, g in ((np.cos, np.cos), (np.cos, np.sin), (np.sin, np.sin))
)
FLUTTER = (K12 + (K11 - K22 - K3) ** 2 / (4 * K12)) / K3


def on_a_belt(mu, damping=None):
    """x along the belt, y away from it, pressed by 5; the belt runs so that K12 - mu K3."""
    law = am.Compliant(am.Coulomb([mu]), [1 / K3])
    problem = am.FrictionProblem.from_global(
        np.array([[K11, K12], [K12, K22]]), np.array([[0.0, 1.0], [1.0, 0.0]]), [0.0, -5.0],
        [[0.0, 1e3]], law,
    )  # fmt: skip
    found = am.solve(problem, tolerance=1e-12)
    return am.modes(found, mass=sparse.eye_array(2), damping=damping)


@pytest.mark.parametrize("mu", [0.1, 0.4, 0.44, 0.9])
def test_the_model_of_mode_coupling(mu):
    stiffness = np.array([[K11, K12 - mu * K3], [K12, K22 + K3]])
    square = -np.linalg.eigvals(stiffness).astype(complex)
    wanted = np.sqrt(square)
    wanted = np.concatenate([wanted, -wanted])
    wanted = wanted[wanted.imag > 0]
    found = on_a_belt(mu)
    far = [np.abs(wanted - s).min() for s in found.s]
    assert max(far) <= 1e-8 * np.abs(wanted).max()
    assert found.stable == (mu < FLUTTER)


def test_its_flutter_friction():
    points = on_a_belt(0.2).flutter()
    assert len(points) == 1
    assert points[0].mu == pytest.approx(FLUTTER, rel=1e-10)
    meets = np.sqrt((K11 + K22 + K3) / 2) / (2 * np.pi)
    assert points[0].frequency == pytest.approx(meets, rel=1e-10)


def test_its_divergence():
    """det = K11 (K22 + K3) - K12 (K12 - mu K3) = 0 has a negative root, the other way none."""
    assert not (on_a_belt(0.2).divergence > 0).any() or on_a_belt(0.2).divergence.min() > 0
    root = (K12**2 - K11 * (K22 + K3)) / (K12 * K3)
    found = on_a_belt(0.2).divergence
    assert (found == pytest.approx([root])) if root > 0 else not len(found)


@pytest.mark.parametrize("seed", [2, 10])
def test_the_first_flutter_friction_where_three_modes_take_part(seed):
    """Three contacts that give way: against the first friction at which s^2 is complex."""
    rng = np.random.default_rng(seed)
    A, B = rng.normal(size=(2, 6, 6))
    K, M = A @ A.T + 0.3 * np.eye(6), np.eye(6) + 0.1 * B @ B.T
    H, soft = np.linalg.qr(rng.normal(size=(6, 6)))[0], rng.uniform(0.02, 0.5, 3)
    slip = np.array([[0.0, 1e3], [0.0, -1e3], [0.0, 1e3]])
    problem = am.FrictionProblem.from_global(
        K, H, -5 * H[:, ::2].sum(axis=1), slip, am.Compliant(am.Coulomb([0.05] * 3), soft)
    )
    found = am.modes(am.solve(problem, tolerance=1e-12), 6, mass=M)
    against = H[:, 1::2] * -np.sign(slip[:, 1])

    def grows(mu):
        forces = (H[:, ::2] + mu * against) / soft
        squares = np.linalg.eigvals(np.linalg.solve(M, K + forces @ H[:, ::2].T))
        return (np.abs(squares.imag) > 1e-7 * np.abs(squares).max()).any()

    frictions = np.linspace(0.0, 5.0, 1001)
    first = next(k for k, mu in enumerate(frictions) if grows(mu))
    low, high = frictions[first - 1], frictions[first]
    for _ in range(30):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if grows(middle) else (middle, high)
    assert found.flutter()[0].mu == pytest.approx(high, rel=1e-6)


SEEDS = [(2, 8, 3), (3, 8, 3), (5, 8, 3)]


def held_obliquely(seed, size, contacts):
    """Rigid contacts whose friction changes what presses them."""
    rng = np.random.default_rng(seed)
    A, B = rng.normal(size=(2, size, size))
    Q = np.linalg.qr(rng.normal(size=(size, size)))[0]
    N = sparse.csc_array(Q[:, :contacts])
    along = Q[:, contacts : 2 * contacts] * rng.choice([-1, 1], contacts)
    along += 0.5 * rng.normal(size=along.shape) / np.sqrt(size)
    return SlidingState(
        sparse.csc_array(np.eye(size) + 0.1 * B @ B.T), None,
        sparse.csc_array(A @ A.T + 0.3 * np.eye(size)), N, sparse.csc_array(-0.05 * along),
        sparse.csr_array(N.T), sparse.csc_array((contacts, contacts)), 0.05, contacts,
    )  # fmt: skip


def squares(state, mu):
    """s^2 of all modes at a friction."""
    K, _, M, _ = module.projected(state, mu / state.mu)
    return -np.linalg.eigvals(np.linalg.solve(M, K))


@pytest.mark.parametrize(("seed", "size", "contacts"), SEEDS)
def test_no_point_of_flutter_is_missed(seed, size, contacts):
    """Rigid contacts: friction changes the pressure also where no mode moves."""
    state = held_obliquely(seed, size, contacts)

    def growing(mu):
        found = squares(state, mu)
        return int((found.imag > 1e-7 * np.abs(found)).sum())

    frictions = np.geomspace(0.02, 3.0, 400)
    counts = [growing(mu) for mu in frictions]
    wanted = []
    for k in np.flatnonzero(np.diff(counts) > 0):
        low, high = frictions[k], frictions[k + 1]
        for _ in range(40):
            middle = 0.5 * (low + high)
            low, high = (low, middle) if growing(middle) > counts[k] else (middle, high)
        found = squares(state, high)
        pair = found[found.imag > 1e-7 * np.abs(found)]
        if pair[np.argmin(pair.imag / np.abs(pair))].real < 0:
            wanted.append(high)
    told = flutter_points(state, 6, 20)
    assert wanted
    for mu in wanted:
        assert min(abs(point.mu / mu - 1) for point in told) < 1e-6
    assert not told.warnings


def test_points_that_are_not_found_are_told(monkeypatch):
    monkeypatch.setattr(coalescence, "_newton", lambda *_: None)
    found = on_a_belt(0.2).flutter()
    assert not found
    assert [doubt.name for doubt in found.warnings] == ["flutter-not-found"]
    assert f"near friction {FLUTTER:.4g}" in found.warnings[0].message


def test_damping_by_hand():
    """C = a M shifts all s by -a / 2: s^2 + a s + w^2 = 0."""
    plain, damped = on_a_belt(0.1), on_a_belt(0.1, 0.2 * np.eye(2))
    wanted = -0.1 + 1j * np.sqrt(plain.s.imag**2 - 0.01)
    assert damped.s == pytest.approx(wanted, rel=1e-9)


def beam(elements):
    """Euler and Bernoulli's beam of length 1, EI = 1, mass 1: w and its slope at every node.

    Both ends lie on sliding supports: contacts along w, pressed down, free to slide.
    """
    h = 1 / elements
    k = np.array([[12, 6 * h, -12, 6 * h], [6 * h, 4 * h * h, -6 * h, 2 * h * h],
                  [-12, -6 * h, 12, -6 * h], [6 * h, 2 * h * h, -6 * h, 4 * h * h]]) / h**3
    m = np.array([[156, 22 * h, 54, -13 * h], [22 * h, 4 * h * h, 13 * h, -3 * h * h],
                  [54, 13 * h, 156, -22 * h], [-13 * h, -3 * h * h, -22 * h, 4 * h * h]])
    m *= h / 420
    n = 2 * (elements + 1)
    K, M = np.zeros((n + 1, n + 1)), np.zeros((n + 1, n + 1))
    for e in range(elements):
        part = slice(2 * e, 2 * e + 4)
        K[part, part] += k
        M[part, part] += m
    K[n, n], M[n, n] = 1e6, 1.0  # along the beam, which is stiff that way
    H = np.zeros((n + 1, 4))
    H[0, 0] = H[n - 2, 2] = 1.0
    H[n, 1] = H[n, 3] = 1.0
    f = np.zeros(n + 1)
    f[0] = f[n - 2] = -1.0
    return K, M, H, f


@pytest.mark.parametrize("dense", [True, False])
def test_a_beam_on_sliding_supports(dense, monkeypatch):
    """(k pi)^2 sqrt(EI / m L^4): both ends can not move, and turn as they like."""
    K, M, H, f = beam(60)
    if not dense:
        monkeypatch.setattr(module, "DENSE", 10)
    problem = am.FrictionProblem.from_global(K, H, f, [[0.0, 1.0], [0.0, 1.0]], [0.3, 0.3])
    found = am.modes(am.solve(problem), 2, mass=sparse.csc_array(M))
    wanted = np.pi**2 * np.array([1.0, 4.0])
    assert found.s.imag[0] == pytest.approx(wanted[0], rel=1e-8)
    assert found.s.imag[1] == pytest.approx(wanted[1], rel=2e-7)  # of the elements
    assert found.stable


def block(mu, cells=(8, 4), young=200.0, density=1.0):
    body = am.Body(am.box((1, 0.5), cells=cells), am.LinearElastic(young, 0.3, density=density))
    return am.Model(
        [body], [am.Fix("top", (0, -0.01))], [am.Contact("bottom", am.Plane((0, 1)), mu=mu)]
    )


def test_flutter_of_a_body_begins_where_it_is_told():
    """A hair before it no mode near grows, a hair beyond one does."""
    from dataclasses import replace

    modes = am.modes(block(0.5, (4, 2)), 6, velocity=(1, 0))
    for point in modes.flutter(2):
        growth = []
        for p in (point.mu * (1 - 1e-6) / 0.5, point.mu * (1 + 1e-6) / 0.5):
            state = replace(modes.state, F_1=p * modes.state.F_1)
            near = module.modes_of(state, 2, point.frequency)
            growth.append(float(near.s.real.max()))
        assert growth[0] < 1e-6 * point.frequency < growth[1]


def test_sparse_modes_are_those_of_dense_ones(monkeypatch):
    """In units in which a stiffness is 1e11, constraints once gave modes of their own."""
    for damping, near, units in ((0.0, 0.0, {}), (1e-3, 0.0, {}), (1e-3, 15.0, {}),
                                 (1e-7, 6000.0, {"young": 200e9, "density": 7850.0})):
        given = {"near": near, "velocity": (1, 0), "stiffness_damping": damping}
        model = block(0.5, **units)
        whole = am.modes(model, 6, **given)
        monkeypatch.setattr(module, "DENSE", 10)
        some = am.modes(model, 6, **given)
        monkeypatch.undo()
        assert some.s == pytest.approx(whole.s, rel=1e-8)


def test_which_of_several_solutions_is_stable():
    """One contact with three solutions: the one that slides between is not."""
    W = np.array([[1.0, 0.8], [0.8, 1.0]])
    K = np.linalg.inv(W)
    q = np.array([0.2, 1.0])
    problem = am.FrictionProblem.from_global(K, np.eye(2), K @ q, [[0.0, 0.0]], [2.0])
    stable = {}
    for r in ([0, 0], [5 / 3, -7 / 3], [1 / 3, -2 / 3]):
        found = am.solve(problem, start=am.Iterate(np.array([r], dtype=float)))
        assert found.r == pytest.approx(np.array([r]), abs=1e-8)
        if found.pattern != "s":  # sticking with two unknowns leaves nothing to move
            stable[found.pattern] = am.modes(found, 2, mass=np.eye(2)).stable
    assert stable == {"f": True, "-": False}


def test_what_has_no_modes_is_refused():
    problem = am.FrictionProblem.from_delassus(np.eye(2), [[-1.0, 0.0]], [0.3])
    with pytest.raises(am.UnsupportedForm, match="Delassus form"):
        am.modes(am.solve(problem), mass=np.eye(2))
    with pytest.raises(am.InvalidInput, match="mass"):
        am.modes(am.solve(problem))
    found = am.solve(
        am.FrictionProblem.from_global(np.eye(3), np.eye(3)[:, :2], [0, 1, 0], [[0, 0]], [0.3])
    )
    for name, wrong in (
        ("mass", np.eye(2)), ("mass", np.full((3, 3), np.nan)), ("mass", -np.eye(3)),
        ("mass", np.triu(np.ones((3, 3)))), ("damping", np.eye(2)), ("count", 1.5),
        ("near", "a"), ("mass_damping", np.nan), ("velocity", (1, 0)),
    ):  # fmt: skip
        with pytest.raises(am.InvalidInput, match=f"{name}.*: expected"):
            am.modes(found, **{"mass": np.eye(3), name: wrong})
    with pytest.raises(am.InvalidInput, match="expected a model or a solution"):
        am.modes(3)
    with pytest.raises(am.InvalidInput, match="along the surface"):
        am.modes(block(0.3), velocity=(0, 1))
    with pytest.raises(am.InvalidInput, match="density"):
        am.modes(am.Model([am.Body(am.box((1, 1), 1), am.LinearElastic(1, 0.3))],
                          [am.Fix("top", 0)]))  # fmt: skip


def test_flutter_says_up_to_which_frequency_it_looked():
    """Models of two by two side by side: i times as fast; the last meet above what is kept."""
    n = 220
    squares = np.arange(1.0, n + 1) ** 2
    K = sparse.kron(sparse.diags_array(squares), [[K11, K12], [K12, K22]], format="csc")
    H = sparse.kron(sparse.eye_array(n), [[0.0, 1.0], [1.0, 0.0]], format="csc")
    load = np.kron(squares, [0.0, -5.0])
    law = am.Compliant(am.Coulomb([0.2] * n), list(1 / (K3 * squares)))
    problem = am.FrictionProblem.from_global(K, H, load, [[0.0, 1e3]] * n, law)
    found = am.modes(am.solve(problem, tolerance=1e-12), 6, mass=sparse.eye_array(2 * n))
    points = found.flutter(n)
    meets = np.sqrt(squares * (K11 + K22 + K3) / 2) / (2 * np.pi)
    inside = meets[meets <= points.up_to]
    assert 0 < len(inside) < 20
    assert sorted(p.frequency for p in points) == pytest.approx(list(inside), rel=1e-8)
    assert [p.mu for p in points] == pytest.approx([FLUTTER] * len(inside), rel=1e-8)
    assert on_a_belt(0.2).flutter().up_to == np.inf
