"""`python -m reproduce.acary2017` on a tiny wall: problems, runs, tables, claims, pictures."""

import json
import math
import shlex
import sys
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import amontons as am
from amontons.analysis import performance_profile
from amontons.io.plots import SI, Frame, draw_film, energy_figure, series_figure
from amontons.mechanics.ready.gallery import random_delassus
from amontons.mechanics.steps import Energies

SPENT = 7.0  # seconds of a made-up run that failed
ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))  # the reproductions are not installed

from reproduce.acary2017 import (  # noqa: E402
    claims,
    peers,
    race,
    ratios,
    report,
    step,
    tables,
    wall,
)
from reproduce.acary2017.__main__ import main  # noqa: E402
from reproduce.acary2017.methods import METHODS, NAMES, PRINTED, SWEEPING  # noqa: E402

SLOW = "Jacobi", "NSGS-FP-VI-UPK 100"
FEW = tuple(name for name in NAMES if name not in SLOW)


@pytest.fixture(scope="module")
def problems(tmp_path_factory):
    return wall.write_problems(wall.QUICK, tmp_path_factory.mktemp("wall"), lambda text: None)


@pytest.fixture(scope="module")
def runs(problems):
    return race.race(problems[1:], FEW, 20.0, {}, lambda text: None)


def made_up(**seconds):
    """Runs with the given costs to every tolerance, one list for each method; None: failed."""
    count = len(next(iter(seconds.values())))
    out = {}
    for k in range(count):
        methods = {}
        for name, times in seconds.items():
            t = times[k]
            met = {race.key(x): [t, 10, 1e6 * t] for x in race.TOLERANCES} if t else {}
            methods[name.replace("_", "-")] = {
                "met": dict.fromkeys(race.CRITERIA, met), "outcome": "", "error": 1.0,
                "error_13": 1.0, "seconds": t or SPENT, "flops": 1e6 * (t or SPENT),
            }  # fmt: skip
        out[f"wall-{k:04d}-100-{4 + k}"] = {"contacts": 100, "density": 0.3, "methods": methods}
    return out


def test_problems_are_those_of_the_chosen_instants_with_a_warm_start(problems):
    assert [path.name[:10] for path in problems] == ["quick-0002", "quick-0012", "quick-0014"]
    for path in problems:
        problem = am.read_fclib(path)
        r = np.load(path.with_suffix(".npz"))["r"]
        assert r.shape == (problem.contacts, 3)
        cold = problem.condensed().error(np.zeros_like(r))
        assert problem.condensed().error(r) < 0.6 * cold


def test_names_tell_step_contacts_and_iterations_of_newton(problems):
    found = [wall.newton_iterations(path) for path in problems]
    assert max(found) >= 3 * min(found)
    for path in problems:
        problem = am.read_fclib(path)
        _, _, contacts, newton = path.stem.split("-")
        assert int(contacts) == problem.contacts
        run = am.drive(problem.condensed(), wall.NEWTON, tolerance=wall.COUNTED_TO)
        assert run.convergence.iterations == int(newton)


def test_the_series_of_the_paper_is_one_run_of_five_hundred_steps():
    assert wall.PAPER.steps == 500
    assert wall.PAPER.chosen == 50


def test_the_wall_of_the_paper_has_its_unknowns():
    case = wall.read_case(wall.CASE)
    bodies = {body.name: body for body in case.model.bodies}
    supports = (bodies.pop("base"), bodies.pop("plate"))
    assert sum(len(body.mesh.points) for body in bodies.values()) == 2400
    assert all(isinstance(body.material, am.Rigid) for body in supports)
    assert case.model.discretisation.unknowns == 7212


def test_what_was_counted_stands_beside_the_paper(problems):
    record = json.loads(wall.series_file(wall.QUICK, problems[0].parent).read_text())
    text = wall.section(record)
    assert "| unknowns | 7212 | 408 |" in text
    assert "on 0 of them" in text
    assert record["chosen"] == [path.name for path in problems]


