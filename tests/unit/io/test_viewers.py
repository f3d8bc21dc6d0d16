"""Files for viewers and tables: both sides of contact, parts, names, time, units."""

import csv

import h5py
import meshio
import numpy as np
import pytest

import amontons as am
from amontons.io import results as output
from amontons.io.contact_fields import contact_fields

SOFT = am.LinearElastic(200, 0.3)
METHODS = ["nodal", "mortar", "nitsche", am.Nitsche(theta=1.0)]


def pressed(dim, method="mortar"):
    """Uniformly, so that both sides show the same pressure whatever the meshes."""
    flat = (0,) * (dim - 2)
    law = am.LinearElastic(200, 0.0)
    low = am.Body(am.box((1,) * dim, 2), law, name="low")
    cells = 2 if method == "nodal" else 3
    up = am.Body(am.box((1,) * dim, cells, origin=(0, *flat, 1)), law, name="up")
    pair = am.Contact("up.bottom", master="low.top", mu=0.5, method=method)
    held = [am.Fix("low.bottom", 0), am.Fix("up.top", (0, *flat, -0.02))]
    return am.Model([low, up], held, [pair], name="two blocks")


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("method", METHODS, ids=str)
def test_both_sides_of_a_uniform_pressure(dim, method, tmp_path):
    am.solve(pressed(dim, method), tolerance=1e-11).write(tmp_path / "a.vtu")
    found = meshio.read(tmp_path / "a.vtu")
    fields, side = found.point_data, found.point_data["CSIDE"]
    height = found.points[:, dim - 1]
    assert set(side[height == 1]) == {1, 2}
    assert not side[height != 1].any()
    on = side > 0
    np.testing.assert_allclose(fields["CPRESS"][on], 2.0, rtol=1e-7)
    np.testing.assert_allclose(fields["COPEN"][on], 0, atol=1e-9)
    assert (fields["CSTATUS"][on] == 2).all()
    assert (fields["CSTATUS"][~on] == -1).all()
    up = np.eye(3)[dim - 1]
    for number, sign in ((1, 1), (2, -1)):
        force = fields["CFORCE"][side == number].sum(axis=0)
        np.testing.assert_allclose(force, 2 * sign * up, atol=1e-8)
        for traction in fields["CTRACTION"][side == number]:
            np.testing.assert_allclose(traction, 2 * sign * up, atol=1e-6)
    np.testing.assert_allclose(fields["stress"][:, dim - 1], -2.0, rtol=1e-7)
    np.testing.assert_allclose(fields["reaction"].sum(axis=0), 0, atol=1e-10)
    assert all(np.isfinite(values).all() for values in fields.values())



@pytest.mark.parametrize("ends", [("up.bottom", "low.top"), ("low.top", "up.bottom")])
def test_masters_show_contact_where_it_is_now(ends):
    """A block that has slid far: pressed nodes of both sides are there, forces cancel."""
    law = am.NeoHookean(10.0, 0.0)
    low = am.Body(am.box((3, 1), (6, 1), origin=(0, -1)), am.NeoHookean(1e5, 0.0), name="low")
    up = am.Body(am.box((1, 1), 2), law, name="up")
    held = [am.Fix("low.bottom", 0), am.Fix("up.top", (1.6, -0.1))]
    model = am.Model([low, up], held, [am.Contact(ends[0], master=ends[1], mu=0.0)])
    found = am.solve(model)
    starts = np.cumsum([0, *(len(body.mesh.points) for body in model.bodies)])
    fields = contact_fields(model, found.fields, found.solution.sliding, starts)
    at = np.concatenate([b.mesh.points + u for b, u in zip(model.bodies, found.displacement,
                                                           strict=True)])  # fmt: skip
    assert fields["CFORCE"].sum(axis=0) == pytest.approx(0, abs=1e-12)
    for side in (1, 2):
        on = (fields["CSIDE"] == side) & (fields["CPRESS"] > 0)
        assert 1.4 < at[on, 0].min() < at[on, 0].max() < 3.1
        np.testing.assert_allclose(fields["CPRESS"][on], 1.0, rtol=0.2)
        total = abs(fields["CFORCE"][on, 1].sum())
        assert total == pytest.approx(abs(found.resultant[1]), rel=1e-9)


