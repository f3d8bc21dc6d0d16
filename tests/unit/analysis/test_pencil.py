"""The search for multipliers where the largest eigenvalue is missed now and then."""

import numpy as np
import pytest

from amontons.analysis.certificates import pencil
from amontons.core.clock import NEVER


class Levels(pencil.Pencil):
    """A = 1, B = diag exp(a + x - mean x): the largest is least where all are exp(mean a)."""

    def __init__(self, a, missing=()):
        self.a, self.missing, self.seen = a, missing, []

    @property
    def size(self):
        return len(self.a)

    def energy(self, x):
        return np.eye(len(x))

    def diagonal(self, x):
        return np.exp(self.a + x - x.mean())

    def times(self, x, v):
        return self.diagonal(x)[:, None] * v

    def slope(self, x, w, v, p):
        each = self.diagonal(x) * (v**2 @ p)
        return each - each.mean()

    def largest(self, x, root):
        """Without the largest four where the last x is looked at for the first time."""
        found = super().largest(x, root)
        new = not any(np.array_equal(x, y) for y in self.seen)
        self.seen.append(x.copy())
        if new and len(self.seen) in self.missing:
            return found[0][:-4], found[1][:, :-4]
        return found


@pytest.mark.parametrize("missing", [(), (4,), (4, 9, 17)])
def test_a_missed_eigenvalue_does_not_end_the_search(monkeypatch, missing):
    monkeypatch.setattr(pencil, "DENSE", 10)  # as where eigenvalues are iterated for
    a = np.random.default_rng(1).uniform(0, 3, 24)
    form = Levels(a, missing)
    x = form.improved(np.zeros(24), 40.0, 60, NEVER, np.inf)
    assert np.log(form.diagonal(x).max()) < a.mean() + 0.01


def test_what_is_enough_is_looked_at_twice(monkeypatch):
    """A value is below the goal because the largest was missed: the search goes on."""
    monkeypatch.setattr(pencil, "DENSE", 10)
    a = np.random.default_rng(1).uniform(0, 3, 24)
    form = Levels(a, missing=(1, 2, 3))
    enough = np.exp(-a.mean() - 0.3)
    x = form.improved(np.zeros(24), 40.0, 60, NEVER, enough)
    assert form.diagonal(x).max() < 1 / enough


def test_eigenvectors_that_a_subspace_lacks_are_found_again():
    """The start is exactly across the largest eigenvector: only new directions find it."""
    n = pencil.DENSE + 40
    a = np.linspace(0, 1, n)
    a[-1] = 3.0
    form = Levels(a)
    form.subspace = np.eye(n)[:, : form.kept]
    root = form.factor(np.zeros(n))
    for _ in range(3):
        found = form.largest(np.zeros(n), root)[0][-1]
    assert np.log(found) == pytest.approx(3.0 - 0.0, abs=1e-3)