def test_problems_that_are_there_are_kept(problems):
    before = [path.stat().st_mtime_ns for path in problems]
    wall.write_problems(wall.QUICK, problems[0].parent, lambda text: None)
    assert [path.stat().st_mtime_ns for path in problems] == before


def test_all_methods_solve_the_tiny_wall(runs):
    for entry in runs.values():
        for name, run in entry["methods"].items():
            assert run["outcome"] == "converged", name
            for criterion in race.CRITERIA:
                costs = [run["met"][criterion][race.key(t)] for t in race.TOLERANCES]
                assert [c[0] for c in costs] == sorted(c[0] for c in costs)
                assert [c[1] for c in costs] == sorted(c[1] for c in costs)


def test_the_methods_of_the_paper_count_their_operations(runs):
    for entry in runs.values():
        for name in PRINTED:
            met = entry["methods"][name]["met"]["13"]
            flops = [met[race.key(t)][2] for t in race.TOLERANCES]
            assert flops == sorted(flops)
            assert flops[0] > 1e4


def test_equation_13_beside_the_clock_is_the_published_one(problems):
    problem = am.read_fclib(problems[1]).condensed()
    method = next(m for m in METHODS if m.name == "NSN-AC")
    run = race.one_run(problem, method, 20.0, problem)
    found = am.drive(problem, method.solver, tolerance=race.GOAL, patience=None,
                     max_iterations=run["iterations"])  # fmt: skip
    assert found.natural_error == pytest.approx(run["error_13"], rel=1e-6, abs=1e-12)


def test_no_run_is_ended_because_it_makes_no_progress(problems, monkeypatch):
    asked = {}

    def drive(problem, solver, **options):
        asked.update(options)
        return am.drive(problem, solver, **options)

    monkeypatch.setattr(race, "drive", drive)
    problem = am.read_fclib(problems[0]).condensed()
    race.one_run(problem, METHODS[0], 20.0, problem)
    assert asked["patience"] is None


def test_all_methods_find_the_same_velocities(problems):
    """Of a step of the wall; of fewer contacts those that take 300 000 sweeps on it."""
    step, few = am.read_fclib(problems[1]), random_delassus(3, 12).with_mu(0.1)
    wanted = {name: am.solve(problem.condensed(), tolerance=1e-10).u
              for name, problem in (("step", step), ("few", few))}  # fmt: skip
    assert (am.solve(few).status == am.ContactStatus.SLIP).any()
    for method in METHODS:
        name, problem = ("few", few) if method.name in SLOW else ("step", step)
        condensed = problem.condensed()
        form = problem if method.on_global else condensed
        found = am.solve(form, method.solver, tolerance=1e-8)
        np.testing.assert_allclose(
            condensed.velocity(found.r)[0], wanted[name], atol=1e-6 * condensed.q_norm,
            err_msg=method.name,
        )  # fmt: skip


def test_profiles_are_shares(runs):
    for tolerance in race.TOLERANCES:
        for cost in (race.PAPER, race.CLOCK):
            tau, rho = performance_profile(race.costs_to(runs, PRINTED, tolerance, cost))
            assert tau[0] == 1
            assert (rho >= 0).all() and (rho <= 1).all()
            assert (np.diff(rho, axis=1) >= 0).all()
            np.testing.assert_array_equal(rho[:, -1], 1)  # all are solved


