"""Measured and rendered impulse responses of others, as files hold them.

- Photons: ``counts`` (n_bins,) or ``meas`` (H, W, n_bins), with ``bin_s``.
- A transient image ``h`` (H, W, T) with ``start_opl_m`` and ``bin_opl_m``.
- What mitransient renders: ``transient`` (H, W, T, channels), with ``start_opl`` and
  ``bin_width_opl`` as its film calls them.
- An HDF5 file of tal: ``H`` (T, x, y) with ``t_start`` and ``delta_t``.
- The arrays of the first three in a file of MATLAB (-v7.3).

The time axis of the last three is an optical path length in m.
"""

import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import h5py
import numpy as np
from numpy.lib.npyio import NpzFile
from numpy.typing import NDArray

import transientcam_moments as tm
from transientcam_server.errors import InputError
from transientcam_server.recording import Storage, open_unknown, swmr

_Array = NDArray[Any]

KEYS: Final = ("counts", "meas", "h", "transient", "H")
"""Any of them makes a file one of impulse responses."""
_OF_TAL: Final = ("H", "H_format", "t_start", "delta_t")
_OF_MATLAB: Final = (
    *("counts", "meas", "bin_s", "h", "start_opl_m", "bin_opl_m"),
    *("transient", "start_opl", "bin_width_opl"),
)
_MATLAB: Final = b"MATLAB 7.3 MAT-file"
"""What a file begins with that MATLAB wrote with -v7.3: HDF5 with the axes turned round."""
_CHANNELS: Final = 3
_DEFLATE_AT_MOST: Final = 1032
"""How many times its size what deflate has packed can be (the zlib home page)."""
_MATRIX: Final = 2
_LASERS: Final = (2, 4)
"""The values of tal's ``H_format`` with an axis of laser positions (`tal.enums.HFormat`)."""


def is_tal(path: Path) -> bool:
    """Return whether a file is HDF5 with an impulse response of tal."""
    try:
        with open_unknown(path) as file:
            return "H" in file and "raw" not in file
    except (OSError, ValueError):
        return False


def arrays_of(path: Path) -> dict[str, _Array]:
    """Return the named arrays of an .npz, or those of a file of tal.

    Raises
    ------
    InputError
        If it is neither.
    OSError
        If it cannot be read.
    """
    if h5py.is_hdf5(path):
        return _of_hdf5(path)
    try:
        # no pickle: a measurement from elsewhere must not be able to run anything
        with path.open("rb") as opened:
            file = np.load(opened, allow_pickle=False)
            if not isinstance(file, NpzFile):
                raise InputError(str(path), "content", "a single array", "an .npz of named arrays")
            with file:
                return {name: file[name] for name in file}
    except (zipfile.BadZipFile, ValueError, EOFError) as error:
        raise InputError(str(path), "content", f"unreadable ({error})", "an .npz of arrays") from (
            error
        )


def impulse_response(
    path: Path, arrays: Mapping[str, _Array], *, background: str
) -> tuple[_Array, _Array]:
    """Return the times of the bins (T,) in s, and the responses (H, W, T).

    Raises
    ------
    InputError
        Naming the file, the key, what it is and what it must be.
    """
    if "counts" in arrays or "meas" in arrays:
        return _of_counts(path, arrays, background=background)
    if "h" in arrays:
        return _of_lengths(path, arrays, "h", arrays["h"], "start_opl_m", "bin_opl_m")
    if "transient" in arrays:
        # bin k of the film collects lengths from start + k width on: half a bin later on average
        response = _grey(path, arrays["transient"])
        keys = "start_opl", "bin_width_opl"
        return _of_lengths(path, arrays, "transient", response, *keys, offset_bins=0.5)
    return _of_lengths(path, arrays, "H", _image(path, arrays), "t_start", "delta_t")


def scalar(path: Path, arrays: Mapping[str, _Array], key: str, *, positive: bool = True) -> float:
    """Return a number of a file, or raise an InputError."""
    expected = "a positive number" if positive else "a finite number"
    if key not in arrays:
        raise InputError(str(path), key, "missing", expected)
    array = arrays[key]
    if array.size != 1 or array.dtype.kind not in "fiu":
        raise InputError(str(path), key, f"{array.dtype} of shape {array.shape}", expected)
    value = float(array.reshape(()))
    if not np.isfinite(value) or (positive and value <= 0.0):
        raise InputError(str(path), key, f"{value}", expected)
    return value


