r"""
A column that is pushed over
============================

Five rigid blocks stand on each other under their weight. Which push sideways, as a share of that weight, do they stand at most?

By hand: the column, b wide and h high, turns about its lowest edge at :math:`b / h = 0.4`, unless its joints slide before, at
:math:`\mu = 0.7`. Limit analysis finds the way on which it moves by itself.
"""

# %%
# The weight is the dead load, a force per volume sideways the live one. ``lower`` and ``upper`` are proved: below the one
# the column stands whatever has happened to it before, beyond the other nothing balances the loads.
import amontons as am

column = am.read_case("example:column").model
sideways = [am.BodyForce((1.0, 0.0))]
print(am.collapse_load(column, sideways))

# %%
# With less friction in the joints it slides: at :math:`\mu` instead of 0.4.
import matplotlib.pyplot as plt
import numpy as np

frictions = np.linspace(0.1, 0.7, 13)
bounds = [am.collapse_load(column.with_mu(mu), sideways) for mu in frictions]
figure, axis = plt.subplots(figsize=(7, 4), layout="constrained")
axis.plot(frictions, [one.upper for one in bounds], label="nothing balances beyond")
axis.plot(frictions, [one.lower for one in bounds], "--", label="it stands below")
axis.axhline(0.4, color="k", ls=":", label="b / h")
axis.set(xlabel="coefficient of friction", ylabel="push / weight")
axis.legend()