def test_ratio_is_the_median_and_bounds_rest_on_what_was_run():
    done = made_up(NSGS_AC=[4.0, 6.0, 8.0], NSN_AC=[1.0, 1.0, 1.0])
    for cost in (race.PAPER, race.CLOCK):
        assert str(ratios.ratio(done, "NSGS-AC", "NSN-AC", 1e-6, cost)) == "6"
        slow = made_up(NSGS_AC=[4.0, None, None], NSN_AC=[1.0, 1.0, 0.5])
        assert str(ratios.ratio(slow, "NSGS-AC", "NSN-AC", 1e-6, cost)) == "≥ 7"
    for entry in slow.values():
        entry["methods"]["NSGS-AC"]["limit"] = 30.0  # allowed, but not run
    assert str(ratios.ratio(slow, "NSGS-AC", "NSN-AC", 1e-6)) == "≥ 7"
    broken = made_up(NSGS_AC=[3.5, 3.5, 3.5], NSN_AC=[None, None, 1.0])
    assert str(ratios.ratio(broken, "NSGS-AC", "NSN-AC", 1e-6)) == "≤ 0.5"
    nobody = made_up(NSGS_AC=[None], NSN_AC=[None])
    assert str(ratios.ratio(nobody, "NSGS-AC", "NSN-AC", 1e-6)) == "-"


def test_claims_follow_the_numbers():
    newton = dict.fromkeys(("NSN_AC", "NSN_JM", "NSN_AC_HYBRID"), [1.0, 1.0])
    far = made_up(
        NSGS_AC=[50.0, 60.0], NSGS_FP_VI_UPK=[40.0, 40.0], NSN_NM=[2.0, 2.0], **newton
    )
    near = made_up(NSGS_AC=[1.5, 1.6], NSGS_FP_VI_UPK=[3.0, 3.0], NSN_NM=[0.5, 0.5], **newton)
    agreed = [claim.agrees for claim in claims.claims(far)]
    assert agreed == [False, True, True, True, True, True, True, True]
    differs = [claim.agrees for claim in claims.claims(near)]
    assert differs == [True, True, False, False, False, False, False, False]
    few = made_up(**{name.replace("-", "_"): [1.0, None] for name in PRINTED})
    assert claims.most_robust(few, "two", race.CLOCK).agrees
    few["wall-0000-100-4"]["methods"]["NSN-AC-HYBRID"]["met"] = {}
    assert not claims.most_robust(few, "two", race.CLOCK).agrees
    nobody = made_up(**{name.replace("-", "_"): [None, None] for name in PRINTED})
    assert not claims.most_robust(nobody, "two", race.CLOCK).agrees


def test_the_first_line_counts_verdicts():
    yes, no = (claims.Claim("text", "1", "2", agrees, "why") for agrees in (True, False))
    verdicts = [
        claims.verdict(ours, theirs)
        for ours, theirs in ((yes, None), (yes, no), (no, no), (no, yes), (no, None))
    ]
    assert claims.opening(verdicts) == (
        "**Of the 5 claims: agrees 2 / differs by the paper's fault 1 / differs by ours 2.**"
    )
    early = claims.Claim("text", "1", "≥ 2", False, "why", undecided=True)
    assert claims.verdict(early, no) == claims.verdict(no, early) == claims.OURS
    assert "ours 1 (1 of them undecided within our limit).**" in claims.opening(
        [claims.OURS], 1
    )
    page = claims.table([yes, no], [yes, None], [None, no], [None, no])
    assert page.count("\n") == 3
    assert "differs, by Siconos too: why; Siconos: why" in page


def test_tables_have_a_row_for_every_method_and_grade(runs):
    for cost in (race.CLOCK, race.PAPER):
        page = tables.methods_table(runs, cost)
        rows = [row.split(" | ") for row in page.splitlines()]
        assert {len(row) for row in rows if len(row) > 1} == {6}
        assert [row[0].removeprefix("| ") for row in rows[2:]] == list(FEW)
        assert rows[2][1].startswith("2, ")
    assert tables.grades_table(runs).count("\n") == 1 + len(tables.by_grade(runs))
    c = ratios.each_step(runs, 1e-6)
    assert c["sweeps"] > 20 * c["newton_steps"]
    assert c["newton_operations"] > c["sweep_operations"]