def require_some_finite(path: Path, key: str, planes: _Array) -> None:
    """Refuse an array without a single usable pixel; unusable ones beside others are flagged."""
    if not np.isfinite(planes).all(axis=0).any():
        raise InputError(str(path), key, "NaN or infinite in every pixel", "finite somewhere")


def _of_hdf5(path: Path) -> dict[str, _Array]:
    try:
        with open_unknown(path) as file:
            storage = Storage(file, path.stat().st_size * _DEFLATE_AT_MOST)
            matlab = _is_matlab(path)
            return {
                name: storage.values(name).T if matlab else storage.values(name)
                for name in (_OF_MATLAB if matlab else _OF_TAL)
                # tal writes an empty value for what it does not know
                if name in storage and storage.dataset(name).shape is not None
            }
    except (ValueError, KeyError, RuntimeError) as error:
        found = f"unreadable ({swmr.in_words(error)})"
        raise InputError(str(path), "content", found, "an HDF5 file of tal with H") from error


def _is_matlab(path: Path) -> bool:
    with path.open("rb") as file:
        return file.read(len(_MATLAB)) == _MATLAB


def _of_counts(
    path: Path, arrays: Mapping[str, _Array], *, background: str
) -> tuple[_Array, _Array]:
    key = "counts" if "counts" in arrays else "meas"
    counts = arrays[key]
    if counts.ndim == _MATRIX and 1 in counts.shape:  # MATLAB has no vectors
        counts = counts.reshape(-1)
    if counts.ndim not in (1, 3) or counts.shape[-1] < 2 or not counts.size:
        raise InputError(str(path), key, f"of shape {counts.shape}", "(n_bins,) or (H, W, n_bins)")
    if counts.dtype.kind not in "fiu":
        raise InputError(str(path), key, f"{counts.dtype}", "numbers")
    if counts.ndim == 1:
        counts = counts[np.newaxis, np.newaxis]
    counts = counts.astype(np.float64)
    bin_s = scalar(path, arrays, "bin_s")
    require_some_finite(path, key, counts.sum(axis=-1)[np.newaxis])
    if background == "median":
        # fewer photons than the background are noise of it, not negative light
        counts = np.maximum(counts - np.median(counts, axis=-1, keepdims=True), 0.0)
    return (np.arange(counts.shape[-1]) + 0.5) * bin_s, counts  # photons lie anywhere in their bin


def _of_lengths(
    path: Path,
    arrays: Mapping[str, _Array],
    key: str,
    response: _Array,
    start: str,
    width: str,
    *,
    offset_bins: float = 0.0,
) -> tuple[_Array, _Array]:
    """Return times and responses (H, W, T) of a time axis that is an optical path length."""
    if response.ndim != 3 or not response.size or response.dtype.kind not in "fiu":
        found = f"{response.dtype} of shape {response.shape}"
        raise InputError(str(path), key, found, "numbers of shape (H, W, T)")
    start_m = scalar(path, arrays, start, positive=False)
    bin_m = scalar(path, arrays, width)
    require_some_finite(path, key, response.sum(axis=-1, dtype=np.float64)[np.newaxis])
    bins = np.arange(response.shape[-1]) + offset_bins
    return (start_m + bins * bin_m) / tm.SPEED_OF_LIGHT_M_S, response


def _grey(path: Path, transient: _Array) -> _Array:
    """Return the mean over the channels of a rendered transient image."""
    if transient.ndim == 3:
        return transient
    if transient.ndim != 4 or not 1 <= transient.shape[-1] <= _CHANNELS:
        found = f"of shape {transient.shape}"
        expected = f"(H, W, T) or (H, W, T, channels), 1 to {_CHANNELS} of them"
        raise InputError(str(path), "transient", found, expected)
    if transient.dtype.kind not in "fiu":
        raise InputError(str(path), "transient", f"{transient.dtype}", "numbers")
    mean: _Array = transient.mean(axis=-1)
    return mean


def _image(path: Path, arrays: Mapping[str, _Array]) -> _Array:
    """Return tal's response (T, x, y), or (T, points), as (y, x, T)."""
    response = arrays["H"]
    form = int(scalar(path, arrays, "H_format", positive=False)) if "H_format" in arrays else None
    if form in _LASERS or response.ndim not in (2, 3):
        expected = "(T, Sx, Sy) or (T, Si), without an axis of laser positions"
        raise InputError(str(path), "H", f"of shape {response.shape}", expected)
    return np.transpose(response.reshape(*response.shape, *([1] * (3 - response.ndim))))
