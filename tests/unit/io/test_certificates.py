"""Certificates as files: accepted where they prove, refused where somebody changed them."""

import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest
from click.testing import CliRunner

import amontons as am
from amontons.app.cli import main
from amontons.core.errors import InvalidInput
from amontons.io import certificate_checker as checker
from amontons.io.certificate_checker.boxes import ARCS, Problem
from amontons.io.certificate_checker.curves import farthest
from amontons.io.certificate_checker.numbers import positive_definite
from amontons.mechanics.ready.hild import hild_triangle


def problem_of(seed, d, friction):
    """A random definite W of three contacts."""
    random = np.random.default_rng(seed)
    n = 3 * d
    A = random.standard_normal((n, n))
    W = A @ A.T / n + 0.1 * np.eye(n)
    q = random.standard_normal((3, d)) - np.eye(d)[0]
    return am.FrictionProblem.from_delassus(W, q, friction * random.uniform(0.5, 1, 3))


def written(tmp_path, problem, name="c.h5"):
    verdict = am.uniqueness(problem, time_limit=30)
    path = tmp_path / name
    return path, am.write_certificate(problem, verdict, path)


@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("seed", range(4))
def test_every_load_is_proved_and_more_friction_is_not(tmp_path, seed, d):
    problem = problem_of(seed, d, 0.05)
    path, claim = written(tmp_path, problem)
    assert claim == "every load"
    assert "every load has exactly one solution" in am.check_certificate(path)
    reseal(path, lambda file: file["mu"].write_direct(file["mu"][()] + 50.0))
    with pytest.raises(InvalidInput, match="definite"):
        am.check_certificate(path)


def test_what_is_no_answer_is_refused(tmp_path):
    with pytest.raises(InvalidInput, match="verdict: expected an answer of"):
        am.write_certificate(hild_triangle(2).assemble(), 3, tmp_path / "c.h5")
    assert not list(tmp_path.iterdir())


def test_one_load_is_proved_also_on_several_branches(tmp_path):
    claims = set()
    for mu, branches in ((2.0, 1), (2.9, 2)):
        path, claim = written(tmp_path, hild_triangle(10).assemble().with_mu(mu))
        claims.add(claim)
        assert "this load" in am.check_certificate(path)
        with h5py.File(path) as file:
            assert len(file["patterns"]) >= branches
    assert claims == {"this load"}


def many_contacts():
    """100 contacts in 2D, above what is safe for every load."""
    return hild_triangle(100).assemble().condensed().with_mu(1.0)


def space_problem():
    """25 contacts of a block that is pressed and dragged: open, slipping and sticking ones."""
    block = am.Body(am.box((1, 1, 1), cells=4), am.LinearElastic(young=200, poisson=0.3))
    return am.Model(
        [block],
        supports=[am.Fix("top", lambda x: (0, 0.2, 0.06 - 0.15 * x[0]))],
        contacts=[am.Contact("bottom", am.Plane(normal=(0, 0, 1)), mu=1.0)],
    ).assemble()  # fmt: skip


def test_one_load_is_proved_by_multipliers_of_every_contact(tmp_path):
    path, claim = written(tmp_path, many_contacts())
    assert claim == "this load"
    assert "every solution of this load" in am.check_certificate(path)
    with h5py.File(path) as file:
        assert "tau" in file


FORGED_CONTACTS = {
    "other solution": lambda file: file["r0"].write_direct(file["r0"][()] * 1.01 + 1e-3),
    "other load": lambda file: flipped(file, "q"),
    "other sides": lambda file: flipped(file, "eta"),
    "nothing pinned": lambda file: file["pinned"].write_direct(0 * file["pinned"][()]),
    "other statuses": lambda file: turned(file, "statuses"),
    "more friction": lambda file: file["mu"].write_direct(file["mu"][()] * 3),
    "a negative number": lambda file: flipped(file, "tau"),
    "no number": lambda file: file["sigma"].write_direct(file["sigma"][()] * np.nan),
}