def test_problems_are_grouped_by_difficulty():
    done = made_up(NSGS_AC=[1.0] * 7)
    assert {n: len(g) for n, g in tables.by_grade(done).items()} == {
        "4 to 6": 3, "7 to 8": 2, "9 to 10": 2,
    }  # fmt: skip


def test_command_measures_writes_and_refreshes_single_columns(tmp_path):
    def run(*arguments):
        done = CliRunner().invoke(main, ["--quick", "--folder", str(tmp_path), *arguments])
        assert done.exit_code == 0, done.output
        return done

    run("--only", "problems,wall", "--methods", "NSN-AC,NSGS-AC,Auto", "--limit", "20")
    place = tmp_path / "quick" / "results"
    first = json.loads((place / "wall.json").read_text())
    run("--only", "wall", "--methods", "Auto", "--limit", "20")
    second = json.loads((place / "wall.json").read_text())
    for stem, entry in first["runs"].items():
        again = second["runs"][stem]["methods"]
        assert again["NSGS-AC"] == entry["methods"]["NSGS-AC"]
        assert set(again) == {"NSN-AC", "NSGS-AC", "Auto"}
    page = (place / "results.md").read_text()
    assert "python -m reproduce.acary2017 --quick" in page
    assert (place / "profiles-wall.png").read_bytes().startswith(b"\x89PNG")
    found = json.loads((place / "results.json").read_text())["wall"]["ratios"]
    assert found["seconds, judge"]["1e-06"]["value"] > 1


def test_examples_of_the_help_are_commands(monkeypatch):
    asked = []
    monkeypatch.setattr("reproduce.acary2017.__main__._do", lambda *given: asked.append(given))
    lines = [line.strip() for line in main.epilog.splitlines() if "python -m" in line]
    for line in lines:
        words = shlex.split(line.partition("   ")[0])[3:]
        done = CliRunner().invoke(main, words)
        assert done.exit_code == 0, done.output
    assert len(asked) == len(lines) >= 5


def test_a_measurement_goes_on_where_it_was_stopped(problems, tmp_path, monkeypatch):
    asked = []

    def race_of(paths, methods, limit, runs, report):
        asked.append((paths[0].stem, tuple(methods)))
        entry = runs.setdefault(paths[0].stem, {"methods": {}})
        entry["methods"] |= {name: {"limit": limit} for name in methods}

    monkeypatch.setattr(report, "race", race_of)
    first, second = problems[:2]
    report.measure(tmp_path, "wall", [first], ["NSN-AC"], 2.0, {})
    asked.clear()
    report.measure(tmp_path, "wall", [first, second], ["NSN-AC", "Auto"], 2.0, {}, True)
    assert asked == [(first.stem, ("Auto",)), (second.stem, ("NSN-AC", "Auto"))]
    asked.clear()
    report.measure(tmp_path, "wall", [first], ["NSN-AC"], 3.0, {}, True)  # another limit
    assert asked == [(first.stem, ("NSN-AC",))]


def test_unknown_parts_and_methods_are_refused():
    for option, word in (("--only", "walls"), ("--methods", "Newton"), ("--limit", "0")):
        done = CliRunner().invoke(main, [option, word])
        assert done.exit_code == 2
        assert word in done.output


def test_table_against_siconos_names_the_best():
    entry = {
        "contacts": 10, "unknowns": 99, "condensing": 0.5,
        "ours": {"Auto": {"seconds": 0.01, "error": 1e-7}},
        "ours_global": {"Auto": {"seconds": 0.2, "error": 1e-7}},
        "siconos": {
            "NSN_AC": {"seconds": 0.1, "error": 1e-8},
            "GLOBAL_ADMM": {"seconds": 0.4, "error": 1e-8},
            "HP": {"seconds": None, "why": "over 5 s"},
        },
    }  # fmt: skip
    page = step.table({"wall": entry})
    assert "| NSN_AC | 100 ms | 600 ms | 1.0e-08 |" in page
    assert "| HP" not in page
    assert "Siconos, over 5 s: HP." in page
    assert "is NSN_AC, 100 ms; Auto takes 10 ms, 0.1 of it" in page
    assert "is GLOBAL_ADMM, 400 ms; Auto takes 200 ms, 0.5 of it" in page


