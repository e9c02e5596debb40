"""h5py, which has no types, as far as it is used here."""

from collections.abc import Callable
from typing import Any, Final, TypeAlias

import h5py

File: TypeAlias = Any
"""An open h5py.File."""
Dataset: TypeAlias = Any
"""An h5py.Dataset."""
open_file: Final[Callable[..., Any]] = h5py.File
