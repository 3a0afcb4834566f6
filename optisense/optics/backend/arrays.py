"""Device arrays copied from NumPy arrays.

The copies have memory of their own, because the alignment of a NumPy array would become part of
compiled kernels, which could then not be reused.
"""

from __future__ import annotations

from dataclasses import fields, is_dataclass
from typing import Any, TypeVar

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

Value = TypeVar("Value")

PACKET = 64
"""Number of entries of which a kernel reads a multiple, at least: four times those of the widest
vectors of processors, 16 single-precision numbers."""
FEWEST_LANES = 2
"""Lower bound on the number of entries of arrays that kernels work on: for arrays of one entry,
Dr.Jit compiles other kernels."""


def gathered(value: Value, lanes: mi.UInt32) -> Value:
    """Return the given lanes of an array, or of the arrays (not None) of a dataclass."""
    if value is None:
        return value
    if is_dataclass(value) and not isinstance(value, type):
        parts = {each.name: gathered(getattr(value, each.name), lanes) for each in fields(value)}
        return type(value)(**parts)
    return dr.gather(type(value), value, lanes)


def tiled(values: mi.UInt32, times: int) -> mi.UInt32:
    """Return an array (n,) of integers ``times`` times, one after the other.

    A kernel of `drjit.repeat` contains the number of times, and cannot be reused for others.
    """
    count = dr.width(values)
    number = dr.arange(mi.UInt32, count * times)
    return dr.gather(mi.UInt32, values, number % dr.opaque(mi.UInt32, count))


def joined(first: Value, second: Value) -> Value:
    """Concatenate two arrays, or the corresponding arrays of two tuples or dataclasses.

    A kernel of `drjit.concat` contains the lengths of the arrays, and cannot be reused for others.
    """
    dr.eval(first, second)
    count = dr.width(first)
    number = dr.arange(mi.UInt32, count + dr.width(second))
    start = dr.opaque(mi.UInt32, count)
    return _joined(first, second, number, number - start, number < start)


def _joined(
    first: Value, second: Value, number: mi.UInt32, later: mi.UInt32, in_first: mi.Bool
) -> Value:
    """Return entries ``number`` of the first array where ``in_first``, else ``later`` of the
    second.
    """
    if isinstance(first, tuple) and isinstance(second, tuple):
        pairs = zip(first, second, strict=True)
        return type(first)(_joined(one, two, number, later, in_first) for one, two in pairs)
    if is_dataclass(first) and not isinstance(first, type):
        names = [each.name for each in fields(first)]
        parts = ((getattr(first, name), getattr(second, name)) for name in names)
        return type(first)(*(_joined(one, two, number, later, in_first) for one, two in parts))
    one = dr.gather(type(first), first, number, in_first)
    two = dr.gather(type(first), second, later, ~in_first)
    return dr.select(in_first, one, two)


def floats(values: NDArray[np.floating]) -> mi.Float:
    """Return all n values of an array of any shape as device floats (n,), in row-major order.

    They are copied bit by bit, as some of them may hold integers.
    """
    return _copied(mi.Float, np.asarray(values, dtype=np.float32).ravel())


def indices(values: NDArray[np.integer] | NDArray[np.bool_]) -> mi.UInt32:
    """Return all n values of an array of any shape as device integers (n,), in row-major order."""
    return _copied(mi.UInt32, np.asarray(values, dtype=np.uint32).ravel())


def _copied(kind: type[Value], values: NDArray[Any]) -> Value:
    """Return a device array of its own memory with the bits of four-byte numbers (n,)."""
    bits = np.ascontiguousarray(values).view(np.uint32)
    if len(bits) == 0:
        return dr.zeros(kind, 0)
    if dr.backend_v(kind) == dr.JitBackend.LLVM:
        held = dr.empty(kind, len(bits))
        dr.sync_thread()  # kernels that still run may use what was freed before
        held.numpy().view(np.uint32)[:] = bits  # a view of the memory
    else:
        held = dr.reinterpret_array(kind, mi.UInt32(bits) + dr.opaque(mi.UInt32, 0))
        dr.eval(held)
    return held


def padded(values: NDArray[Any]) -> NDArray[Any]:
    """Return an array (n,) whose memory extends to a multiple of `PACKET` entries.

    Dr.Jit uses the memory of NumPy arrays as it is, and its kernels read whole vectors. At the end
    of the last mapped page of memory, reading beyond the array would end the process.
    """
    rest = len(values) % PACKET
    if rest == 0:
        return values
    held = np.empty(len(values) + PACKET - rest, dtype=values.dtype)
    held[: len(values)] = values
    return held[: len(values)]
