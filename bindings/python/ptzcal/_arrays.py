"""Checks what goes in and makes it what the C API reads."""

from __future__ import annotations

import ctypes
import enum
import operator
from typing import Any, Optional, Tuple, Type, TypeVar, Union

import numpy as np


def contiguous(array: np.ndarray, dtype: Any = None) -> np.ndarray:
    """As C wants it: in one piece and aligned, which arrays out of messages and files need not be."""
    return np.require(np.atleast_1d(array), dtype, ["C", "A"])


def numbers(value: Any, name: str) -> np.ndarray:
    """Any array-like as contiguous float64."""
    array = np.asarray(value)
    if array.dtype.kind not in "fiub":
        raise TypeError(f"{name} must hold real numbers, not {array.dtype}")
    return contiguous(array, np.float64)


def vector(value: Any, length: int, name: str) -> np.ndarray:
    array = numbers(value, name)
    if array.shape != (length,):
        raise ValueError(f"{name} must be {length} numbers, not of shape {array.shape}")
    return array


def rows(value: Any, columns: int, name: str, count: Optional[int] = None) -> np.ndarray:
    """n x columns numbers; an empty list has 0 rows."""
    array = numbers(value, name)
    if array.shape == (0,):
        array = array.reshape(0, columns)
    if array.ndim != 2 or array.shape[1] != columns or count not in (None, len(array)):
        n = "n" if count is None else count
        raise ValueError(f"{name} must be of shape ({n}, {columns}), not {array.shape}")
    return array


def rows_or_one(value: Any, columns: int, name: str) -> Tuple[np.ndarray, bool]:
    """n x columns numbers, or one row of them; says which."""
    array = numbers(value, name)
    if array.shape == (columns,):
        return array.reshape(1, columns), True
    return rows(array, columns, name), False


def shaped(value: Any, count: Optional[int], shape: Tuple[int, ...], name: str) -> np.ndarray:
    """n entries of this shape; an empty list has none."""
    array = numbers(value, name)
    if array.shape == (0,):
        array = array.reshape(0, *shape)
    if array.shape[1:] != shape or array.ndim == 0 or count not in (None, len(array)):
        n = "n" if count is None else count
        wanted = ", ".join(map(str, (n, *shape)))
        raise ValueError(f"{name} must be of shape ({wanted}), not {array.shape}")
    return array


def pixel_covariances(value: Any, count: int, name: str) -> Optional[np.ndarray]:
    """count x (xx, xy, yy) from (n, 3), (n, 2, 2) or one (2, 2) for all; None stays None."""
    if value is None:
        return None
    array = numbers(value, name)
    if array.shape[-2:] == (2, 2) and array.ndim <= 3:
        _check_symmetric(array, name)
        array = array[..., [0, 0, 1], [0, 1, 1]]
        if array.ndim == 1:
            array = np.tile(array, (count, 1))
    if array.shape != (count, 3):
        raise ValueError(
            f"{name} must be of shape ({count}, 3): xx, xy, yy, or ({count}, 2, 2), or (2, 2), "
            f"not {np.shape(value)}"
        )
    return np.ascontiguousarray(array)


def point_covariances(value: Any, count: int, name: str) -> Optional[np.ndarray]:
    """count x 9 from (n, 3, 3), (n, 9) or one (3, 3) for all; None stays None."""
    if value is None:
        return None
    array = numbers(value, name)
    if array.shape == (3, 3):
        array = np.tile(array.reshape(1, 9), (count, 1))
    if array.shape not in ((count, 3, 3), (count, 9)):
        raise ValueError(
            f"{name} must be of shape ({count}, 3, 3) or (3, 3), not {np.shape(value)}"
        )
    return np.ascontiguousarray(array.reshape(count, 9))


def _check_symmetric(array: np.ndarray, name: str) -> None:
    if not np.array_equal(array[..., 0, 1], array[..., 1, 0], equal_nan=True):
        raise ValueError(f"{name} must be symmetric")


_Nothing = ctypes.c_char * 0


def address_of(array: np.ndarray) -> int:
    """Where an array's first element is; four times as fast as array.ctypes.data where it can be."""
    try:
        return ctypes.addressof(_Nothing.from_buffer(array))  # type: ignore[arg-type]
    except TypeError:  # read-only, or not contiguous
        return array.ctypes.data


def address_of_optional(array: Optional[np.ndarray]) -> Optional[int]:
    return None if array is None else address_of(array)


def unsigned(value: Any, name: str, bits: int = 32) -> int:
    """A whole number that C can hold: ctypes would cut off what does not fit."""
    number = operator.index(value)
    if not 0 <= number < 1 << bits:
        raise ValueError(f"{name} must be from 0 to {(1 << bits) - 1}, not {number}")
    return number


_E = TypeVar("_E", bound=enum.IntEnum)


def member(kind: Type[_E], value: Union[_E, str, int], name: str) -> _E:
    """A member of an enum by itself, by its name in any case, or by its number."""
    try:
        return kind[value.upper()] if isinstance(value, str) else kind(value)
    except (KeyError, ValueError):
        known = ", ".join(m.name.lower() for m in kind)
        raise ValueError(f"{name} must be one of {known}, not {value!r}") from None
