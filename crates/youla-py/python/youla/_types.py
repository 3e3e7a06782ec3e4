"""What passes between the package and the extension module."""

from collections.abc import Sequence
from typing import Literal, TypeAlias

import numpy as np
import numpy.typing as npt

from ._arrays import Array

#: Name, sample time, channels with name, unit and column, samples x columns.
Log: TypeAlias = tuple[str, float, Sequence[tuple[str, str, int]], Array]

#: Angular frequencies, values, variances, whether these are known in full, and whether it is the response of the loop.
Table: TypeAlias = tuple[Array, npt.NDArray[np.complex128], Array | None, bool, bool]

#: A, B, C, D and the sample time.
Matrices: TypeAlias = tuple[Array, Array, Array, Array, float]

#: Sign of the feedback: u = K (r - y), or u = K (y - r).
Feedback: TypeAlias = Literal["negative", "positive"]

#: How a controller in s was brought to the sample time.
Hold: TypeAlias = Literal["zoh", "tustin"]
