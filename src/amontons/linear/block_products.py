"""Products of 3x3 blocks, four numbers at a time.

Sweeps and judges take most of their time in sums over j of W_ij r_j, factors in B -= L U, which
the compiler leaves as products one after another: no loop over three numbers is long enough for
it.  Here a row of a block is one load of four lanes, the last one empty, in half of the time.
The functions emit these lines of LLVM's language; processors without such lanes get what they
have.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from llvmlite import ir
from numba.core import cgutils, config, types
from numba.extending import intrinsic

LANES, BYTES = 4, 8
DOUBLE, LONG, INT = ir.DoubleType(), ir.IntType(64), ir.IntType(32)
FOUR = ir.VectorType(DOUBLE, LANES)
THREE_OF_THEM = ir.Constant(ir.VectorType(ir.IntType(1), LANES), [1, 1, 1, 0])
FIRST = ir.Constant(ir.VectorType(INT, LANES), [0] * LANES)
NOTHING = ir.Constant(FOUR, [0.0] * LANES)
ONE, THREE, NINE = (ir.Constant(LONG, count) for count in (1, 3, 9))
place = types.uint64


# ---------------------------------------------------------------- lines of LLVM
def _pointers(context: Any, builder: Any, kinds: Any, arrays: Any) -> list[Any]:
    """Where the numbers of contiguous arrays begin."""
    return [
        context.make_array(kind)(context, builder, array).data
        for kind, array in zip(kinds, arrays, strict=True)
    ]


def _row(builder: Any, numbers: Any, first: Any, a: int = 0) -> Any:
    """Three numbers, row a of what begins at `first`, and a zero: no more is read."""
    kinds = [FOUR.as_pointer(), INT, THREE_OF_THEM.type, FOUR]
    load = cgutils.get_or_insert_function(
        builder.module, ir.FunctionType(FOUR, kinds), "llvm.masked.load.v4f64.p0"
    )
    at = builder.gep(numbers, [builder.add(first, ir.Constant(LONG, 3 * a))])
    here = builder.bitcast(at, FOUR.as_pointer())
    return builder.call(load, [here, ir.Constant(INT, BYTES), THREE_OF_THEM, NOTHING])


def _added(builder: Any, x: Any, y: Any, total: Any) -> Any:
    """x y + total, in one rounding where the processor can."""
    fused = cgutils.get_or_insert_function(
        builder.module, ir.FunctionType(FOUR, [FOUR] * 3), "llvm.fmuladd.v4f64"
    )
    return builder.call(fused, [x, y, total])


def _lanes(builder: Any, row: Any) -> list[Any]:
    return [builder.extract_element(row, ir.Constant(INT, b)) for b in range(3)]


def _at(builder: Any, indices: Any, k: Any, size: Any) -> Any:
    """Where what indices[k] names begins, each of so many numbers."""
    return builder.mul(builder.zext(builder.load(builder.gep(indices, [k])), LONG), size)


def _emit_sum(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    """The loop of `product_of_blocks`, and the sums of its lanes."""
    data, indices, r = _pointers(context, builder, signature.args[:3], arguments[:3])
    first, last, without = arguments[3:]
    sums = [cgutils.alloca_once_value(builder, NOTHING) for _ in range(3)]
    for begin, end in ((first, without), (builder.add(without, ONE), last)):
        with cgutils.for_range_slice(builder, begin, end, ONE, intp=LONG) as (k, _):
            x, block = _row(builder, r, _at(builder, indices, k, THREE)), builder.mul(k, NINE)
            for a, total in enumerate(sums):
                row = _row(builder, data, block, a)
                builder.store(_added(builder, row, x, builder.load(total)), total)
    found = []
    for total in sums:
        x, y, z = _lanes(builder, builder.load(total))
        found.append(builder.fadd(builder.fadd(x, y), z))
    return context.make_tuple(builder, signature.return_type, found)


def _emit_rows(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    """The loop of `subtract_products_inplace`; the nine numbers of L_l stay in registers."""
    work, columns, U, L = _pointers(context, builder, signature.args[:4], arguments[:4])
    l, first, last = arguments[4:]
    minus, own = [], builder.mul(l, NINE)
    for n in range(9):
        number = builder.load(builder.gep(L, [builder.add(own, ir.Constant(LONG, n))]))
        lane = builder.insert_element(NOTHING, builder.fneg(number), ir.Constant(INT, 0))
        minus.append(builder.shuffle_vector(lane, NOTHING, FIRST))
    with cgutils.for_range_slice(builder, first, last, ONE, intp=LONG) as (j, _):
        block, target = builder.mul(j, NINE), _at(builder, columns, j, NINE)
        rows = [_row(builder, U, block, b) for b in range(3)]
        for a in range(3):
            total = _row(builder, work, target, a)
            for b in range(3):
                total = _added(builder, minus[3 * a + b], rows[b], total)
            for b, number in enumerate(_lanes(builder, total)):
                at = builder.add(target, ir.Constant(LONG, 3 * a + b))
                builder.store(number, builder.gep(work, [at]))
    return context.get_dummy_value()


# ---------------------------------------------------------------- what numba sees
def _product_of_blocks(typing, data, indices, r, first, last, without):  # noqa: ARG001, PLR0913
    """(3,) sum_k data_k r_j, j = indices_k, of blocks first to last - 1 but `without`.

    data (., 3, 3), indices (.,) of 32 bits, r (., 3), all contiguous; without: `last` for none.
    """
    returned = types.UniTuple(types.float64, 3)
    return returned(data, indices, r, place, place, place), _emit_sum


def _subtract_products_inplace(typing, work, columns, U, L, l, first, last):  # noqa: ARG001, PLR0913
    """work_t -= L_l U_j, t = columns_j, for first <= j < last; blocks (., 3, 3), contiguous."""
    return types.void(work, columns, U, L, place, place, place), _emit_rows


def _product_in_python(data, indices, r, first, last, without):  # noqa: PLR0913
    blocks = [k for k in range(int(first), int(last)) if k != without]
    return tuple(sum((data[k] @ r[indices[k]] for k in blocks), np.zeros(3)))


def _subtract_in_python(work, columns, U, L, l, first, last):  # noqa: PLR0913
    for j in range(int(first), int(last)):
        work[columns[j]] -= L[l] @ U[j]


product_of_blocks: Any
subtract_products_inplace: Any
if config.DISABLE_JIT:
    product_of_blocks, subtract_products_inplace = _product_in_python, _subtract_in_python
else:
    product_of_blocks = intrinsic(_product_of_blocks)
    subtract_products_inplace = intrinsic(_subtract_products_inplace)
__all__ = ["product_of_blocks", "subtract_products_inplace"]
