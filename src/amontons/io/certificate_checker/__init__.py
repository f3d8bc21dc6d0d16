"""Checks certificates with numpy and h5py alone: python -m certificate_checker c.h5.

What is claimed and why it follows is in docs/certificates.md.  `numbers` holds what the proofs
share, `contacts` those by a few numbers of every contact, `patterns` and `lists` those by all
patterns of statuses, in 2D, `curves` with `boxes` and `tubes` all solutions in 3D.
"""

import hashlib

import h5py
import numpy as np

from .contacts import about, every_load
from .curves import curves
from .lists import lines
from .numbers import Refused, need
from .patterns import tree

__all__ = ["Refused", "check", "digest", "proves"]


def proves(claim, data):
    """What arrays prove, in a sentence; raises Refused where they do not prove the claim."""
    W, q, mu = data["W"], data["q"], data["mu"]
    (nc, d), real = q.shape, [x for x in data.values() if x.dtype.kind == "f"]
    need(W.shape == (nc * d, nc * d) and mu.shape == (nc,) and d in (2, 3), "shapes differ")
    need(all(np.isfinite(x).all() for x in real) and (mu >= 0).all(), "bad numbers")
    if claim == "every load":
        every_load(**data)
        return f"{nc} contacts: every load has exactly one solution."
    if claim == "this load":
        far = (about if "tau" in data else tree)(**data)
        need(far <= data["distance"], f"solutions are only within {far:.1e} of r0")
        return f"{nc} contacts: every solution of this load is within {far:.1e} of r0."
    need(claim in ("all solutions", "all branches"), f"unknown claim {claim!r}")
    return f"{nc} contacts: {(curves if 'tree' in data else lines)(**data)}."


def check(path):
    """What a file proves, in a sentence; raises Refused where it does not prove its claim."""
    with h5py.File(path, "r") as file:
        told = [np.asarray(file.attrs[name]).tobytes() for name in ("claim", "sha256")]
        claim, hashed = (words.decode() for words in told)
        need(hashed == digest(file), "the file was changed: another SHA-256")
        return proves(claim, {k: np.asarray(file[k]) for k in file})


def digest(file):
    """SHA-256 of all that the claim depends on."""
    parts = [str(sorted((k, str(v)) for k, v in file.attrs.items() if k != "sha256"))]
    for name in sorted(file):
        data = np.asarray(file[name])
        parts += [name, str(data.dtype), str(data.shape), data.tobytes().hex()]
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()
