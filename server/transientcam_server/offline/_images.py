"""An array of all frames of a recording, of which what is indexed is read or computed."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

from transientcam_server.recording import Recording


class ByFrame:
    """An array whose first axis are frames; NumPy's basic indexing reads them one by one.

    ``shape``, ``dtype``: of the whole.
    ``frame``: returns the values of a frame by its index.
    """

    def __init__(
        self, shape: tuple[int, ...], dtype: str, frame: Callable[[int], NDArray[Any]]
    ) -> None:
        self.shape, self.dtype = shape, np.dtype(dtype)
        self._frame = frame

    @property
    def ndim(self) -> int:
        """How many axes it has."""
        return len(self.shape)

    def __len__(self) -> int:
        return self.shape[0]

    def __getitem__(self, index: Any) -> NDArray[Any]:
        frames, *rest = index if isinstance(index, tuple) else (index,)
        if frames is Ellipsis:
            frames, rest = slice(None), [Ellipsis, *rest]
        within = tuple(rest)
        numbers = np.arange(len(self))[frames]
        if numbers.ndim == 0:
            one: NDArray[Any] = self._frame(int(numbers))[within]
            return one
        read = [self._frame(int(number))[within] for number in numbers]
        if read:
            return np.stack(read)
        empty = np.empty((0, *self.shape[1:]), self.dtype)
        return np.asarray(empty[(slice(None), *within)])

    def __array__(self, dtype: DTypeLike | None = None, copy: bool | None = None) -> NDArray[Any]:
        if copy is False:
            raise ValueError("frames of a file cannot be had without reading them")
        return np.asarray(self[:], dtype=dtype)

    def __repr__(self) -> str:
        return f"<ByFrame {' x '.join(map(str, self.shape))} {self.dtype}>"


def raw_images(recording: Recording) -> ByFrame:
    """Return all images of a recording (frames, N, H, W), uint16 in DN."""
    return ByFrame(recording.shape, "<u2", lambda index: recording.frame(index).images)
