"""What passes between the package and the extension module."""

from collections.abc import Sequence
from typing import TypeAlias

from ._arrays import Array

#: Name, sample time, channels with name, unit and column, samples x columns.
Log: TypeAlias = tuple[str, float, Sequence[tuple[str, str, int]], Array]

#: A, B, C, D and the sample time.
Matrices: TypeAlias = tuple[Array, Array, Array, Array, float]