def test_a_contact_without_friction_has_no_other_side(tmp_path):
    problem = many_contacts()
    mu = np.full(100, 0.5)
    mu[7] = 0.0
    path, _ = written(tmp_path, problem.with_mu(mu))
    am.check_certificate(path)

    def forged(file):
        eta = file["eta"][()]
        eta[7] = 0.3
        file["eta"].write_direct(eta)

    reseal(path, forged)
    with pytest.raises(InvalidInput, match="eta of contact 7"):
        am.check_certificate(path)


@pytest.fixture(scope="module")
def in_space(tmp_path_factory):
    """A file with multipliers of every contact of `space_problem`."""
    path, _ = written(tmp_path_factory.mktemp("certificates"), space_problem())
    return path.read_bytes()


@pytest.mark.parametrize("forgery", FORGED_CONTACTS)
def test_forged_multipliers_of_contacts_are_found(tmp_path, in_space, forgery):
    path = tmp_path / "c.h5"
    path.write_bytes(in_space)
    am.check_certificate(path)
    reseal(path, FORGED_CONTACTS[forgery])
    with pytest.raises(InvalidInput, match="refused"):
        am.check_certificate(path)


def reseal(path, change):
    """Change a file and give it a new hash, as a forger would."""
    with h5py.File(path, "r+") as file:
        change(file)
        file.attrs["sha256"] = np.bytes_(checker.digest(file))


def flipped(file, name):
    values = file[name][()]
    file[name].write_direct(np.ascontiguousarray(-values))


def turned(file, name):
    values = file[name][()]
    file[name].write_direct(np.ascontiguousarray(values[::-1]))


FORGERIES = {
    "other solution": lambda file: file["r0"].write_direct(file["r0"][()] + 1.0),
    "other load": lambda file: flipped(file, "q"),
    "a sign of the multipliers": lambda file: flipped(file, "V0"),
    "W of the other sign": lambda file: flipped(file, "W"),
    "a form left out": lambda file: file["V0"].write_direct(0 * file["V0"][()]),
    "more friction": lambda file: file["mu"].write_direct(file["mu"][()] * 3),
    "another claim": lambda file: file.attrs.modify("claim", np.bytes_("every load")),
    "no number": lambda file: file["W"].write_direct(file["W"][()] * np.nan),
}


@pytest.mark.parametrize("forgery", FORGERIES)
def test_a_forger_who_seals_the_file_again_is_found(tmp_path, forgery):
    path, _ = written(tmp_path, hild_triangle(4).assemble().with_mu(2.5))
    am.check_certificate(path)
    reseal(path, FORGERIES[forgery])
    with pytest.raises(InvalidInput, match="refused"):
        am.check_certificate(path)


def test_forms_about_a_point_outside_of_their_pattern_prove_nothing(tmp_path):
    """Three solutions: forms that only see differences inside of a pattern miss the others."""
    W = np.array([[1.0, 0.8], [0.8, 1.0]])
    q, mu = np.array([[0.1, 0.5]]), np.array([2.0])
    problem = am.FrictionProblem.from_delassus(W, q, mu)
    found = am.all_solutions(problem)
    assert len(found) > 1
    stuck = next(s.r for s in found.solutions if s.pattern == "s")
    forms = {"f": np.zeros((4, 4)), "s": np.diag([0, 0, 1.0, 1.0]),
             "+": np.diag([0, 0, 1.0, 0]), "-": np.diag([0, 0, 1.0, 0])}  # fmt: skip
    data = {"W": W, "q": q, "mu": mu, "r0": stuck, "statuses": np.array([b"s"]),
            "patterns": np.array(list(forms), dtype="S"), "distance": np.array(1e-6),
            **{f"V{k}": V[None] for k, V in enumerate(forms.values())}}  # fmt: skip
    with pytest.raises(checker.Refused, match="r0 is not in"):
        checker.proves("this load", data)


