"""A body that gives way is named, by its name in the mesh and its direction, by every verb."""

import meshio
import numpy as np
import pytest
from click.testing import CliRunner

import amontons as am
from amontons.app.cli import main
from amontons.mechanics.meshes import Cells, Facets

STEEL = am.LinearElastic(200.0, 0.3)
GIVES_WAY = r"there is no solution.*body 'bracket' gives way by translation along x"


def parts(dim, regions=("plate", "bracket")):
    """One mesh of two parts: a block on a plate, each a region of its own."""
    kind = "quad" if dim == 2 else "hex"
    low = am.box((2,) * (dim - 1) + (1,), cells=(4,) * (dim - 1) + (2,))
    origin = (0.5,) * (dim - 1) + (1.0,)
    high = am.box((1,) * dim, cells=2, origin=origin)
    n = len(low.points)
    surfaces = {f"low-{name}": facets for name, facets in low.surfaces.items()}
    for name, facets in high.surfaces.items():
        surfaces[f"high-{name}"] = tuple(Facets(f.kind, f.nodes + n) for f in facets)
    cells = (
        Cells(kind, low.cells[0].nodes, regions[0]),
        Cells(kind, high.cells[0].nodes + n, regions[1]),
    )
    return am.Mesh(np.vstack([low.points, high.points]), cells, surfaces)


def lying(push, dim=2, mesh=None, name=""):
    """The block is held by contact alone, pressed by 1 and pushed along x; mu = 0.3."""
    force = (push,) + (0.0,) * (dim - 2) + (-1.0,)
    return am.Model(
        [am.Body(parts(dim) if mesh is None else mesh, STEEL, name=name)],
        [am.Fix("low-bottom", 0)],
        [am.Contact("high-bottom", master="low-top", mu=0.3, method="mortar")],
        [am.Traction("high-top", force)],
    )


VERBS = {
    "solve": am.solve,
    "evolve": lambda m: list(am.evolve(m, am.QuasiStatic(0.5), until=1.0)),
    "follow": am.follow,
    "follow friction": lambda m: am.follow(m, "friction", (0.1, 0.3)),
    "diagram": am.diagram,
    "all_solutions": am.all_solutions,
    "multistart": am.multistart,
}


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("verb", VERBS)
def test_every_verb_names_what_gives_way(verb, dim):
    with pytest.raises(am.AmontonsError, match=GIVES_WAY):
        VERBS[verb](lying(0.5, dim))


@pytest.mark.parametrize("dim", [2, 3])
def test_what_contact_holds_is_solved_or_refused_in_words(dim):
    model = lying(0.1, dim)
    assert am.solve(model).converged
    assert len(list(am.evolve(model, am.QuasiStatic(0.5), until=1.0))) == 2
    named = r"alone holds a body \(body 'bracket'\).*evolve"
    for verb in ("follow", "follow friction", "diagram", "all_solutions", "multistart"):
        with pytest.raises(am.SingularOperator, match=named):
            VERBS[verb](model)


def test_uniqueness_says_it_in_its_reason():
    assert "holds a body (body 'bracket')" in am.uniqueness(lying(0.1), time_limit=5).reason
    assert "'bracket' gives way" in am.uniqueness(lying(0.5), time_limit=5).reason


def test_steps_say_it_also_where_they_go_on():
    model = lying(0.5)
    (step,) = am.evolve(model, am.QuasiStatic(1.0), until=1.0, check=False)
    record = step.solution.convergence
    assert "'bracket' gives way" in record.detail
    assert "support" in record.advice
    assert "tolerance" not in record.advice


def test_at_a_time_that_is_not_the_first():
    """The load grows beyond what friction holds: the step says so, with its own load."""
    model = am.Model(
        [am.Body(parts(2), STEEL)],
        [am.Fix("low-bottom", 0)],
        [am.Contact("high-bottom", master="low-top", mu=0.3, method="mortar")],
        [am.Traction("high-top", (lambda x, t: t, -1.0))],
    )
    steps = am.evolve(model, am.QuasiStatic(0.2), until=1.0)
    assert next(steps).time == 0.2
    with pytest.raises(am.NotConverged, match="step 2: .*'bracket' gives way"):
        next(steps)


