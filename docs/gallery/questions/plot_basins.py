r"""
Which solution does a method find?
==================================

Where there are several, start, method and parameters decide. ``am.basins`` makes the table: methods by values of their
parameters by starts, each run told by the nearest of all solutions.
"""

# %%
# Hild's triangle at :math:`\mu = 3.5`. *Uzawa* with three values of its parameter, *semismooth Newton*, and the portfolio
# ``auto``, from zero, from random reactions in the cone, and from each solution itself.
import amontons as am

model = am.read_case("example:hild").model
found = am.basins(
    model,
    ["auto", "uzawa", "semismooth-newton"],
    {"uzawa.rho": [0.1, 1, 10]},
    {"zero": 1, "cone": 8, "exact": 1},
    seed=0,
)
print(found)

# %%
# A cell to each run, coloured by the solution at which it ended. Sweeps that start at the unstable solution stay there only as long as rounding lets them; Newton's
# method finds whatever is near.
found.plot()