@pytest.mark.parametrize("at", [0.15, 0.3, 0.45])
def test_masters_of_second_order_show_no_more_than_acts_on_them(at):
    """Weights of corners that a pair covers by a part cancel: what is left is no mean."""
    low = am.Body(am.box((4, 1), (9, 2), origin=(-1, -1)), am.NeoHookean(1.0, 0.3), name="low",
                  order=2)  # fmt: skip
    up = am.Body(am.box((1, 0.6), (4, 2)), am.NeoHookean(6.0, 0.3), name="up", order=2)
    held = [am.Fix("low.bottom", 0), am.Fix("up.top", (at, -0.1))]
    model = am.Model([low, up], held, [am.Contact("up.bottom", master="low.top", mu=0.3)])
    found = am.solve(model)
    starts = np.cumsum([0, *(len(body.mesh.points) for body in model.bodies)])
    fields = contact_fields(model, found.fields, found.solution.sliding, starts)
    slave, master = fields["CSIDE"] == 1, (fields["CSIDE"] == 2) & (fields["CSTATUS"] >= 0)
    on = master & (np.abs(fields["CFORCE"]).max(axis=1) > 0)
    assert on.sum() >= 4
    for name in ("CPRESS", "CSHEAR", "COPEN", "CSLIP"):
        low_, high = fields[name][slave].min(), fields[name][slave].max()
        assert low_ - 1e-12 <= fields[name][on].min() <= fields[name][on].max() <= high + 1e-12
    length = np.linalg.norm(fields["CTRACTION"], axis=1)
    assert length[on].max() <= length[slave].max() + 1e-12


def test_what_slides_shows_its_slip_on_both_sides(tmp_path):
    flat = pressed(2)
    model = am.Model(flat.bodies, [am.Fix("low.bottom", 0), am.Fix("up.top", (0.5, -0.02))],
                     [am.Contact("up.bottom", master="low.top", mu=0.1)])  # fmt: skip
    found = am.solve(model, tolerance=1e-10)
    found.write(tmp_path / "a.vtu")
    fields = meshio.read(tmp_path / "a.vtu").point_data
    for number in (1, 2):
        on = fields["CSIDE"] == number
        assert (fields["CSTATUS"][on] == 1).all()
        slip = fields["CSLIP_ACCUMULATED"][on]
        assert slip.min() > 0.4
        assert slip.max() <= found.pairs["up.bottom"].slip.accumulated * (1 + 1e-9)
        assert (fields["CFRICTION_WORK"][on] > 0).all()
    area = np.ones(4) / 3
    area[[0, -1]] /= 2
    slave = fields["CSIDE"] == 1
    work = fields["CFRICTION_WORK"][slave]
    order = np.argsort(meshio.read(tmp_path / "a.vtu").points[slave, 0])
    assert work[order] @ area == pytest.approx(found.pairs["up.bottom"].friction_work, rel=1e-9)


def test_parts_and_regions_are_told_apart_by_name(tmp_path):
    """One mesh with two volumes, of names of their own."""
    low, up = am.box((1, 1), 2), am.box((1, 1), 2, origin=(0, 1))
    n = len(low.points)
    cells = (am.Cells("quad", low.cells[0].nodes, "plate"),
             am.Cells("quad", up.cells[0].nodes + n, "bracket"))  # fmt: skip
    surfaces = {"base": low.surfaces["bottom"], "plate top": low.surfaces["top"]}
    for name in ("bottom", "top"):
        (facets,) = up.surfaces[name]
        surfaces[f"bracket {name}"] = (am.Facets(facets.kind, facets.nodes + n),)
    mesh = am.Mesh(np.vstack([low.points, up.points]), cells, surfaces)
    model = am.Model(
        [am.Body(mesh, SOFT)], [am.Fix("base", 0), am.Fix("bracket top", (0, -0.01))],
        [am.Contact("bracket bottom", master="plate top", mu=0.3, name="joint <1>")],
        name='A "jig" & <more>',
    )  # fmt: skip
    am.solve(model).write(tmp_path / "a.vtu")
    found = meshio.read(tmp_path / "a.vtu")
    (body,), (region,) = found.cell_data["body"], found.cell_data["region"]
    assert body.tolist() == region.tolist() == [0] * 4 + [1] * 4
    told = {name: int(value[0]) for name, value in found.field_data.items()}
    assert told["body 0: plate"] == told["region 0: plate"] == 0
    assert told["body 1: bracket"] == told["region 1: bracket"] == 1
    assert told['title: A "jig" & <more>'] == 1
    assert told[f"version: amontons {am.__version__}"] == 1


