"""Numbers and arrays by what they hold: names for annotations, without what computes with them."""

from __future__ import annotations

import math
from typing import Annotated, TypeAlias

import numpy as np
from numpy.typing import NDArray

FloatOrNaN: TypeAlias = Annotated[float, math.nan]  # NaN where it is not known: null in JSON
Real: TypeAlias = NDArray[np.float64]
Complex: TypeAlias = NDArray[np.complex128]
Integer: TypeAlias = NDArray[np.int64]
Flags: TypeAlias = NDArray[np.bool_]
