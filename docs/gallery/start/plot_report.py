r"""
A report that turns
===================

Every result writes itself as one HTML file: bodies in 3D to be turned, both sides of each contact zone, forces, how it was judged. It needs no
network and no program but a browser, so it can be sent by mail.
"""

# %%
# A block pressed askew on a plate. On the command line the same is ``amontons solve case.toml --report``.
import html
import tempfile
from pathlib import Path

import amontons as am

plate = am.Body(am.box((3, 2, 0.5), cells=(12, 8, 2)), am.LinearElastic(young=1e4, poisson=0.3), name="plate")
block = am.Body(
    am.box((1, 1, 1), cells=(6, 6, 6), origin=(1, 0.5, 0.5)), am.LinearElastic(young=1e3, poisson=0.3), name="block"
)
model = am.Model(
    [plate, block],
    supports=[am.Fix("plate.bottom", (0, 0, 0)), am.Fix("block.top", lambda x: (0.02, 0, -0.02 * x[0] + 0.01))],
    contacts=[am.Contact("block.bottom", master="plate.top", mu=0.4)],
    name="block pressed askew",
)
solution = am.solve(model)
solution.plot()

# %%
# The report itself, in a frame: drag to turn, wheel to zoom, click a node for its numbers.


class Framed:
    """A page within this one."""

    def __init__(self, page):
        self.page = page

    def _repr_html_(self):
        return f'<iframe srcdoc="{html.escape(self.page)}" style="width:100%;height:640px"></iframe>'


with tempfile.TemporaryDirectory() as folder:
    path = solution.report(Path(folder) / "report.html", units="mm,N")
    print(f"{path.stat().st_size / 1e6:.2f} MB")
    page = path.read_text()
Framed(page)