@pytest.mark.parametrize(
    ("regions", "name", "title"),
    [
        (("plate", "bracket"), "", "bracket"),
        (("plate", "bracket"), "jig", "jig.bracket"),
        (("steel", "steel"), "", "body (part 2 of 2)"),
        (("default", "bracket"), "", "bracket (part 2 of 2)"),
        (("plate", "default"), "", "body (part 2 of 2)"),
    ],
)
def test_names_of_parts(regions, name, title):
    model = lying(0.1, mesh=parts(2, regions), name=name)
    assert model.held_by_contact == f"a body (body {title!r})"


CASE = """
mesh.file = "parts.msh"
[material.plate]
young = 200.0
poisson = 0.3
[material.bracket]
young = 200.0
poisson = 0.3
[[fix]]
on = "low-bottom"
value = [0, 0]
[[traction]]
on = "high-top"
value = [0.5, -1.0]
[[contact]]
slave = "high-bottom"
master = "low-top"
method = "mortar"
friction = { coulomb = 0.3 }
"""
IN_TIME = """
[evolution]
kind = "quasi-static"
step = 0.5
until = 1.0
"""


def write_gmsh(mesh, path):
    """The mesh with its regions and surfaces as physical groups."""
    names = [*mesh.regions, *mesh.surfaces]
    number = {name: k for k, name in enumerate(names, 1)}
    blocks = [("quad", block.nodes, number[block.region]) for block in mesh.cells]
    blocks += [("line", f.nodes, number[name]) for name, (f,) in mesh.surfaces.items()]
    tags = [np.full(len(nodes), tag) for _, nodes, tag in blocks]
    given = meshio.Mesh(
        np.column_stack([mesh.points, np.zeros(len(mesh.points))]),
        [(kind, nodes) for kind, nodes, _ in blocks],
        cell_data={"gmsh:physical": tags, "gmsh:geometrical": tags},
        field_data={n: np.array([number[n], 2 if n in mesh.regions else 1]) for n in names},
    )
    meshio.write(path, given, file_format="gmsh22", binary=False)


@pytest.mark.parametrize("verb", ["solve", "run", "follow", "enumerate", "uniqueness"])
def test_the_command_line_says_it_too(tmp_path, monkeypatch, verb):
    monkeypatch.chdir(tmp_path)
    write_gmsh(parts(2), tmp_path / "parts.msh")
    case = tmp_path / "case.toml"
    case.write_text(CASE + IN_TIME if verb == "run" else CASE)
    done = CliRunner().invoke(main, [verb, str(case)])
    assert done.exit_code in (1, 2), done.output
    said = " ".join((done.output + done.stderr).split())
    assert "'bracket' gives way by translation along x" in said


def test_pictures_of_a_run_that_failed_say_so(tmp_path, monkeypatch):
    """The first step holds, the second does not."""
    from amontons.io.plots import layout

    stamped = []
    monkeypatch.setattr(layout, "stamp", lambda figure, text: stamped.append(text))
    monkeypatch.chdir(tmp_path)
    write_gmsh(parts(2), tmp_path / "parts.msh")
    case = tmp_path / "case.toml"
    pushed = CASE.replace("value = [0.5, -1.0]", 'value = ["0.4*t", -1.0]')
    case.write_text(pushed + IN_TIME)
    done = CliRunner().invoke(main, ["run", str(case), "--pictures"])
    assert done.exit_code == 1, done.output
    assert stamped == ["NOT FINISHED (t = 0.5 of 1, the next step did not converge)"] * 2
    stamped.clear()
    case.write_text(pushed.replace("0.4*t", "0.1*t") + IN_TIME)
    done = CliRunner().invoke(main, ["run", str(case), "--pictures", "-o", "good"])
    assert done.exit_code == 0, done.output
    assert not any(stamped)