def test_a_pattern_that_is_left_out_is_missed(tmp_path):
    path, _ = written(tmp_path, hild_triangle(4).assemble().with_mu(2.5))

    def lessen(file):
        patterns = file["patterns"][()]
        patterns[0] = patterns[0].replace(b".", b"c", 1)
        file["patterns"].write_direct(patterns)

    reseal(path, lessen)
    with pytest.raises(InvalidInput, match="patterns are missing"):
        am.check_certificate(path)


def test_wrong_bytes_are_found_or_change_nothing(tmp_path):
    path, _ = written(tmp_path, hild_triangle(3).assemble().with_mu(2.0))
    right, random = path.read_bytes(), np.random.default_rng(0)
    with h5py.File(path) as file:
        content = checker.digest(file)
    forged = tmp_path / "forged.h5"
    refused = 0
    for place in random.integers(0, len(right), 150):
        wrong = bytearray(right)
        wrong[place] ^= int(random.integers(1, 256))
        forged.write_bytes(wrong)
        try:
            am.check_certificate(forged)
        except InvalidInput:
            refused += 1
            continue
        with h5py.File(forged) as file:
            assert checker.digest(file) == content
    assert refused > 20


def test_what_is_not_unique_has_no_certificate(tmp_path):
    problem = hild_triangle(3).assemble().with_mu(4.0)
    with pytest.raises(InvalidInput, match="not_unique"):
        am.write_certificate(problem, am.uniqueness(problem), tmp_path / "c.h5")
    assert not (tmp_path / "c.h5").exists()


def test_the_checker_stands_alone(tmp_path):
    """Copied elsewhere it runs with numpy and h5py, and imports nothing of the package."""
    folder = Path(checker.__file__).parent
    alone = shutil.copytree(folder, tmp_path / "checker")
    sources = [path.read_text(encoding="utf-8") for path in alone.glob("*.py")]
    imports = [x for text in sources for x in text.splitlines() if "import" in x]
    assert not any("amontons" in line or "from .." in line for line in imports)
    assert all(len(text.splitlines()) <= 150 for text in sources)
    path, _ = written(tmp_path, problem_of(0, 3, 0.05))
    for name, code in ((path, 0), (alone / "lists.py", 1)):
        ran = subprocess.run([sys.executable, "-E", "-m", "checker", str(name)], check=False,
                             capture_output=True, text=True, cwd=tmp_path)  # fmt: skip
        assert ran.returncode == code
    assert "refused" in ran.stderr


@pytest.mark.parametrize("seed", range(6))
def test_positive_definite_never_errs(seed):
    """Rank one short in rational numbers: not definite, whatever rounding says."""
    random = np.random.default_rng(seed)
    A = random.integers(-4, 5, (6, 5)).astype(float)
    singular = A @ A.T
    nothing = np.zeros((6, 6))
    assert not positive_definite(singular, nothing)
    assert positive_definite(singular + 1e-6 * np.eye(6) * singular.max(), nothing)
    assert not positive_definite(np.eye(6), np.full((6, 6), 0.5))


# ---------------------------------------------------------------- lists and branches in 2D
FORGED_LISTS = {
    "a pattern less": lambda file: turned_letters(file, "patterns"),
    "one that is not left": lambda file: turned_letters(file, "left"),
    "a multiplier": lambda file: file["y"].write_direct(0 * file["y"][()]),
    "another load": lambda file: flipped(file, "q"),
    "another solution": lambda file: file["r"].write_direct(file["r"][()] * 1.01),
    "more friction": lambda file: file["mu"].write_direct(file["mu"][()] * 2),
    "another W": lambda file: flipped(file, "W"),
}


def turned_letters(file, name):
    """The first word with its first free contact stuck, or the other way."""
    words = file[name][()]
    words[0] = bytes(words[0]).translate(bytes.maketrans(b"fs.c", b"sfff"))
    file[name].write_direct(words)


@pytest.fixture(scope="module")
def listed(tmp_path_factory):
    """A file with the five solutions of three contacts."""
    path = tmp_path_factory.mktemp("lists") / "c.h5"
    problem = hild_triangle(3).assemble().with_mu(4.0)
    assert am.write_certificate(problem, am.all_solutions(problem), path) == "all solutions"
    assert "exactly 5" in am.check_certificate(path)
    return path.read_bytes()