def test_runs_of_siconos_look_like_ours_and_end_at_the_first_miss(problems, monkeypatch):
    def calls(python, file, solver, cap, asked, measure, enough):
        if solver == "NSGS":
            rows = [{"seconds": 0.5, "iterations": 7, "error": x} for x in (1e-2, 1e-3)]
            return rows, "over 5 s", 5.1
        return [{"seconds": 0.5, "iterations": 7, "error": 1e-7}], "", 0.5

    monkeypatch.setattr(peers, "calls", calls)
    found = peers.race(problems[:1], "", 5.0, {}, lambda text: None)
    (entry,) = found["siconos"].values()
    slow = entry["methods"]["NSGS-AC"]
    assert set(slow["met"]["13"]) == {race.key(1e-2), race.key(1e-3)}
    assert slow["seconds"] == 5.1
    assert str(ratios.ratio(found["siconos"], *SWEEPING[:1], "NSN-AC", 1e-6, peers.COST)) == (
        "≥ 10"
    )
    assert len(claims.claims(found["siconos"], peers.COST)) == 8
    assert "| NSGS-AC (NSGS) | 1, 500 ms | 1, 500 ms | 0, - | 0, - |" in peers.table(found)
    assert "| 71.4 ms |" in peers.steps_table(found)


def test_runs_of_siconos_are_counted_in_operations():
    met = {"0.01": [0.5, 13, None], "0.0001": [2.0, 1000, None]}
    run = {"met": {"13": met}, "seconds": 4.0, "flops": None}
    mine = {"methods": {name: {"flops": 50.0, "iterations": 10} for name in SWEEPING}}
    theirs = {"a": {"methods": {"NSGS-AC": run, "NSN-AC": run, "NSN-AC-HYBRID": run}}}
    found = peers.with_operations(theirs, {"a": mine}, {"a": 7.0})["a"]["methods"]
    assert found["NSGS-AC"]["met"]["13"]["0.01"] == [0.5, 13, 65.0]
    assert found["NSGS-AC"]["flops"] == 10_000.0  # of 4 s, 5000 of them in 2 s
    assert found["NSN-AC"]["met"]["13"]["0.01"][2] == 91.0
    assert found["NSN-AC-HYBRID"]["met"]["13"]["0.0001"][2] == 100 * 5 + 900 * 7
    assert run["flops"] is None
    assert peers.with_operations(theirs, {"a": mine}, {}) is None
    assert peers.with_operations(theirs, {}, {"a": 7.0}) is None


def test_mumps_counts_the_operations_of_a_newton_step(problems):
    pytest.importorskip("mumps")
    problem = am.read_fclib(problems[-1]).condensed()
    size = 3 * problem.contacts
    assert 0 < peers.elimination_flops(problem) < size**3


def test_runs_of_siconos_go_on_where_they_were_stopped(problems, tmp_path, monkeypatch):
    asked = []

    def calls(python, file, solver, *rest):
        asked.append((solver, set(np.load(file).files)))
        return [{"seconds": 0.5, "iterations": 7, "error": 1e-7}], "", 0.5

    monkeypatch.setattr(peers, "calls", calls)
    small = tmp_path / "small.hdf5"
    am.write_fclib(random_delassus(0, 4), small)
    run = {"python": "", "limit": 2.0, "machine": {}}
    report.within_siconos(tmp_path, "fclib", [small], **run)
    assert not {"M", "M_data", "f"} & asked[0][1]  # a file with W
    first = len(asked)
    report.within_siconos(tmp_path, "fclib", [small, problems[0]], **run, missing=True)
    assert len(asked) == 2 * first  # the new one
    record = race.load(tmp_path / "siconos-fclib.json")
    assert len(record["runs"]["siconos"]) == 2
    claim = claims.most_robust(record["runs"]["siconos"], "two", peers.COST)
    assert claim.agrees and "NSN-AC-HYBRID 2" in claim.found
    report.within_siconos(tmp_path, "fclib", [small], **run | {"limit": 3.0}, missing=True)
    assert len(asked) == 3 * first  # another limit


