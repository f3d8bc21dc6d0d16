"""Methods with options in a race, as they are typed."""

import json
import math

import pytest
from click.testing import CliRunner

import amontons as am
from amontons.app.cli import main
from amontons.app.cli.contestants import contestants
from amontons.mechanics.ready.gallery import random_delassus

TABLE_1 = (
    "NSN-AC=semismooth-newton:line_search=none",
    "NSN-JM=semismooth-newton:function=jean-moreau,line_search=none",
    "NSN-NM=semismooth-newton:function=natural-map,line_search=none",
    "HYBRID=hybrid:first.local=newton,first.batch=100,main.line_search=none",
    "NSGS-AC=gauss-seidel:local=newton,batch=adaptive",
    "UPK=gauss-seidel:local=projection,local_steps=3,batch=adaptive",
)


def solvers(*texts):
    return {each.name: each.settings.solver() for each in contestants(texts)}


def test_names_options_and_plain_methods():
    full = am.SemismoothNewton(am.NaturalMap(), line_search=am.FullStep())
    text = "semismooth-newton:function=natural-map,line_search=none"
    assert solvers(f"auto,{text},gauss-seidel") == {
        "auto": am.Auto(), text: full, "gauss-seidel": am.GaussSeidel(),
    }  # fmt: skip
    assert solvers(f"NM={text}", "auto") == {"NM": full, "auto": am.Auto()}
    assert solvers("mine=auto:") == {"mine": am.Auto()}


def test_table_1_of_the_paper():
    found = solvers(*TABLE_1)
    newton = am.SemismoothNewton(line_search=am.FullStep())
    local = am.LocalSolver
    assert list(found.values()) == [
        newton,
        am.SemismoothNewton(am.JeanMoreau(), line_search=am.FullStep()),
        am.SemismoothNewton(am.NaturalMap(), line_search=am.FullStep()),
        am.Hybrid(am.GaussSeidel(local=local.NEWTON, batch=100), newton),
        am.GaussSeidel(local=local.NEWTON, batch=am.Batch.ADAPTIVE),
        am.GaussSeidel(local=local.PROJECTION, local_steps=3, batch=am.Batch.ADAPTIVE),
    ]
    assert solvers(",".join(TABLE_1)) == found


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("newton", ["methods", "newton", "did you mean"]),
        ("auto,", []),
        (",", ["methods", "expected"]),
        ("line_search=none", ["line_search=none", "no method", "colon"]),
        ("auto,batch=3", ["batch=3", "colon"]),
        ("gauss-seidel:bach=3", ["gauss-seidel:bach=3", "batch"]),
        ("gauss-seidel:batch", ["FIELD=VALUE"]),
        ("gauss-seidel:batch=0", ["batch", "at least 1"]),
        ("gauss-seidel:local=exact,local_steps=3", ["local_steps", "exact"]),
        ("auto:tolerance=1e-3", ["tolerance", "all methods"]),
        ("auto,auto", ["twice", "NAME="]),
        ("A=auto:,A=gauss-seidel:", ["A", "twice"]),
        ("=auto:", ["name"]),
    ],
)
def test_what_is_wrong_is_named(text, words):
    if not words:
        assert len(contestants([text])) == 1
        return
    with pytest.raises(am.InvalidInput) as caught:
        contestants([text])
    for word in words:
        assert word in str(caught.value), str(caught.value)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "200")
    for seed in (1, 2):
        am.write_fclib(random_delassus(seed, 6), f"p{seed}.hdf5")
    return tmp_path


def bench(*words):
    return CliRunner().invoke(main, ["bench", "p1.hdf5", "p2.hdf5", *words])


def test_table_1_is_raced_by_operations_and_equation_13(folder):
    methods = [word for text in TABLE_1 for word in ("--methods", text)]
    done = bench(*methods, "--by", "flops", "--criterion", "natural", "--tolerances",
                 "1e-2,1e-6", "--json", "race.json", "--profile", "p.png")  # fmt: skip
    assert done.exit_code == 0, done.output
    assert "Floating point operations" in done.output
    data = json.loads((folder / "race.json").read_text())
    assert data["criterion"] == "natural"
    assert len(data["results"]) == 2 * 2 * len(TABLE_1)
    for row in data["results"]:
        assert row["outcome"] == "converged", row
        assert row["flops"] > 100
        assert row["error"] <= row["tolerance"]
        assert row["spent"] > 0
    assert (folder / "p.png").read_bytes().startswith(b"\x89PNG")


def test_methods_that_do_not_count_say_so_and_have_no_profile(folder):
    done = bench("--methods", "smoothing-newton,gauss-seidel", "--by", "flops",
                 "--tolerances", "1e-3")  # fmt: skip
    assert done.exit_code == 0
    assert "not counted" in done.output
    alone = bench("--methods", "smoothing-newton", "--by", "flops", "--profile", "p.png")
    assert alone.exit_code == 2
    assert "no method here counts" in alone.output


def test_nothing_but_the_limit_ends_a_race(folder):
    done = bench("--methods", "slow=jacobi:stiffening=1e9,batch=10", "--tolerances", "1e-6",
                 "--time-limit", "0.5", "--json", "-")  # fmt: skip
    for row in json.loads(done.stdout)["results"]:
        assert row["outcome"] == "time_limit"
        assert math.isfinite(row["spent"])
        assert row["spent"] >= 0.5
        assert row["seconds"] is None
