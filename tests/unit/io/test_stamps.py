"""A result that has not converged can not be taken for a good one, wherever it is shown."""

from dataclasses import replace

import h5py
import meshio
import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg

import amontons as am
from amontons.io.plots import (
    Frame,
    branch_figure,
    convergence_figure,
    energy_figure,
    picture,
    series_figure,
    solutions_figure,
    status_figure,
    step_figure,
)
from amontons.mechanics.ready import gallery
from amontons.mechanics.steps import Energies

WORDS = "NOT CONVERGED"


def pressed(dim):
    """A block on a ball."""
    centre = (0.5,) * (dim - 1) + (-4.0,)
    return am.Model(
        [am.Body(am.box((1,) * dim, cells=4), am.LinearElastic(200.0, 0.3))],
        [am.Fix("top", (0.02,) + (0.0,) * (dim - 2) + (-0.05,))],
        [am.Contact("bottom", am.Sphere(center=centre, radius=4.0), mu=0.4)],
        name="block",
    )


def stopped(problem):
    """One sweep, which is not enough."""
    return am.solve(problem, am.GaussSeidel(batch=1), max_iterations=1, check=False)


def words_of(figure):
    """All texts of a figure and its panels, without what is in titles and axes."""
    figure.savefig("/dev/null", format="png")  # it can be drawn
    panels = [text for axes in figure.axes for text in axes.texts]
    return " | ".join(text.get_text() for text in [*figure.texts, *panels])


def status_of(solution):
    if isinstance(solution, am.FrictionSolution):
        return status_figure(solution)
    return status_figure(solution.solution, solution.fields, "block", solution.model)


@pytest.mark.parametrize("problem", [pressed(2), pressed(3), gallery.random_delassus(3, 8, 3)])
def test_figures_of_a_solution(problem):
    good, bad = am.solve(problem), stopped(problem)
    assert not bad.converged
    model = problem if isinstance(problem, am.Model) else None
    for draw in (
        status_of,
        lambda s: convergence_figure(s.convergence, "block"),
        lambda s: solutions_figure([getattr(s, "solution", s)], model=model),
    ):
        told = words_of(draw(bad))
        assert WORDS in told
        assert "max iterations" in told
        assert f"{bad.convergence.error:.1e}" in told.replace("\n", " ")
        assert "NOT" not in words_of(draw(good))


def test_the_title_stays_below_the_stamp():
    figure = status_of(stopped(pressed(2)))
    assert figure.get_suptitle().strip() == "block"
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    renderer = canvas.get_renderer()
    band = next(t for t in figure.texts if t.get_text().startswith(f"{WORDS} ("))
    title = next(a for a in figure.axes)
    box = band.get_window_extent(renderer)
    assert box.x0 >= 0
    assert box.x1 <= figure.bbox.width
    assert title.get_window_extent(renderer).y1 < box.y0


def test_only_the_panel_that_is_wrong_is_stamped():
    problem = pressed(2)
    figure = solutions_figure(
        [am.solve(problem).solution, stopped(problem).solution], model=problem
    )
    first, second = (" ".join(t.get_text() for t in axes.texts) for axes in figure.axes)
    assert WORDS not in first
    assert WORDS in second


def test_pictures_of_steps():
    model = pressed(2)
    (step,) = am.evolve(model, am.QuasiStatic(1.0), until=1.0)
    failed = replace(step, solution=stopped(model).solution)
    good, bad = Frame.of(step), Frame.of(failed)
    assert WORDS in words_of(step_figure(model, bad))
    assert WORDS not in words_of(step_figure(model, good))
    assert WORDS in words_of(series_figure(model, [good, bad]))
    assert WORDS not in words_of(series_figure(model, [good, good]))
    stamp = failed.solution.convergence.stamp
    assert WORDS in words_of(energy_figure([1.0], [step.energies], note=stamp))
    assert WORDS not in words_of(energy_figure([1.0], [step.energies]))


@pytest.mark.parametrize(("contact", "scale"), [(0.0, "linear"), (-1.0, "log")])
def test_energies_without_any_work_are_drawn_without_a_warning(contact, scale):
    figure = energy_figure([0.5], [Energies(contact=contact, loads=-contact)])
    assert len(picture(figure)) > 1000
    assert figure.axes[1].get_yscale() == scale


@pytest.mark.parametrize(("contact", "words"), [
    (2e-11, "creates no energy beyond the solve's error"), (1e-3, "Contact creates energy"),
    (-0.5, "creates no energy: largest"),
])  # fmt: skip
def test_energy_that_contact_gains_within_the_tolerance_is_no_alarm(contact, words):
    steps = [Energies(contact=contact, loads=1.0, gain=1.0 + contact)]
    assert words in energy_figure([0.5], steps).axes[1].get_title()


def test_a_branch_that_is_cut_off():
    model = pressed(2)
    assert "NOT FINISHED" in words_of(branch_figure(am.follow(model, max_points=2)))
    assert "NOT FINISHED" not in words_of(branch_figure(am.follow(model)))


def test_files(tmp_path):
    for solve, converged in ((am.solve, 1), (stopped, 0)):
        solution = solve(pressed(3))
        solution.write(tmp_path / "s.vtu")
        solution.write(tmp_path / "s.h5")
        found = meshio.read(tmp_path / "s.vtu")
        assert found.field_data["CONVERGED"] == [converged]
        assert found.field_data["ERROR"] == pytest.approx([solution.convergence.error])
        assert (np.concatenate(found.cell_data["CONVERGED"]) == converged).all()
        assert ((WORDS in (tmp_path / "s.vtu").read_text()) is (not converged))
        with h5py.File(tmp_path / "s.h5") as file:
            assert file.attrs["converged"] == converged
            assert file.attrs["outcome"] == solution.convergence.outcome.name.lower()
        assert ((WORDS in str(solution)) is (not converged))