@pytest.mark.parametrize("forgery", FORGED_LISTS)
def test_a_forged_list_is_found(tmp_path, listed, forgery):
    path = tmp_path / "c.h5"
    path.write_bytes(listed)
    reseal(path, FORGED_LISTS[forgery])
    with pytest.raises(InvalidInput, match="refused"):
        am.check_certificate(path)


@pytest.mark.parametrize("without", [False, True])
@pytest.mark.parametrize("seed", range(4))
def test_lists_of_random_problems_are_proved(tmp_path, seed, without):
    random = np.random.default_rng(seed)
    W = np.kron(np.eye(3), [[1, 0.8], [0.8, 1]])
    A = random.standard_normal((6, 6))
    W = W + 0.05 * A @ A.T / 3
    mu = random.uniform(1, 3, 3) * [not without, 1, 1]
    problem = am.FrictionProblem.from_delassus(W, np.abs(random.standard_normal((3, 2))), mu)
    found = am.all_solutions(problem)
    am.write_certificate(problem, found, tmp_path / "c.h5")
    assert f"exactly {len(found)}:" in am.check_certificate(tmp_path / "c.h5")


def test_what_is_not_complete_is_no_list(tmp_path):
    problem = hild_triangle(3).assemble().with_mu(4.0)
    found = replace(am.all_solutions(problem), complete=False, reason="stopped")
    with pytest.raises(InvalidInput, match="stopped"):
        am.write_certificate(problem, found, tmp_path / "c.h5")


def load_problems():
    """Three contacts under two loads, between which there are up to three solutions."""
    random = np.random.default_rng(0)
    A = random.standard_normal((6, 6))
    W = np.kron(np.eye(3), [[1, 0.8], [0.8, 1]]) + 0.05 * A @ A.T / 3
    loads, mu = random.standard_normal((2, 3, 2)), random.uniform(1, 3, 3)
    return [am.FrictionProblem.from_delassus(W, q, mu) for q in loads]


def test_branches_over_the_load_are_proved_and_forged_ones_found(tmp_path):
    start, end = load_problems()
    path = tmp_path / "c.h5"
    found = am.diagram(end, base=start)
    assert found.whole == (0.0, 1.0)
    assert am.write_certificate(start, found, path, end=end) == "all branches"
    assert "solutions are on lines" in am.check_certificate(path)
    right = path.read_bytes()
    for forgery in ("end", "q", "r"):
        path.write_bytes(right)
        reseal(path, lambda file, name=forgery: flipped(file, name))
        with pytest.raises(InvalidInput, match="refused"):
            am.check_certificate(path)
    with pytest.raises(InvalidInput, match="end="):
        am.write_certificate(start, found, path)


def test_a_short_line_is_listed_by_its_own_middle(tmp_path):
    """Of .0014 of the interval: its sure part ends 1e-10 inside, and reactions are steep."""
    W = [[2.297, 1.6, 0.038, -0.055], [1.6, 2.22, -0.005, 0.01],
         [0.038, -0.005, 2.25, 1.566], [-0.055, 0.01, 1.566, 2.353]]  # fmt: skip
    start, end = (
        am.FrictionProblem.from_delassus(W, q, [1.275, 1.44])
        for q in ([[-0.243, -1.646], [1.158, 1.096]], [[-0.852, 0.213], [-0.893, 0.883]])
    )
    found = am.diagram(end, base=start)
    am.write_certificate(start, found, tmp_path / "c.h5", end=end)
    assert "+-" in am.check_certificate(tmp_path / "c.h5")


def tiny():
    """Contact 2 of W = 1e-20 takes r_N = 1e20: y = -1e-310 there and y W = 0, as is rounded."""
    W, q = np.diag([1.0, 1.0, 1e-20, 1e-20]), np.array([[-1.0, 0.0], [-1.0, 0.0]])
    y = np.array([[[0.0, 0.0], [-1e-310, 0.0]]])
    none = np.zeros((0, 2, 2))
    return {"W": W, "q": q, "mu": np.full(2, 0.5), "patterns": np.array([b".."]), "y": y,
            "left": np.array([], dtype="S"), "r": none, "distance": np.array(1.0)}  # fmt: skip


