"""A solved model in 3D, to be turned, by PyVista: the fields are those of the VTU file."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

from ...core.errors import InvalidInput
from ..results import Output, write
from .tables import needed


def view(
    result: Any, *, scalars: str = "von_mises", magnify: float = 1.0, show: bool = True,
    off_screen: bool | None = None,
) -> Any:  # fmt: skip
    """The PyVista plotter of a solved model, shown unless `show` is False."""
    output = getattr(result, "output", None)
    if not isinstance(output, Output) or output.model is None:
        raise InvalidInput(f"view: expected a solved model, got a {type(result).__name__}")
    pyvista = needed("pyvista", "view")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "solution.vtu"
        write(output, path)
        grid = pyvista.read(path)
    known = [*grid.point_data.keys(), *grid.cell_data.keys()]
    if scalars not in known:
        raise InvalidInput(f"scalars: expected one of {', '.join(known)}, got {scalars!r}")
    plotter = pyvista.Plotter(off_screen=off_screen)
    moved = grid.warp_by_vector("displacement", factor=magnify)
    plotter.add_mesh(moved, scalars=scalars, show_edges=grid.n_cells < 20_000)
    plotter.add_mesh(grid.extract_feature_edges(), color="grey", line_width=1)
    if stamp := output.solution.convergence.stamp:
        plotter.add_text(stamp, color="red", font_size=10)
    if output.model.bodies[0].mesh.dim == 2:
        plotter.view_xy()
    plotter.add_axes()
    if show:
        plotter.show()
    return plotter
