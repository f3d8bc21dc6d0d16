"""FCLib's HDF5 exchange format: read and write discrete problems, number for number.

    fclib_local/  spacedim, W/, vectors/{q, mu}, info/{title, description, math_info}
    fclib_global/ spacedim, M/, H/, vectors/{f, w, mu}, info/…
    solution/     r, u[, v]   (optional)

A sparse group holds m, n, nz, nzmax, p, i, x.  nz >= 0: triplets, p the columns and i the rows;
nz = -1: compressed columns; -2: compressed rows.  Indices start at 0, duplicates are summed.

A file that is read and written again keeps numbers, storage, texts byte for byte with their
types, and the attributes of the groups info, W, M and H that are numbers or texts.  Dropped are
other attributes and further datasets.

Files that lead elsewhere (links, raw or virtual data sets) or unpack to far more than they
store are refused before anything is read.

Left out: bilateral constraints (G, b; V, R, s), which raise an error, and the groups `solution`
and `guesses` of a file, which are not read: in the published files they are all zero.
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