def test_a_rigid_body_has_no_stress(tmp_path):
    model = pressed(2)
    rigid = am.Body(model.bodies[0].mesh, am.Rigid(), "low")
    am.solve(am.Model([rigid, model.bodies[1]], model.supports, model.contacts)).write(
        tmp_path / "a.vtu"
    )
    found = meshio.read(tmp_path / "a.vtu")
    low = found.points[:, 1] < 1
    assert not found.point_data["stress"][low].any()
    assert found.point_data["stress"][~low].any()


# ------------------------------------------------------------------ in time
def there_and_back():
    def top(x, t):
        return (0.05 * np.interp(t, [0, 0.2, 1, 2], [0, 0, 1, 0]), -0.02 * min(1, 5 * t))

    body = am.Body(am.box((2, 1), (6, 3)), SOFT)
    pair = am.Contact("bottom", am.Plane((0, 1)), mu=0.3)
    return am.Model([body], [am.Fix("top", top)], [pair])


def mixed():
    """Squares, triangles and squares again."""
    quads, tris = am.box((1, 1), 2), am.box((1, 1), 2, kind="tri", origin=(1, 0))
    parts = [quads, tris, am.box((1, 1), 2, origin=(2, 0))]
    points = np.vstack([part.points for part in parts])
    unique, index = np.unique(points.round(9), axis=0, return_inverse=True)
    cells, facets, first = [], [], 0
    for part in parts:
        of = index.ravel()[first : first + len(part.points)]
        cells += [am.Cells(b.kind, of[b.nodes], f"r{first}") for b in part.cells]
        facets.append({name: of[part.surfaces[name][0].nodes] for name in ("bottom", "top")})
        first += len(part.points)
    surfaces = {name: (am.Facets("line", np.concatenate([f[name] for f in facets])),)
                for name in ("bottom", "top")}  # fmt: skip
    pair = am.Contact("bottom", am.Plane((0, 1)), mu=0.3)
    body = am.Body(am.Mesh(unique, tuple(cells), surfaces), SOFT)
    return am.Model([body], [am.Fix("top", (0, lambda x, t: -0.01 * t))], [pair])


@pytest.mark.parametrize("make", [there_and_back, mixed])
def test_meshio_reads_the_series(make, tmp_path):
    model = make()
    steps = list(am.export_xdmf(am.evolve(model, am.QuasiStatic(0.25), until=2), tmp_path, 2,
                                title="a & <b>"))  # fmt: skip
    assert {path.name for path in tmp_path.iterdir()} == {
        "steps.xdmf", "steps-mesh.h5", *(f"step-{k:05d}.h5" for k in (2, 4, 6, 8))
    }  # fmt: skip
    with meshio.xdmf.TimeSeriesReader(tmp_path / "steps.xdmf") as series:
        points, cells = series.read_points_cells()
        np.testing.assert_array_equal(points[:, :2], model.bodies[0].mesh.points)
        for block, own in zip(cells, model.bodies[0].mesh.cells, strict=True):
            np.testing.assert_array_equal(block.data, own.nodes)
        assert series.num_steps == 4
        for k, step in enumerate(steps[1::2]):
            time, point, cell = series.read_data(k)
            assert time == step.time
            np.testing.assert_array_equal(point["displacement"][:, :2], step.displacement[0])
            node = step.fields.node
            np.testing.assert_allclose(point["CSLIP_ACCUMULATED"][node], step.state.path)
            tensor = point["stress"].reshape(-1, 3, 3)
            np.testing.assert_array_equal(tensor, tensor.swapaxes(1, 2))
            assert sum(len(part) for part in cell["body"]) == model.bodies[0].mesh.cell_count


