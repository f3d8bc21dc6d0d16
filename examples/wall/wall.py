"""A wall of 12 blocks, compressed by 30 kN, then sheared at 1 mm/s (Acary et al., CSMA 2017).

Three rows of three and a half blocks between two rigid supports.  The paper gives densities,
moduli, friction and loads; its 7212 unknowns are those of 8 x 4 x 4 cells per block, 3 * 2400,
and 6 for each support.  The size of the blocks, 0.4 x 0.2 x 0.2 m, the time step and the order
of the loads are ours.

Usage: python wall.py [steps]
"""

import sys
import time

import amontons as am

COMPRESSION = 30e3  # N
SPEED = 1e-3  # m/s
GRIP = 0.1  # s, until a tenth of the compression is there; the shear starts then
RAMP = 4.0  # s from then on, until all of it is there


def paper_wall(cells=(8, 4, 4), rows=3, blocks=3, rigid=False):
    """The wall of the paper between its supports; rigid: of rigid blocks."""
    stone = am.LinearElastic(young=2.2e9, poisson=0.2, density=2000)
    wall = am.Wall(
        rows, blocks, size=(0.4, 0.2, 0.2), cells=cells, material=stone,
        bond=am.Bond.ALTERNATING, mu=0.83, mu_support=0.53, plate=0.05, base=0.05,
        plate_material=am.Rigid(density=7800), rigid=rigid,
    )  # fmt: skip
    area = (blocks + 0.5) * 0.4 * 0.2

    def pressure(x, t):
        part = 0.1 * min(t / GRIP, 1) + 0.9 * min(max(t - GRIP, 0) / RAMP, 1)
        return (0, 0, -COMPRESSION / area * part)

    def shear(x, t):
        return (SPEED * max(t - GRIP, 0), 0, None)

    return wall.sheared(pressure, shear)


def main(steps=100):
    """Print the energies and the cracking joints while the wall is sheared."""
    model = paper_wall()
    method = am.MoreauJean(step=1e-2, theta=1, reach=1e-5)  # theta: damps ringing
    began = time.perf_counter()
    print(f"{'t':>7} {'open':>5} {'slip':>5} {'stick':>5} {'shear force':>12} {'elastic':>9} "
          f"{'kinetic':>9} {'friction':>9} {'defect':>9} {'s/step':>7}")  # fmt: skip
    lost = 0.0
    floor = [k for k, contact in enumerate(model.contacts) if contact.master == "base.top"]
    for step in am.evolve(model, method, until=steps * method.step, tolerance=1e-8):
        e = step.energies
        lost += e.contact
        now = time.perf_counter()
        if step.state.index % 10 == 0:
            opened, slipping, sticking = ((step.status == s).sum() for s in (0, 1, 2))
            force = step.resultant(floor)[0]
            print(f"{step.time:7.3f} {opened:5d} {slipping:5d} {sticking:5d} {force:12.4g} "
                  f"{e.elastic:9.3g} {e.kinetic:9.3g} {lost:9.2e} {e.defect:9.1e} "
                  f"{(now - began) / step.state.index:7.3f}")  # fmt: skip


if __name__ == "__main__":
    main(*(int(argument) for argument in sys.argv[1:2]))
