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
ONE, THREE, NINE, WHOLE = (ir.Constant(LONG, count) for count in (1, 3, 9, LANES))
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


def _emit_sum_back(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    """The loop of `product_of_blocks_back`, and the sums of its lanes."""
    data, indices, r = _pointers(context, builder, signature.args[:3], arguments[:3])
    first, last = arguments[3:]
    sums = [cgutils.alloca_once_value(builder, NOTHING) for _ in range(3)]
    end = builder.sub(builder.add(first, last), ONE)
    with cgutils.for_range_slice(builder, first, last, ONE, intp=LONG) as (step, _):
        _add_block(builder, data, indices, r, builder.sub(end, step), sums)
    return _sums_of_lanes(context, builder, signature, sums)


def _add_block(builder: Any, data: Any, indices: Any, r: Any, k: Any, sums: Any) -> None:
    """sums += rows of data_k times r_j, j = indices_k, lane by lane."""
    x, block = _row(builder, r, _at(builder, indices, k, THREE)), builder.mul(k, NINE)
    for a, total in enumerate(sums):
        row = _row(builder, data, block, a)
        builder.store(_added(builder, row, x, builder.load(total)), total)


def _sums_of_lanes(context: Any, builder: Any, signature: Any, sums: Any) -> Any:
    found = []
    for total in sums:
        x, y, z = _lanes(builder, builder.load(total))
        found.append(builder.fadd(builder.fadd(x, y), z))
    return context.make_tuple(builder, signature.return_type, found)


def _everywhere(builder: Any, number: Any) -> Any:
    """A number in all lanes."""
    lane = builder.insert_element(NOTHING, number, ir.Constant(INT, 0))
    return builder.shuffle_vector(lane, NOTHING, FIRST)


def _emit_spread(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    """The loop of `spread_blocks_inplace`; the empty lane gets nothing."""
    data, indices, out = _pointers(context, builder, signature.args[:3], arguments[:3])
    first, last, *x = arguments[3:]
    x = [_everywhere(builder, number) for number in x]
    with cgutils.for_range_slice(builder, first, last, ONE, intp=LONG) as (k, _):
        target = builder.gep(out, [_at(builder, indices, k, WHOLE)])
        here, block = builder.bitcast(target, FOUR.as_pointer()), builder.mul(k, NINE)
        total = builder.load(here, align=BYTES)
        for a in range(3):
            total = _added(builder, _row(builder, data, block, a), x[a], total)
        builder.store(total, here, align=BYTES)
    return context.get_dummy_value()


def _emit_add(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    """`add_block_inplace`: nine numbers, twice four and one."""
    out, t, weight, blocks, k = arguments
    kinds = signature.args[0], signature.args[3]
    begins = _pointers(context, builder, kinds, (out, blocks))
    begins = [
        builder.gep(array, [builder.mul(number, NINE)])
        for array, number in zip(begins, (t, k), strict=True)
    ]
    lanes = _everywhere(builder, weight)
    for n in (0, LANES):
        target, given = (
            builder.bitcast(builder.gep(array, [ir.Constant(LONG, n)]), FOUR.as_pointer())
            for array in begins
        )
        total, numbers = (builder.load(at, align=BYTES) for at in (target, given))
        builder.store(_added(builder, lanes, numbers, total), target, align=BYTES)
    target, given = (builder.gep(array, [ir.Constant(LONG, 2 * LANES)]) for array in begins)
    product = builder.fmul(weight, builder.load(given))
    builder.store(builder.fadd(builder.load(target), product), target)
    return context.get_dummy_value()


def _emit_sum(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    """The loop of `product_of_blocks`, and the sums of its lanes."""
    data, indices, r = _pointers(context, builder, signature.args[:3], arguments[:3])
    first, last, without = arguments[3:]
    sums = [cgutils.alloca_once_value(builder, NOTHING) for _ in range(3)]
    for begin, end in ((first, without), (builder.add(without, ONE), last)):
        with cgutils.for_range_slice(builder, begin, end, ONE, intp=LONG) as (k, _):
            _add_block(builder, data, indices, r, k, sums)
    return _sums_of_lanes(context, builder, signature, sums)


def _emit_rows(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    """The loop of `subtract_products_inplace`; the nine numbers of L_l stay in registers."""
    work, columns, U, L = _pointers(context, builder, signature.args[:4], arguments[:4])
    l, first, last = arguments[4:]
    minus, own = [], builder.mul(l, NINE)
    for n in range(9):
        number = builder.load(builder.gep(L, [builder.add(own, ir.Constant(LONG, n))]))
        minus.append(_everywhere(builder, builder.fneg(number)))
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


def _product_of_blocks_back(typing, data, indices, r, first, last):  # noqa: ARG001, PLR0913
    """The same from the last block to the first, with none left out."""
    returned = types.UniTuple(types.float64, 3)
    return returned(data, indices, r, place, place), _emit_sum_back


def _spread_blocks_inplace(typing, data, indices, out, first, last, x0, x1, x2):  # noqa: ARG001, PLR0913
    """out_j += data_k^T (x0, x1, x2), j = indices_k, for first <= k < last; out (., 4)."""
    number = types.float64
    given = data, indices, out, place, place, number, number, number
    return types.void(*given), _emit_spread


def _add_block_inplace(typing, out, t, weight, blocks, k):  # noqa: ARG001, PLR0913
    """out_t += weight blocks_k, both (., 3, 3)."""
    return types.void(out, place, types.float64, blocks, place), _emit_add


def _subtract_products_inplace(typing, work, columns, U, L, l, first, last):  # noqa: ARG001, PLR0913
    """work_t -= L_l U_j, t = columns_j, for first <= j < last; blocks (., 3, 3), contiguous."""
    return types.void(work, columns, U, L, place, place, place), _emit_rows


def _product_in_python(data, indices, r, first, last, without):  # noqa: PLR0913
    blocks = [k for k in range(int(first), int(last)) if k != without]
    return tuple(sum((data[k] @ r[indices[k]] for k in blocks), np.zeros(3)))


def _product_back_in_python(data, indices, r, first, last):
    return _product_in_python(data, indices, r, first, last, last)


def _spread_in_python(data, indices, out, first, last, *x):  # noqa: PLR0913
    for k in range(int(first), int(last)):
        out[indices[k], :3] += data[k].T @ x


def _add_in_python(out, t, weight, blocks, k):  # noqa: PLR0913
    out[t] += weight * blocks[k]


def _subtract_in_python(work, columns, U, L, l, first, last):  # noqa: PLR0913
    for j in range(int(first), int(last)):
        work[columns[j]] -= L[l] @ U[j]


add_block_inplace: Any
product_of_blocks: Any
product_of_blocks_back: Any
spread_blocks_inplace: Any
subtract_products_inplace: Any
if config.DISABLE_JIT:
    add_block_inplace = _add_in_python
    product_of_blocks, product_of_blocks_back = _product_in_python, _product_back_in_python
    spread_blocks_inplace, subtract_products_inplace = _spread_in_python, _subtract_in_python
else:
    add_block_inplace = intrinsic(_add_block_inplace)
    product_of_blocks = intrinsic(_product_of_blocks)
    product_of_blocks_back = intrinsic(_product_of_blocks_back)
    spread_blocks_inplace = intrinsic(_spread_blocks_inplace)
    subtract_products_inplace = intrinsic(_subtract_products_inplace)
__all__ = [
    "add_block_inplace", "product_of_blocks", "product_of_blocks_back",
    "spread_blocks_inplace", "subtract_products_inplace",
]  # fmt: skip