def test_an_export_of_another_mesh_replaces_the_first(tmp_path):
    for make in (there_and_back, mixed):
        model = make()
        next(iter(am.export_xdmf(am.evolve(model, am.QuasiStatic(1.0), until=1), tmp_path)))
    with meshio.xdmf.TimeSeriesReader(tmp_path / "steps.xdmf") as series:
        assert len(series.read_points_cells()[0]) == len(model.bodies[0].mesh.points)


def test_a_step_has_its_time(tmp_path):
    from amontons.io.vtk import write_model

    step = next(iter(am.evolve(there_and_back(), am.QuasiStatic(0.5), until=2)))
    write_model(step.model, step.fields, step, tmp_path / "a.vtu")
    assert meshio.read(tmp_path / "a.vtu").field_data["TimeValue"] == [0.5]


# ------------------------------------------------------------------ tables and arrays
def test_csv_of_pairs_and_supports(tmp_path):
    found = am.solve(pressed(3))
    found.write(tmp_path / "a.csv")
    with (tmp_path / "a.csv").open(newline="") as file:
        pair, low, up = csv.DictReader(file)
    assert (pair["kind"], pair["name"], pair["slave"], pair["master"]) == (
        "pair", "up.bottom", "up.bottom", "low.top",
    )  # fmt: skip
    assert float(pair["force_z"]) == pytest.approx(2, rel=1e-6)
    assert float(pair["area"]) == pytest.approx(1)
    assert (low["kind"], low["name"], low["area"]) == ("fix", "low.bottom", "")
    assert float(up["force_z"]) == pytest.approx(-2, rel=1e-6)
    assert float(up["moment_x"]) == pytest.approx(-1, rel=1e-6)


def test_arrays_say_what_they_are(tmp_path):
    found = am.solve(pressed(2))
    found.write(tmp_path / "a.h5")
    with h5py.File(tmp_path / "a.h5") as file:
        assert file.attrs["title"] == "two blocks"
        assert file.attrs["version"] == am.__version__
        assert "those of the input" in file.attrs["units"]
        np.testing.assert_array_equal(file["reaction/up"], found.reaction[1])
        assert file["pair"].attrs["names"].tolist() == ["up.bottom"]
        arrays = []
        file.visititems(lambda name, node: arrays.append(node))
        for node in arrays:
            if isinstance(node, h5py.Dataset):
                assert node.attrs["unit"]
                assert node.attrs["meaning"]


def test_json_has_pairs_supports_and_load(tmp_path):
    found = am.solve(pressed(2))
    data = output.summary(found.output)
    assert data["pairs"] == [found.pairs["up.bottom"].record]
    assert [held["name"] for held in data["supports"]] == ["low.bottom", "up.top"]
    assert data["load"] == {"force": [0, 0], "moment": [0], "point": [0, 0]}


def test_a_discrete_problem_has_no_pairs():
    problem = am.FrictionProblem.from_delassus([[1.0, 0.1], [0.1, 1.0]], [[-1, 0.5]], [0.3])
    data = output.summary(output.Output(am.solve(problem)))
    assert data["pairs"] is data["supports"] is data["load"] is None


def test_the_summary_tells_pair_by_pair():
    body = am.Body(am.box((1, 1), cells=3), SOFT)
    model = am.Model([body], [am.Fix("top", (0, -0.02))],
                     [am.Contact("bottom", am.Plane((0, 1)), mu=0.3),
                      am.Contact("left", am.Plane((1, 0)), mu=0.3, name="wall")])  # fmt: skip
    text = str(am.solve(model))
    assert "  bottom: force " in text
    assert "  wall: force " in text