def test_products_that_vanish_prove_nothing():
    with pytest.raises(checker.Refused, match="not excluded"):
        checker.proves("all solutions", tiny())


@pytest.mark.parametrize("name", ["W", "q", "mu", "y", "distance"])
def test_numbers_of_another_precision_prove_nothing(name):
    data = tiny()
    for kind in (np.float32, np.longdouble, complex, np.int64):
        with pytest.raises(checker.Refused, match="precision"):
            checker.proves("all solutions", {**data, name: data[name].astype(kind)})


def test_units_that_lose_digits_prove_nothing():
    for name, size in (("W", 1e-99), ("q", 1e100), ("mu", 1e-110)):
        data = tiny()
        with pytest.raises(checker.Refused, match="too small or large"):
            checker.proves("all solutions", {**data, name: data[name] * size})


def test_the_command_line_writes_a_list_and_checks_it(tmp_path):
    path = str(tmp_path / "c.h5")
    run = CliRunner().invoke
    done = run(main, ["enumerate", "example:hild", "--certificate", path])
    assert done.exit_code == 0, done.output
    assert "all solutions: certificate in" in done.output
    assert "exactly 3:" in run(main, ["check", path]).output


# ---------------------------------------------------------------- curves in 3D
def space_problems(seed, nc=2, rubs=False):
    """Two loads, and coefficients, of a few contacts in 3D."""
    random = np.random.default_rng(seed)
    A = random.standard_normal((3 * nc, 3 * nc))
    W = A @ A.T / (3 * nc) + 0.1 * np.eye(3 * nc)
    loads = random.standard_normal((2, nc, 3)) - [0.5, 0, 0]
    mu = random.uniform(0.2, 1, nc)
    return [am.FrictionProblem.from_delassus(W * 1e-3, q, mu * by)
            for q, by in zip(loads, (1.0, 1.5 if rubs else 1.0), strict=True)]  # fmt: skip


@pytest.fixture(scope="module")
def curved(tmp_path_factory):
    """A file with all solutions between two loads and two coefficients."""
    path = tmp_path_factory.mktemp("curves") / "c.h5"
    start, end = space_problems(1, rubs=True)
    diagram = am.diagram(end, base=start)
    assert am.write_certificate(start, diagram, path, end=end) == "all branches"
    assert f"of {len(diagram)} curves (0.000000 to 1.000000)" in am.check_certificate(path)
    return path.read_bytes()


def first_excluded(file):
    """Say of the first tube that it is excluded."""
    tree = file["tree"][()]
    tree[np.argmax(tree == -2)] = -1
    file["tree"].write_direct(tree)


FORGED_CURVES = {
    "a tube less": first_excluded,
    "other divisions": lambda file: turned(file, "tree"),
    "no multipliers": lambda file: file["y"].write_direct(0 * file["y"][()]),
    "other multipliers": lambda file: turned(file, "y"),
    "other centres": lambda file: file["x"].write_direct(file["x"][()] * 1.5 + 0.1),
    "another load": lambda file: flipped(file, "q"),
    "another end": lambda file: flipped(file, "end"),
    "more friction": lambda file: file["mu_end"].write_direct(file["mu_end"][()] * 3),
    "another W": lambda file: flipped(file, "W"),
    "another curve": lambda file: file["r"].write_direct(file["r"][()] * 1.1),
    "nearer": lambda file: file["distance"].write_direct(np.array(file["distance"][()] / 2)),
    "a longer span": lambda file: file["span"].write_direct(np.array([0.0, 1.1])),
    "no number": lambda file: file["x"].write_direct(file["x"][()] * np.nan),
    "much too large": lambda file: file["x"].write_direct(file["x"][()] + 1e200),
}


