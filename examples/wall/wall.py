"""A wall of 12 blocks, compressed by 30 kN, then sheared at 1 mm/s (Acary et al., CSMA 2017).

The paper gives densities, moduli, friction and loads; the size of the blocks, their mesh and
the time step are ours: 0.4 x 0.2 x 0.2 m, 8 x 4 x 4 cells, five rows of two blocks with half
blocks at the ends.  That makes 685 contacts and 7240 unknowns, next to the paper's 7212; its
2064 are the rows of H (3 x 688), ours has 2055.

Usage: python wall.py [steps]
"""

import sys
import time

import amontons as am

COMPRESSION = 30e3  # N
SPEED = 1e-3  # m/s
RAMP = 0.05  # s, until the compression is complete; the shear starts then


def paper_wall(cells=(8, 4, 4), rows=5, blocks=2):
    """The wall of the paper under its plate."""
    stone = am.LinearElastic(young=2.2e9, poisson=0.2, density=2000)
    steel = am.LinearElastic(young=2.1e11, poisson=0.3, density=7800)
    wall = am.Wall(
        rows, blocks, size=(0.4, 0.2, 0.2), cells=cells, material=stone,
        mu=0.83, mu_support=0.53, plate=0.05, plate_material=steel,
    )  # fmt: skip
    area = blocks * 0.4 * 0.2

    def pressure(x, t):
        return (0, 0, -COMPRESSION / area * min(t / RAMP, 1))

    def shear(x, t):
        return (SPEED * max(t - RAMP, 0), 0, None)

    return wall.sheared(pressure, shear)


def main(steps=400):
    """Print the energies and the cracking joints while the wall is sheared."""
    model = paper_wall()
    method = am.MoreauJean(step=1e-3, theta=1)  # damps the ringing of the joints
    began = time.perf_counter()
    print(f"{'t':>7} {'open':>5} {'slip':>5} {'stick':>5} {'shear force':>12} {'elastic':>9} "
          f"{'kinetic':>9} {'friction':>9} {'defect':>9} {'s/step':>7}")  # fmt: skip
    lost = 0.0
    floor = [k for k, contact in enumerate(model.contacts) if contact.obstacle is not None]
    for step in am.evolve(model, method, until=steps * method.step, tolerance=1e-6):
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
