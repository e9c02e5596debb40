"""Measured and rendered impulse responses of others, as files hold them.

- Photons: ``counts`` (n_bins,) or ``meas`` (H, W, n_bins), with ``bin_s``.
- A transient image ``h`` (H, W, T) with ``start_opl_m`` and ``bin_opl_m``.
- What mitransient renders: ``transient`` (H, W, T, channels), with ``start_opl`` and
  ``bin_width_opl`` as its film calls them.
- An HDF5 file of tal: ``H`` (T, x, y) with ``t_start`` and ``delta_t``.
- The arrays of the first three, or moments, in a file of MATLAB, of any version since 5.

The time axis of ``h``, ``transient`` and ``H`` is an optical path length in m.
"""

import zipfile
from collections.abc import Iterable, Mapping
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

_TIMES: Final = {
    # photons lie anywhere in their bin, and bin k of a film collects lengths from k width on
    "counts": ("", "bin_s", 0.5),
    "meas": ("", "bin_s", 0.5),
    "h": ("start_opl_m", "bin_opl_m", 0.0),
    "transient": ("start_opl", "bin_width_opl", 0.5),
    "H": ("t_start", "delta_t", 0.0),
}
"""Begin and step of the time axis of each response, in m or without a begin in s, and the place in
a bin."""
KEYS: Final = tuple(_TIMES)
"""Any of them makes a file one of impulse responses."""
_OF_TAL: Final = ("H", "H_format", "t_start", "delta_t")
_OF_MATLAB: Final = {"moments", "base_frequency_hz", *KEYS}.union(
    filter(None, (name for begin, step, _ in _TIMES.values() for name in (begin, step)))
)
_MATLAB_7: Final = b"MATLAB 7.3 MAT-file"
"""What a file begins with that MATLAB wrote with -v7.3: HDF5 with the axes turned round."""
_MATLAB_5: Final = b"MATLAB 5.0 MAT-file"
"""The same of its other options but -v4, and of Octave's -v6 and -v7."""
_OCTAVE: Final = (b"# Created by Octave", b"Octave-1", b"\x1f\x8b")  # the last of its option -zip
LEAST_BIN_S: Final = 1e-15
LONGEST_S: Final = 1e-3
"""A response ends before: light goes 150 km there and back. Bins are longer than a femtosecond, and
no longer than half a period of the highest frequency that is asked of them."""
_FEW_PERIODS: Final = 0.25
"""Of the highest frequency: in a shorter response time may be another axis, one that is longer."""
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

    Raises InputError if it is neither.
    Raises OSError if it cannot be read.
    """
    with path.open("rb") as opened:
        begin = opened.read(32)
    if begin.startswith(_OCTAVE):
        found = "in a format of Octave alone"
        raise InputError(str(path), "content", found, "an .npz, or what `save -v7` writes")
    if h5py.is_hdf5(path):
        return _of_hdf5(path, matlab=begin.startswith(_MATLAB_7))
    if begin.startswith(_MATLAB_5) or path.suffix == ".mat":
        return _of_matlab_5(path)
    try:
        # no pickle: a measurement from elsewhere must not be able to run anything
        with path.open("rb") as opened:
            file = np.load(opened, allow_pickle=False)
            if not isinstance(file, NpzFile):
                raise InputError(str(path), "content", "a single array", "an .npz of named arrays")
            with file:
                _require_known(path, file)
                return {name: file[name] for name in file}
    except (zipfile.BadZipFile, ValueError, EOFError) as error:
        raise InputError(str(path), "content", f"unreadable ({error})", "an .npz of arrays") from (
            error
        )


def impulse_response(
    path: Path, arrays: Mapping[str, _Array], *, background: str, highest_hz: float
) -> tuple[_Array, _Array]:
    """Return the times of the bins (T,) in s, and the responses (H, W, T).

    ``highest_hz`` is the highest frequency that is to be measured.

    Raises InputError naming the file, the key, what it is and what it must be.
    """
    key = next(each for each in KEYS if each in arrays)
    start, width, offset_bins = _TIMES[key]
    unit, unit_s = ("m", 1.0 / tm.SPEED_OF_LIGHT_M_S) if start else ("s", 1.0)
    response = arrays[key]
    if not start:
        response = _counts(path, key, response, background=background)
    elif key == "transient":
        response = _grey(path, response)
    elif key == "H":
        response = _image(path, arrays)
    if response.ndim != 3 or not response.size or response.dtype.kind not in "fiu":
        found = f"{response.dtype} of shape {response.shape}"
        raise InputError(str(path), key, found, "numbers of shape (H, W, T)")
    first = scalar(path, arrays, start, positive=False) if start else 0.0
    step, bins = scalar(path, arrays, width), response.shape[-1]
    require_some_finite(path, key, response.sum(axis=-1, dtype=np.float64)[np.newaxis])
    time_s = (first + (np.arange(bins) + offset_bins) * step) * unit_s
    least, most = LEAST_BIN_S / unit_s, 0.5 / (highest_hz * unit_s)
    if not least <= step <= most:
        expected = f"from {least:.3g} to {most:.3g} {unit}, half a period of {highest_hz:g} Hz"
        raise InputError(str(path), width, f"{step:g} {unit}", expected)
    if (last_s := np.abs(time_s).max()) > LONGEST_S:
        expected = f"of times of flight, within {LONGEST_S:g} s"
        raise InputError(str(path), start or width, f"of times of {last_s:g} s", expected)
    if bins * step * unit_s * highest_hz < _FEW_PERIODS and max(response.shape) >= 4 * bins:
        found = f"of shape {arrays[key].shape}: {bins} bins, {bins * step * unit_s:.3g} s in all"
        raise InputError(str(path), key, found, "with time on the last axis: (H, W, n_bins)")
    return time_s, response


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


def _require_known(path: Path, names: Iterable[str]) -> None:
    """Refuse a file of other arrays, and say which."""
    held = set(names)
    if not held & {"moments", *KEYS}:
        found = ", ".join(sorted(held)) or "nothing"
        raise InputError(str(path), "content", found, f"moments, {', '.join(KEYS[:-1])} or H")


def _of_hdf5(path: Path, *, matlab: bool) -> dict[str, _Array]:
    try:
        with open_unknown(path) as file:
            storage = Storage(file, path.stat().st_size * _DEFLATE_AT_MOST)
            _require_known(path, file)
            if not matlab and "H" not in file:
                found = "in HDF5, but not of tal or MATLAB"
                raise InputError(str(path), "content", found, "an .npz, or what `save -v7` writes")
            return {
                name: _of_matlab(storage.values(name).T) if matlab else storage.values(name)
                for name in (_OF_MATLAB if matlab else _OF_TAL)
                # tal writes an empty value for what it does not know
                if name in storage and storage.dataset(name).shape is not None
            }
    except (ValueError, KeyError, RuntimeError) as error:
        found = f"unreadable ({swmr.in_words(error)})"
        raise InputError(str(path), "content", found, "an HDF5 file of tal with H") from error


def _of_matlab(values: Any) -> _Array:
    if values.dtype.names == ("real", "imag"):  # as HDF5 has complex numbers of MATLAB
        values = values["real"] + 1j * values["imag"]
    whole: _Array = values.toarray() if hasattr(values, "toarray") else values  # sparse
    return whole.reshape(-1) if whole.ndim == _MATRIX and 1 in whole.shape else whole  # a vector


def _of_matlab_5(path: Path) -> dict[str, _Array]:
    from scipy.io import loadmat, whosmat  # of few files

    try:
        _require_known(path, (name for name, _, _ in whosmat(path)))
        return {
            name: _of_matlab(values)
            for name, values in loadmat(path, variable_names=_OF_MATLAB).items()
            if name in _OF_MATLAB
        }
    except InputError:
        raise
    except Exception as error:  # SciPy raises anything of a damaged file
        raise InputError(str(path), "content", f"unreadable ({error})", "a MATLAB file") from error


def _counts(path: Path, key: str, counts: _Array, *, background: str) -> _Array:
    if counts.ndim not in (1, 3) or counts.shape[-1] < 2 or not counts.size:
        raise InputError(str(path), key, f"of shape {counts.shape}", "(n_bins,) or (H, W, n_bins)")
    counts = counts if counts.ndim > 1 else counts[np.newaxis, np.newaxis]
    if background == "median" and counts.dtype.kind in "fiu":
        # fewer photons than the background are noise of it, not negative light
        counts = np.maximum(counts - np.median(counts, axis=-1, keepdims=True), 0.0)
    return counts


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