def test_one_column_against_siconos_runs_again_beside_the_quickest_only(problems, monkeypatch):
    asked = []

    def worker(condensed, python, file, solver, cap):
        asked.append(solver)
        return {"seconds": 2.0, "error": 1e-8}

    monkeypatch.setattr(step, "worker", worker)
    stored = {
        "ours": {"NSN-AC line search": {"seconds": 7.0}},
        "ours_global": {},
        "siconos": {name: {"seconds": 1.0 + k} for k, name in enumerate(step.LOCAL)}
        | {"GLOBAL_NSN_AC": {"seconds": 9.0}, "GLOBAL_IPM": {"seconds": None}},
    }
    found = step.compare(problems[0], "", 1.0, lambda text: None, ["Auto global"], stored)
    assert asked == [*step.LOCAL[: step.QUICKEST], "GLOBAL_NSN_AC"]
    assert found["ours"] == stored["ours"]
    assert found["ours_global"]["Auto"]["outcome"] == "converged"
    assert found["siconos"]["NSGS"]["seconds"] == 2.0
    assert found["siconos"]["NSN_NM"] == stored["siconos"]["NSN_NM"]


def test_contact_of_the_tiny_wall_never_creates_energy_and_pictures_say_so(tmp_path):
    case = wall.read_case(wall.CASE, ["wall.cells=[2,1,1]", "wall.rows=2"])
    steps = list(am.evolve(case.model, am.MoreauJean(step=5e-3, theta=1), until=0.05,
                           tolerance=1e-10))  # fmt: skip  # the error of a step is energy, too
    energies = [s.energies for s in steps]
    assert all(e.contact <= 1e-8 * (e.total + e.turnover) for e in energies)
    titles = [a.get_title() for a in energy_figure([s.time for s in steps], energies).axes]
    assert "creates no energy" in titles[1] or max(e.contact for e in energies) > 0
    created = energy_figure([1.0, 2.0], [Energies(contact=-1.0), Energies(contact=1e-3)])
    assert "Contact creates" in created.axes[1].get_title()
    rounding = [Energies(supports=1.0, contact=-0.1), Energies(contact=1e-15)]
    assert "creates no energy" in energy_figure([1.0, 2.0], rounding).axes[1].get_title()
    with pytest.raises(am.InvalidInput, match="energies"):
        energy_figure([], [])
    frames = [Frame.of(steps[4]), Frame.of(steps[-1])]
    *pages, film = draw_film(case.model, frames, tmp_path)
    assert len(pages) == 2
    assert film.read_bytes().startswith(b"GIF89a")
    panels = series_figure(case.model, frames, units=SI).axes
    assert [axes.get_title().split("\n")[0] for axes in panels] == ["t = 0.025 s", "t = 0.05 s"]
    assert any(text.get_text().endswith(" m") for text in panels[0].texts)  # of the scale
    assert energy_figure([1.0], energies[:1], units=SI).axes[0].get_ylabel().endswith("in J")
    with pytest.raises(am.InvalidInput, match="frames"):
        series_figure(case.model, [])


def test_reference_holds_the_numbers_of_the_paper():
    assert claims.REFERENCE["newton_over_gauss_seidel"] == {
        "0.001": 4,
        "0.0001": 20,
        "1e-06": 40,
    }
    assert math.isclose(claims.REFERENCE["wall"]["rows_of_H"] / 3, 688)
    assert set(report.SETS) >= {"wall", "fclib"}
