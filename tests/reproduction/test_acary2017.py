"""`python -m reproduce.acary2017` on a tiny wall: problems, runs, tables, claims, pictures."""

import json
import math
import sys
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import amontons as am
from amontons.analysis import performance_profile
from amontons.evolution import Energies
from amontons.plots import SI, Frame, draw_film, energy_figure, series_figure

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))  # the reproductions are not installed

from reproduce.acary2017 import race, report, step, tables, wall  # noqa: E402
from reproduce.acary2017.__main__ import main  # noqa: E402
from reproduce.acary2017.methods import METHODS, NAMES, PRINTED  # noqa: E402


@pytest.fixture(scope="module")
def problems(tmp_path_factory):
    return wall.write_problems(wall.QUICK, tmp_path_factory.mktemp("wall"), lambda text: None)


@pytest.fixture(scope="module")
def runs(problems):
    return race.race(problems[1:], NAMES, 20.0, {}, lambda text: None)


def made_up(**seconds):
    """Runs with the given times to every tolerance, one list for each method."""
    count = len(next(iter(seconds.values())))
    out = {}
    for k in range(count):
        methods = {}
        for name, times in seconds.items():
            t = times[k]
            met = {race.key(x): [t, 10] for x in race.TOLERANCES} if t else {}
            methods[name.replace("_", "-")] = {"met": met, "outcome": "", "error": 1.0,
                                               "error_13": 1.0}  # fmt: skip
        out[f"wall-1ms-{k:04d}"] = {"contacts": 100, "density": 0.3, "methods": methods}
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
            times = [run["met"][race.key(t)] for t in race.TOLERANCES]
            assert times == sorted(times)


def test_all_methods_find_the_same_velocities(problems):
    problem = am.read_fclib(problems[1])
    condensed = problem.condensed()
    wanted = am.solve(condensed, tolerance=1e-10).u
    for method in METHODS:
        form = problem if method.on_global else condensed
        found = am.solve(form, method.solver, tolerance=1e-8)
        np.testing.assert_allclose(
            condensed.velocity(found.r)[0], wanted, atol=1e-6 * condensed.q_norm,
            err_msg=method.name,
        )  # fmt: skip


def test_profiles_are_shares(runs):
    for tolerance in tables.PROFILED:
        tau, rho = performance_profile(race.seconds(runs, PRINTED, tolerance))
        assert tau[0] == 1
        assert (rho >= 0).all() and (rho <= 1).all()
        assert (np.diff(rho, axis=1) >= 0).all()
        np.testing.assert_array_equal(rho[:, -1], 1)  # all are solved


def test_ratio_is_the_median_and_knows_bounds():
    done = made_up(NSGS_AC=[4.0, 6.0, 8.0], NSN_AC=[1.0, 1.0, 1.0])
    assert str(tables.ratio(done, "NSGS-AC", "NSN-AC", 1e-6, 10.0)) == "6"
    slow = made_up(NSGS_AC=[4.0, None, None], NSN_AC=[1.0, 1.0, 0.5])
    assert str(tables.ratio(slow, "NSGS-AC", "NSN-AC", 1e-6, 10.0)) == "≥ 10"
    for entry in slow.values():
        entry["methods"]["NSGS-AC"]["limit"] = 30.0
    assert str(tables.ratio(slow, "NSGS-AC", "NSN-AC", 1e-6, 10.0)) == "≥ 30"
    broken = made_up(NSGS_AC=[4.0, 4.0, 4.0], NSN_AC=[None, None, 1.0])
    assert str(tables.ratio(broken, "NSGS-AC", "NSN-AC", 1e-6, 10.0)) == "≤ 0.4"
    nobody = made_up(NSGS_AC=[None], NSN_AC=[None])
    assert str(tables.ratio(nobody, "NSGS-AC", "NSN-AC", 1e-6, 10.0)) == "-"


