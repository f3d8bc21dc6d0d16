"""Section 6: sizes of the shell and of the body pressed into it.

The paper gives r_i = 0.7, r_a = 1, r = 0.6, h = 0.5 and d = 0.3 in a drawing.  Read here as:
half a spherical shell between r_i and r_a, fixed at r_a; a body of height h whose lower side is
a cap of radius r, up to 60 degrees, and whose top is a disc of radius d; both touch at their
lowest points.  With a top as wide as the cap the sideways force of the last example would be
2.7 times the force that presses, and tip the body over.
"""

import numpy as np

INNER, OUTER, RADIUS, HEIGHT, TOP = 0.7, 1.0, 0.6, 0.5, 0.3
ANGLE = np.pi / 3  # polar angle at the rim of the cap
RIM = RADIUS * np.sin(ANGLE)  # radius of that circle
LOW, HIGH = RADIUS * (1 - np.cos(ANGLE)) - INNER, HEIGHT - INNER  # z of rim and top
