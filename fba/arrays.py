"""Type aliases for NumPy arrays by their dtype: `Float32` is an array of float32, of any shape.

`to_float64` converts the numbers of a file.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[Any]
Bool = npt.NDArray[np.bool_]
Floating = npt.NDArray[np.floating[Any]]
Float16 = npt.NDArray[np.float16]
Float32 = npt.NDArray[np.float32]
Float64 = npt.NDArray[np.float64]
Integer = npt.NDArray[np.integer[Any]]
Int16 = npt.NDArray[np.int16]
Int32 = npt.NDArray[np.int32]
Int64 = npt.NDArray[np.int64]
Intp = npt.NDArray[np.intp]
UInt8 = npt.NDArray[np.uint8]
UInt16 = npt.NDArray[np.uint16]
UInt32 = npt.NDArray[np.uint32]


def to_float64(numbers: npt.ArrayLike) -> Float64:
    """Return the numbers of a file as float64, without a warning of signalling NaNs, as in damaged files."""
    with np.errstate(invalid="ignore"):
        return np.asarray(numbers, dtype=np.float64)
