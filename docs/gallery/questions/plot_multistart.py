r"""
Where proof is too dear: many starts
====================================

A list with proof grows exponentially with contacts. ``am.multistart`` starts Newton's method from many patterns and random
reactions, in batches, and hands back what it found. It never claims to be complete; but degree theory helps: orientations
that do not add up to one say that something is missing.
"""

# %%
import time

import matplotlib.pyplot as plt

import amontons as am
from amontons.mechanics.ready.hild import hild_triangle

sizes = (2, 4, 8, 12, 16, 20)
proof, starts, counts = [], [], []
for n in sizes:
    problem = hild_triangle(n, mu=3.5).assemble()
    began = time.process_time()
    complete = am.all_solutions(problem)
    proof.append(time.process_time() - began)
    began = time.process_time()
    found = am.multistart(problem, starts=200)
    starts.append(time.process_time() - began)
    counts.append((len(complete), len(found)))
print(counts)
print(found.reason)

# %%
# Seconds of the processor for the list with proof, and for 200 starts. Both find the same three solutions.
figure, axis = plt.subplots(figsize=(6.5, 3.8), layout="constrained")
axis.semilogy(sizes, proof, "o-", label="with proof")
axis.semilogy(sizes, starts, "s-", label="200 starts")
axis.set(xlabel="contacts", ylabel="CPU seconds")
axis.legend()
