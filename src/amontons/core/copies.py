"""Arrays copied into others inside of kernels, by loops.

`target[:] = source` in a kernel brings numba's error for shapes that differ, with the text in
which it names them: half of what such a kernel takes to compile, in every kernel that does so.
Shapes are not compared here: a source that is smaller than its target is read beyond its end.
"""

from .compiled import njit


@njit(cache=True, error_model="numpy")
def copy_inplace(source, target):
    """The target (n,) becomes the first n numbers of the source."""
    for i in range(len(target)):
        target[i] = source[i]


@njit(cache=True, error_model="numpy")
def copy_rows_inplace(source, target):
    """The target (n, m) becomes the first n rows and m columns of the source."""
    for i in range(target.shape[0]):
        for j in range(target.shape[1]):
            target[i, j] = source[i, j]
