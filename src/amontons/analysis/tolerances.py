"""When two numbers count as one in questions about problems, and why.

All of scaled variables (`scaled`), where blocks of W, loads and reactions are near 1, so that
one value serves everywhere.  Newton's method ends at 1e-13 of the reactions there, double
precision at 1e-16.

PROOFS: a certified statement rests on these.  They enter its bounds, are part of what it says
(`resolution`, `distance`), or decide that it is not made.  What rounding itself can do is not
here: `multipliers.rounding` bounds it operation by operation.
HEURISTICS choose what is tried, merged or listed; the judge, `existence` or a proof has the
last word, and a poor choice costs time or an answer, never a wrong one.
Constants of a single method are with the method.
"""

from __future__ import annotations

# ---------------------------------------------------------------- proofs
DATA = 1e-13  # relative error of W, q and mu at which solutions are told apart: 500 roundings
REFERENCE = 1e-13  # error of a solution relative to its size, as Newton's method ends
SUMMED = 1e-13  # rounding of a form of seven variables relative to its terms, generously
ON = 1e-10  # distance of a reference from a border that it is on; the least `distance`
SLACK = 1e-9  # violation of the law, or distance to a border of it, that counts as none
RESOLVED = 1e-6  # load of a contact, in the largest one, that SLACK does not swallow
BELONGS = 1e-6  # from reactions to the solution that `existence` proves: nearer ones are one

# ---------------------------------------------------------------- heuristics
SOLVED = 1e-8  # error by the judge of a solution that is kept: below SAME, above Newton's end
SAME = 1e-7  # distance of two solutions, or directions of length 1, that count as one
BORDER = 1e-8  # distance from a border at which a solution is listed with both patterns
SEGMENT = 1e-12  # error by the judge of all points between two solutions of one set
REFINED = 1e-4  # distance by which refining a solution may move it
SINGULAR = 1e-10  # smallest singular value of a regular matrix, relative to the largest
