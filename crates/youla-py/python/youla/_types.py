"""What passes between the package and the extension module."""

from collections.abc import Sequence
from typing import Literal, TypeAlias, Union

import numpy as np
import numpy.typing as npt

from ._arrays import Array

#: Name, sample time, channels with name, unit and column, samples x columns.
Log: TypeAlias = tuple[str, float, Sequence[tuple[str, str, int]], Array]

#: Angular frequencies, values, variances, whether these are known in full, and whether it is the response of the loop.
Table: TypeAlias = tuple[Array, npt.NDArray[np.complex128], Array | None, bool, bool]

#: A, B, C, D and the sample time.
Matrices: TypeAlias = tuple[Array, Array, Array, Array, float]

#: Sign of the feedback: u = K (r - y), or u = K (y - r). Unions, as stubtest takes a Literal of two for another thing than it is at run time.
Feedback: TypeAlias = Union[Literal["negative"], Literal["positive"]]

#: How a controller in s was brought to the sample time.
Hold: TypeAlias = Union[Literal["zoh"], Literal["tustin"]]
