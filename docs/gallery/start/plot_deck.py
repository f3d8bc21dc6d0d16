r"""
A deck of CalculiX or Abaqus
============================

An input deck that stands in a drawer is a model: ``amontons solve model.inp``, or as here from Python. What changes the answer
and is not read is an error with its line; what is skipped is said.
"""

# %%
# A small block on a larger one, each one element of the kind C3D8, as another program would run it: surfaces of element faces, a
# contact pair with friction, supports, a pressure that presses and a force that pushes.
import tempfile
from pathlib import Path

import amontons as am

DECK = """
*HEADING
Small block on a large one
*NODE, NSET=ALL
 1, 0, 0, 0
 2, 3, 0, 0
 3, 3, 2, 0
 4, 0, 2, 0
 5, 0, 0, 1
 6, 3, 0, 1
 7, 3, 2, 1
 8, 0, 2, 1
11, 1, 0.5, 1
12, 2, 0.5, 1
13, 2, 1.5, 1
14, 1, 1.5, 1
15, 1, 0.5, 2
16, 2, 0.5, 2
17, 2, 1.5, 2
18, 1, 1.5, 2
*NSET, NSET=GROUND
1, 2, 3, 4
*NSET, NSET=PUSHED
15, 18
*ELEMENT, TYPE=C3D8, ELSET=LARGE
1, 1, 2, 3, 4, 5, 6, 7, 8
*ELEMENT, TYPE=C3D8, ELSET=SMALL
2, 11, 12, 13, 14, 15, 16, 17, 18
*SURFACE, NAME=TABLE
LARGE, S2
*SURFACE, NAME=FOOT
SMALL, S1
*MATERIAL, NAME=STEEL
*ELASTIC
210000, 0.3
*SOLID SECTION, ELSET=LARGE, MATERIAL=STEEL
*SOLID SECTION, ELSET=SMALL, MATERIAL=STEEL
*SURFACE INTERACTION, NAME=RUB
*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=HARD
*FRICTION
0.2
*CONTACT PAIR, INTERACTION=RUB, TYPE=SURFACE TO SURFACE
FOOT, TABLE
*BOUNDARY
GROUND, 1, 3
*STEP
*STATIC
0.25, 1
*DLOAD
2, P2, 10
*CLOAD
PUSHED, 1, 0.5
*NODE FILE
U
*END STEP
"""
with tempfile.TemporaryDirectory() as folder:
    path = Path(folder) / "blocks.inp"
    path.write_text(DECK)
    case = am.read_case(path)
solution = am.solve(case.model)
solution

# %%
# Forces of contact pairs and supports balance the loads of the deck: 10 down and 1 along x.
for name, pair in solution.pairs.items():
    print(name, "force on the slave", pair.force.round(6))
for name, support in solution.supports.items():
    print(name, "force of the support", support.force.round(6))

# %%
# The bodies with the status of their contacts, and the contact itself: pushed from the left, the left edge of the foot has
# less pressure.
solution.plot()
