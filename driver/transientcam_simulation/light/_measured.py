"""Impulse responses from files: one for all pixels, or a transient image placed on the pixels.

Three kinds of .npz are read: ``counts`` (n_bins,) with ``bin_s``; ``meas`` (h, w, n_bins) with
``bin_s``; and ``h`` (h, w, n_bins) with ``start_opl_m`` and ``bin_opl_m``, a time axis given as
optical path length.
"""

import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from transientcam_driver.errors import SceneError
from transientcam_driver.sequence import SPEED_OF_LIGHT_M_S
from transientcam_simulation.scene import ResponseFile, Scene

_CUBE_PERCENTILE = 99.0  # this share of the pixels stays at or below brightness 1; lamps exceed it
_FIRST_PEAK = 0.1  # of the highest bin


@dataclass(frozen=True)
class _Part:
    """One file's responses: ``values`` (h, w, n) is mass a bin; bin 0 is centred at ``start_s``."""

    values: NDArray[np.float32]
    start_s: float
    bin_s: float

    @property
    def time_s(self) -> NDArray[np.float64]:
        """Centres of the bins."""
        bins = np.arange(self.values.shape[-1], dtype=np.float64)
        return self.start_s + self.bin_s * bins


class DenseResponses:
    """Sum of binned impulse responses, each resampled by area to H x W pixels."""

    kind: Literal["sparse", "dense"] = "dense"

    def __init__(self, parts: list[_Part], *, width: int, height: int) -> None:
        self._parts = parts
        self._rows = [area_weights(height, part.values.shape[0]) for part in parts]
        self._columns = [area_weights(width, part.values.shape[1]) for part in parts]

    def moments(self, frequency_hz: float) -> NDArray[np.complex128]:
        """Discrete Fourier transform of the bins, at their centres."""
        moments = np.zeros((len(self._rows[0]), len(self._columns[0])), dtype=np.complex128)
        for part, rows, columns in zip(self._parts, self._rows, self._columns, strict=True):
            phase_rad = 2 * np.pi * frequency_hz * part.time_s
            # two real products: the values are not copied to complex ones
            of_part = part.values @ np.cos(phase_rad) + 1j * (part.values @ np.sin(phase_rad))
            moments += rows @ of_part @ columns.T
        return moments

    def returns(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """One return a file: its first peak, and its mass; for a transient image, see below.

        A file with one response for all pixels is one return with all of its mass. In a transient
        image the first return of a pixel is its first local maximum above a tenth of its highest
        bin, with the mass of the bins up to the next local minimum, and the rest is a second
        return at its own highest bin.
        """
        delays, weights = [], []
        for part, rows, columns in zip(self._parts, self._rows, self._columns, strict=True):
            near = np.argmax(rows, axis=1)[:, None], np.argmax(columns, axis=1)[None, :]
            for bins, mass in _summarised(part.values):
                found = mass > 0
                delay_s = np.where(found, part.start_s + part.bin_s * bins, np.nan)
                delays.append(delay_s[near])
                weights.append(mass[near])
        order = np.argsort(delays, axis=0)
        return np.take_along_axis(np.array(delays), order, 0), np.take_along_axis(
            np.array(weights, dtype=np.float64), order, 0
        )

    def of_pixel(self, x: int, y: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Density of one pixel over a common time axis; the mass of every bin is kept."""
        bin_s = min(part.bin_s for part in self._parts)
        start_s = min(part.start_s - part.bin_s / 2 for part in self._parts)
        end_s = max(part.time_s[-1] + part.bin_s / 2 for part in self._parts)
        edges_s = start_s + bin_s * np.arange(round((end_s - start_s) / bin_s) + 1)
        mass = np.zeros(len(edges_s) - 1)
        for part, rows, columns in zip(self._parts, self._rows, self._columns, strict=True):
            response = np.einsum("h,w,hwt->t", rows[y], columns[x], part.values, optimize=True)
            own_edges_s = np.append(part.time_s - part.bin_s / 2, part.time_s[-1] + part.bin_s / 2)
            cumulated = np.append(0.0, np.cumsum(response, dtype=np.float64))
            mass += np.diff(np.interp(edges_s, own_edges_s, cumulated))
        return edges_s[:-1] + bin_s / 2, mass / bin_s


def _summarised(values: NDArray[np.float32]) -> list[tuple[NDArray[np.intp], NDArray[np.float64]]]:
    """Bin and mass of the returns that represent continuous responses."""
    highest = values.argmax(axis=-1)
    total = values.sum(axis=-1, dtype=np.float64)
    if values.shape[:2] == (1, 1):
        return [(highest, total)]
    before = np.pad(values, ((0, 0), (0, 0), (1, 0)))[..., :-1]
    after = np.pad(values, ((0, 0), (0, 0), (0, 1)))[..., 1:]
    peak = values.max(axis=-1, keepdims=True)
    rises = (values >= before) & (values > after) & (values >= _FIRST_PEAK * peak) & (peak > 0)
    first = rises.argmax(axis=-1)
    bins = np.arange(values.shape[-1])
    climbs = (after > values) & (bins > first[..., None])
    end = np.where(climbs.any(axis=-1), climbs.argmax(axis=-1), values.shape[-1])
    lobe = np.where(bins <= end[..., None], values, 0).sum(axis=-1, dtype=np.float64)
    rest = np.where(bins > end[..., None], values, 0)
    return [(first, lobe), (rest.argmax(axis=-1), rest.sum(axis=-1, dtype=np.float64))]


def area_weights(count: int, source: int) -> NDArray[np.float64]:
    """Matrix (count, source) that averages by overlap: cells keep their mean at any size."""
    edges = np.linspace(0, source, count + 1)
    cells = np.arange(source)
    overlap = np.minimum(edges[1:, None], cells + 1) - np.maximum(edges[:-1, None], cells)
    weights: NDArray[np.float64] = np.maximum(overlap, 0) * (count / source)
    return weights


def load_responses(scene: Scene, *, width: int, height: int) -> DenseResponses:
    """Read the files of a scene. Raises SceneError naming the file and what is wrong with it."""
    return DenseResponses(
        [_part(response) for response in scene.responses], width=width, height=height
    )


def _part(response: ResponseFile) -> _Part:
    part = _read(response.path, response.bin_s)
    values = part.values
    if response.background == "median":
        # noise below the median is no light
        values = np.maximum(values - np.median(values, axis=-1, keepdims=True), 0)
    # time zero first: it is the peak's place on the file's own axis
    start_s = part.start_s - _time_zero_s(response, values, part) + response.delay_s
    weight = response.weight
    if response.normalise:
        weight /= _brightness(response.path, values)
    return _Part((values * np.float32(weight)).astype(np.float32), start_s, part.bin_s)


def _time_zero_s(response: ResponseFile, values: NDArray[np.float32], part: _Part) -> float:
    if response.time_zero_s is not None:
        return response.time_zero_s
    if response.time_zero_file is not None:
        other = _read(response.time_zero_file, response.bin_s)
        return _peak_s(other.values, other)
    return _peak_s(values, part) if response.time_zero == "peak" else 0.0


def _peak_s(values: NDArray[np.float32], part: _Part) -> float:
    return float(part.time_s[values.sum(axis=(0, 1), dtype=np.float64).argmax()])


def _brightness(path: Path, values: NDArray[np.float32]) -> float:
    mass = values.sum(axis=-1, dtype=np.float64)
    brightness = float(np.percentile(mass, _CUBE_PERCENTILE))
    if brightness <= 0:
        raise SceneError(path, "sum of the responses", brightness, "above 0 to be normalised")
    return brightness


def _read(path: Path, bin_s: float | None) -> _Part:
    """Read one .npz; time zero begins its first bin, or is that of its optical path lengths."""
    content = _content(path)
    if "h" in content:
        start_s = _scalar(path, content, "start_opl_m") / SPEED_OF_LIGHT_M_S
        step_s = _scalar(path, content, "bin_opl_m") / SPEED_OF_LIGHT_M_S
        return _Part(_values(path, content, "h", 3), start_s, _positive(path, "bin_opl_m", step_s))
    name = next((name for name in ("counts", "meas") if name in content), None)
    if name is None:
        allowed = "counts or meas with bin_s, or h with start_opl_m and bin_opl_m"
        raise SceneError(path, "its arrays", sorted(content), allowed)
    step_s = bin_s if bin_s is not None else _scalar(path, content, "bin_s")
    dimensions = 1 if name == "counts" else 3
    step_s = _positive(path, "bin_s", step_s)
    # photons of bin k come from k to k + 1 times its width on
    return _Part(_values(path, content, name, dimensions), step_s / 2, step_s)


def _content(path: Path) -> dict[str, Any]:
    try:
        # opened here, because np.load does not close a file that it cannot read
        with path.open("rb") as file:
            archive = np.load(file, allow_pickle=False)
            if isinstance(archive, np.ndarray):
                raise SceneError(path, "the file", "one array without a name", "an .npz")
            with archive:
                return {name: archive[name] for name in archive.files}
    except (OSError, ValueError, EOFError, zipfile.BadZipFile) as error:
        raise SceneError(path, "the file", str(error), "a readable .npz") from error


def _values(path: Path, content: dict[str, Any], name: str, dimensions: int) -> NDArray[np.float32]:
    array = content[name]
    if array.ndim != dimensions or 0 in array.shape or array.dtype.kind not in "uif":
        shape = f"{array.dtype} {array.shape}"
        raise SceneError(path, name, shape, f"numbers in {dimensions} dimension(s)")
    values: NDArray[np.float32] = array.astype(np.float32)
    if not np.all(np.isfinite(values)) or np.any(values < 0):
        raise SceneError(path, name, "negative or not finite", "numbers of at least 0")
    return values.reshape((1, 1, -1)) if dimensions == 1 else values


def _scalar(path: Path, content: dict[str, Any], name: str) -> float:
    if name not in content:
        raise SceneError(path, name, None, "present")
    value = content[name]
    if value.size != 1 or value.dtype.kind not in "uif" or not np.isfinite(value).all():
        raise SceneError(path, name, str(value), "one finite number")
    return float(value.reshape(()))


def _positive(path: Path, name: str, value: float) -> float:
    if value <= 0:
        raise SceneError(path, name, value, "above 0")
    return value
