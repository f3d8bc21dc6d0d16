r"""
Critical friction falls with the mesh
=====================================

Up to which friction is *every* load of a body safe? The answer of a coarse mesh does not carry over to a fine one.

``am.critical_friction`` gives bounds with proof: below ``lower`` all linear problems have a positive determinant, at ``upper`` one is
singular, and ``witness`` shows which.
"""

# %%
import matplotlib.pyplot as plt

import amontons as am
from amontons.mechanics.ready.hild import hild_triangle

sizes = (1, 2, 3, 4, 6, 8, 10)
exact, safe, full = [], [], []
for n in sizes:
    model = hild_triangle(n)
    bounds = am.critical_friction(model)
    exact.append((bounds.lower + bounds.upper) / 2)
    safe.append(am.p_matrix_friction(model).lower)
    full.append(am.full_contact_friction(model).lower)
print(bounds)

# %%
# Two older criteria beside it. The P-matrix criterion is safe, and on these meshes hardly
# below the truth. *Full contact* looks only at patterns without
# open contacts, and promises too much: above the blue line
# some load has three solutions.
figure, axis = plt.subplots(figsize=(7, 4), layout="constrained")
axis.plot(sizes, exact, "o-", label="critical friction")
axis.plot(sizes, safe, "s--", label="P-matrix")
axis.plot(sizes, full, "^--", label="full contact")
axis.set(xlabel="contacts", ylabel="friction", ylim=(0, None))
axis.legend()
