"""FCLib's HDF5 exchange format: read and write discrete problems, number for number.

    fclib_local/  spacedim, W/[, V/, R/], vectors/{q, mu[, s]},
                  info/{title, description, math_info}
    fclib_global/ spacedim, M/, H/[, G/], vectors/{f, w, mu[, b]}, info/…
    solution/     r, u[, v][, l]   (optional)

with equality constraints (G, b; V, R, s), see `problem.equalities`: M, H, f, w or W, q of the
problem hold them eliminated, a file that is written has them again, and their multipliers l.
A problem that was changed afterwards, or condensed, is written as it is, without constraints.

A sparse group holds m, n, nz, nzmax, p, i, x.  nz >= 0: triplets, p the columns and i the rows;
nz = -1: compressed columns; -2: compressed rows.  Indices start at 0, duplicates are summed.

A file that is read and written again keeps numbers, storage, texts byte for byte with their
types, and the attributes of the groups info and of matrices that are numbers or texts.  Dropped
are other attributes and further datasets.

Files that lead elsewhere (links, raw or virtual data sets) or unpack to far more than they
store are refused before anything is read.

Left out: the groups `solution` and `guesses` of a file, which are not read: in the published
files they are all zero; and fclib_global_rolling.
"""

from .memory import hdf5_bytes, write_hdf5
from .reading import read_fclib
from .source import DAMAGE
from .stored import FclibProblem, StoredMatrix, StoredText
from .writing import put_arrays, put_fclib, write_fclib

__all__ = [
    "DAMAGE",
    "FclibProblem",
    "StoredMatrix",
    "StoredText",
    "hdf5_bytes",
    "put_arrays",
    "put_fclib",
    "read_fclib",
    "write_fclib",
    "write_hdf5",
]
