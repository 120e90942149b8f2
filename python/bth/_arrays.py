"""Arrays as callers pass them, to those that the native module takes."""

import numpy as np


def plain(array, name):
    """The array without a mask. One in which something is masked is refused: no answer could say that it is of nothing.

    Tensors of other packages are taken by their `numpy()` or by DLPack, from wherever they are.
    """
    if callable(getattr(array, "numpy", None)):
        array = array.detach() if hasattr(array, "detach") else array
        array = (array.cpu() if hasattr(array, "cpu") else array).numpy()
    elif hasattr(array, "__dlpack__") and not hasattr(array, "__array__"):
        array = np.from_dlpack(array)
    if isinstance(array, np.ma.MaskedArray) and np.ma.is_masked(array):
        found = f"a masked array in which {np.ma.count_masked(array)} numbers are masked"
        raise ValueError(f"{name}: expected an array without a mask, got {found}: leave them out (numpy.ma.compressed) or fill them")
    return np.asarray(array)


def read_only(array):
    """The array, which is a copy of what a scene holds: to change it would have no effect."""
    array.flags.writeable = False
    return array


def moved_by_rounding(points):
    """How far rounding points (n, 3) of float64 to float32 moves each, if that is more than 2^-24 of their size for one of them; else None."""
    with np.errstate(over="ignore"):
        moved = np.abs(points.astype(np.float32) - points).max(axis=1, initial=0)
    return moved if len(points) and moved.max() > 2.0**-24 * np.ptp(points, axis=0).max() else None


def vectors(array, name):
    """An aligned array of float32 or float64 whose last axis has three numbers; a copy only where it must be."""
    array = plain(array, name)
    if array.dtype.kind not in "fiub":
        raise TypeError(f"{name}: expected numbers, got an array of {array.dtype}")
    if array.ndim == 0 or array.shape[-1] != 3:
        if array.size == 0 and array.ndim <= 1:
            return _native_floats(array.reshape(0, 3))
        raise ValueError(f"{name}: expected the shape (..., 3), got {array.shape}")
    return _native_floats(array)


def _native_floats(array):
    """The array as float32 if that holds all numbers of its type, else as float64."""
    if array.dtype not in (np.float32, np.float64):
        with np.errstate(over="ignore"):
            array = array.astype(np.float32 if np.can_cast(array.dtype, np.float32) else np.float64)
    return array if array.flags.aligned else array.copy()


def answers(*arguments):
    """The type of the answers about these arguments: float64 if one of them is an array of it."""
    for argument in arguments:
        if isinstance(argument, np.ndarray) and argument.dtype.char == "d":
            return np.float64
    return np.float32


def number(value, name):
    """One number as a float."""
    if isinstance(value, (str, bytes, bytearray)):
        raise TypeError(f"{name}: expected a number, got {type(value).__name__}")
    try:
        return float(value)
    except TypeError:
        raise TypeError(f"{name}: expected a number, got {type(value).__name__}") from None
    except OverflowError:
        raise ValueError(f"{name}: expected a number within the range of float64, got one beyond it") from None


def numbers(array, name, shape):
    """A number, or an array of one number for each element of the shape."""
    if isinstance(array, (int, float)):
        return number(array, name)
    array = plain(array, name)
    if array.dtype.kind not in "fiub":
        raise TypeError(f"{name}: expected numbers, got an array of {array.dtype}")
    if array.ndim == 0:
        return float(array)
    try:
        return np.broadcast_to(_native_floats(array), shape).reshape(-1)
    except ValueError:
        raise ValueError(f"{name}: the shape {array.shape} does not fit {shape}, that of the rays") from None


def indices(array, name):
    """An aligned array of uint32; a copy only where it must be."""
    array = plain(array, name)
    if array.dtype.kind not in "iu" and array.size:
        raise TypeError(f"{name}: expected integers, got an array of {array.dtype}")
    if array.dtype not in (np.uint32, np.uint16, np.uint8) and array.size and (array.min() < 0 or array.max() > 0xFFFFFFFF):
        raise IndexError(f"{name}: expected indices from 0, got {array.min() if array.min() < 0 else array.max()}")
    return np.require(array, np.uint32, "A")


def weights(array, name):
    """An array of float32: barycentric weights."""
    array = plain(array, name)
    if array.dtype.kind not in "fiu":
        raise TypeError(f"{name}: expected numbers, got an array of {array.dtype}")
    with np.errstate(over="ignore"):
        return array.astype(np.float32, copy=False)


def together(first, first_name, second, second_name):
    """Two arrays of vectors, broadcast to one shape and with their leading axes made one; and these leading axes."""
    first, second = vectors(first, first_name), vectors(second, second_name)
    try:
        shape = np.broadcast_shapes(first.shape, second.shape)
    except ValueError:
        message = f"{first_name} and {second_name}: the shapes {first.shape} and {second.shape} do not fit together"
        raise ValueError(message) from None
    return rows(first, shape), rows(second, shape), shape[:-1]


def rows(array, shape):
    """The array with this shape, and all axes but the last made one."""
    count = 1
    for length in shape[:-1]:
        count *= length
    if array.ndim == 1:
        return np.broadcast_to(array, (count, 3))
    if array.shape != shape:
        array = np.broadcast_to(array, shape)
    return array if array.ndim == 2 else array.reshape(-1, 3)