def test_claims_follow_the_numbers():
    newton = dict.fromkeys(("NSN_AC", "NSN_JM", "NSN_AC_HYBRID"), [1.0, 1.0])
    far = made_up(
        NSGS_AC=[50.0, 60.0], NSGS_FP_VI_UPK=[40.0, 40.0], NSN_NM=[2.0, 2.0], **newton
    )
    near = made_up(NSGS_AC=[1.5, 1.6], NSGS_FP_VI_UPK=[3.0, 3.0], NSN_NM=[0.5, 0.5], **newton)
    agreed = [claim.agrees for claim in tables.claims(far, 100.0)]
    assert agreed == [False, True, True, True, True, True, True, True]
    differs = [claim.agrees for claim in tables.claims(near, 100.0)]
    assert differs == [True, True, False, False, False, False, False, False]
    text = tables.claims_table(tables.claims(near, 100.0))
    assert "a step costs as much as" in text
    assert text.count("\n") == 9
    few = made_up(**{name.replace("-", "_"): [1.0, None] for name in PRINTED})
    assert tables.most_robust(few, "two").agrees
    few["wall-1ms-0000"]["methods"]["NSN-AC-HYBRID"]["met"] = {}
    assert not tables.most_robust(few, "two").agrees


def test_tables_have_a_row_for_every_method_and_step(runs):
    page = tables.methods_table(runs)
    rows = [row.split(" | ") for row in page.splitlines()]
    assert {len(row) for row in rows if len(row) > 1} == {6}
    assert [row[0].removeprefix("| ") for row in rows[2:]] == list(NAMES)
    assert rows[2][1].startswith("2, ")
    assert "| 5 ms | 2 |" in tables.steps_table(runs, 20.0)
    c = tables.costs(runs, 1e-6)
    assert c["sweeps"] > 20 * c["newton_steps"]
    assert c["dense_lu_operations"] > c["sweep_operations"]


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
    assert (
        json.loads((place / "results.json").read_text())["wall"]["ratios"]["1e-06"]["value"] > 1
    )


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


def test_ratio_within_siconos_is_a_bound_where_gauss_seidel_did_not_end():
    record = {"cap": 24.0, "runs": {"wall-5ms-0055": {
        "NSGS": {"0.0001": {"seconds": 3.0}, "1e-06": {"seconds": None}},
        "NSN_AC": {"0.0001": {"seconds": 1.0}, "1e-06": {"seconds": 2.0}},
    }}}  # fmt: skip
    page = step.cold_table(record)
    assert "| wall-5ms-0055 | 3 s, 1 s, 3 | ≥ 24 s, 2 s, ≥ 12 |" in page
    assert step.cold_medians(record) == "3 times at 1e-4, ≥ 12 times at 1e-6"


def test_one_column_against_siconos_runs_again_beside_the_quickest_only(problems, monkeypatch):
    asked = []

    def worker(condensed, python, file, solver, cap):
        asked.append(solver)
        return {"seconds": 2.0, "error": 1e-8}

    monkeypatch.setattr(step, "_worker", worker)
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
    assert "never creates" in titles[1] or max(e.contact for e in energies) > 0
    created = energy_figure([1.0, 2.0], [Energies(contact=-1.0), Energies(contact=1e-3)])
    assert "Contact creates" in created.axes[1].get_title()
    rounding = [Energies(supports=1.0, contact=-0.1), Energies(contact=1e-15)]
    assert "never creates" in energy_figure([1.0, 2.0], rounding).axes[1].get_title()
    with pytest.raises(am.InvalidInput, match="energies"):
        energy_figure([], [])
    frames = [Frame.of(steps[4]), Frame.of(steps[-1])]
    *pages, film = draw_film(case.model, frames, tmp_path)
    assert len(pages) == 2
    assert film.read_bytes().startswith(b"GIF89a")
    panels = series_figure(case.model, frames, units=SI).axes
    assert [axes.get_title().split("\n")[0] for axes in panels] == ["t = 0.025 s", "t = 0.05 s"]
    assert panels[0].get_ylabel() == "$z$ in m"
    assert energy_figure([1.0], energies[:1], units=SI).axes[0].get_ylabel().endswith("in J")
    with pytest.raises(am.InvalidInput, match="frames"):
        series_figure(case.model, [])


def test_reference_holds_the_numbers_of_the_paper():
    assert tables.REFERENCE["newton_over_gauss_seidel"] == {
        "0.001": 4,
        "0.0001": 20,
        "1e-06": 40,
    }
    assert math.isclose(tables.REFERENCE["wall"]["rows_of_H"] / 3, 688)
    assert set(report.SETS) >= {"wall", "fclib"}