@pytest.mark.parametrize("forgery", FORGED_CURVES)
@pytest.mark.filterwarnings("ignore::RuntimeWarning")  # of numbers that are much too large
def test_forged_curves_are_found(tmp_path, curved, forgery):
    path = tmp_path / "c.h5"
    path.write_bytes(curved)
    reseal(path, FORGED_CURVES[forgery])
    with pytest.raises(InvalidInput, match="refused"):
        am.check_certificate(path)


def test_all_solutions_of_a_load_in_space_are_proved(tmp_path):
    """Three solutions of one contact: W couples its normal with one tangent."""
    W = np.array([[1.0, 0.9, 0.0], [0.9, 1.0, 0.0], [0.0, 0.0, 1.0]])
    problem = am.FrictionProblem.from_delassus(W, [[0.1, 0.5, 0.05]], [2.0])
    found = am.all_solutions(problem)
    assert len(found) == 3
    assert am.write_certificate(problem, found, tmp_path / "c.h5") == "all solutions"
    assert am.check_certificate(tmp_path / "c.h5").endswith(" of 3.")
    with h5py.File(tmp_path / "c.h5") as file:
        for r in file["r"][()]:
            assert min(np.abs(r - s.r).max() for s in found.solutions) <= file["distance"][()]
        distance = float(file["distance"][()])
    assert f"{1.0501 * distance:.1e}" in am.check_certificate(tmp_path / "c.h5")  # upwards


def test_what_is_listed_is_near_all_of_its_chain():
    """Not only near the middle of its own tube: at one end of it, and beside another."""
    low, high = np.array([[0.0, 0.0], [0.0, 1.0]]), np.array([[0.0, 1.0], [0.0, 1.5]])
    assert farthest(low, high, [np.array([0, 1])], [np.zeros(2)]) >= 1.5


def test_boxes_that_hold_a_solution_are_never_excluded():
    """Whatever the multipliers: points of the law in boxes of all kinds."""
    random = np.random.default_rng(0)
    W, mu = np.array(space_problems(3)[0].W), np.array([0.4, 0.0])
    for _ in range(40):
        arc = ARCS[random.integers(4)]
        share = random.uniform(0, 1)
        e = (1 - share) * np.array(arc[0]) + share * np.array(arc[1])
        e /= np.linalg.norm(e)
        r = np.array([[1.0, *(-0.4 * e)], [0.5, 0, 0]])
        u = np.array([[0, *(random.uniform(0, 1) * e)], [0, *random.standard_normal(2)]])
        q = u - (W @ r.ravel()).reshape(2, 3)
        checked = Problem(W, q, mu)
        for letters in ("..", "lo", "co", ".o", "l.", "c."):
            y = random.standard_normal((500, 2, 3)) * np.exp(random.uniform(-3, 3, (500, 2, 3)))
            y[::2, :, 0] = -np.abs(y[::2, :, 0])
            y[:, [x != "l" for x in letters], 1:] = 0.0
            boxes = [(letters, (arc, ARCS[0]), (0.0, 0.0))] * 500
            assert not checked.excluded(boxes, y).any()


def test_tiny_multipliers_exclude_no_solution_in_space():
    W, q = np.diag([1.0] * 3 + [1e-20] * 3), np.array([[-1.0, 0, 0], [-1.0, 0, 0]])
    box, y = ("cc", (ARCS[0],) * 2, (0.0, 0.0)), np.zeros((1, 2, 3))
    y[0, 1, 0] = -1e-310
    assert not Problem(W, q, np.full(2, 0.5)).excluded([box], y).any()


def test_the_command_line_proves_diagrams(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    hild = ["follow", "example:hild", "--from", "0.5", "--no-figures", "-o", "out"]
    ran = CliRunner().invoke(main, [*hild, "--all", "--certificate", "c.h5"])
    assert ran.exit_code == 0
    assert "all branches: certificate in c.h5" in ran.output
    assert "all loads between two" in am.check_certificate("c.h5")
    ran = CliRunner().invoke(main, [*hild, "--certificate", "d.h5"])
    assert ran.exit_code == 2
    assert "--all" in ran.output
