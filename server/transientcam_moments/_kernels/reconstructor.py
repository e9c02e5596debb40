"""A workspace that turns raw images into everything that is asked of a frame."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from transientcam_moments._kernels.careful import redo
from transientcam_moments._kernels.margins import normalisation, row_length
from transientcam_moments._kernels.registry import LEAST_PIXELS
from transientcam_moments._kernels.spread import Spread, at_once, blocks
from transientcam_moments.errors import ShapeError

_ZEROTH = {"low-frequency": 0, "on-off": 1, "estimated": 2}
_IMAGES = {"low-frequency": 4, "on-off": 2, "estimated": 0}
_ROOM = 1024  # pixels that are redone in double precision at a time


class Entries(NamedTuple):
    """Compiled stages of one order and precision."""

    order: tuple[int, ...]
    precision: str
    turns: Any
    wide_turns: Any
    measure: Callable[..., Any]
    smooth: Callable[..., Any]
    eigenvalue: Callable[..., Any]
    judge: Callable[..., Any]
    levinson: Callable[..., Any]
    returns: Callable[..., Any]
    separate: Callable[..., Any]
    gather: Callable[..., Any]
    scatter: Callable[..., Any]
    wide_eigenvalue: Callable[..., Any]
    wide_returns: Callable[..., Any]


class Reconstructed(NamedTuple):
    """What a `Reconstructor` makes of a frame, all with pixels (H, W) last.

    Attributes
    ----------
    measured : array, shape (m + 1, H, W)
        Calibrated and smoothed moments before biasing; b_0 means nothing where it is estimated.
    brightness : array, shape (H, W)
        b_0 after biasing; with it in place of b_0 the moments are those of the coefficients.
    validity : array, shape (H, W)
        Smallest eigenvalue over b_0 before biasing.
    flags : array, shape (H, W), uint8
        Of `transientcam_moments.Flags`.
    error, polynomial, reflection : array, shapes (H, W), (m + 1, H, W), (m, H, W)
        `Coefficients` of the maximum entropy density.
    phase_rad, weight, count : array, shapes (m, H, W), (m, H, W), (H, W)
        Returns, as in `Returns`.
    uniform, direct, indirect, range_m : array, shape (H, W)
        What the returns say; range NaN where there is none.
    """

    measured: Any
    brightness: Any
    validity: Any
    flags: Any
    error: Any
    polynomial: Any
    reflection: Any
    phase_rad: Any
    weight: Any
    count: Any
    uniform: Any
    direct: Any
    indirect: Any
    range_m: Any


class Reconstructor:
    """Reconstructs frames of one shape and sequence, without allocating anything per frame.

    Attributes
    ----------
    redone : int
        Pixels of the last frame whose returns needed double precision.

    Parameters
    ----------
    entries : Entries
        Of the order that the images have.
    shape : tuple of int
        Height and width.
    settings : Settings
        How to reconstruct.
    inverse : array, shape (m + 1,) or (m + 1, H, W), complex
        What measured moments are multiplied with, the reciprocal of a calibration; pixels where it
        isn't finite have no moments.
    taps : array, shape (2 R + 1,)
        Weights of the smoothing along each axis, sum 1; a single 1 for none.
    metres : float
        Range of a phase of 1 rad.
    """

    def __init__(
        self,
        entries: Entries,
        shape: tuple[int, int],
        settings: Any,
        inverse: Any,
        taps: Any,
        metres: float,
    ) -> None:
        self._entries, self._shape, self._settings = entries, shape, settings
        self._metres = metres
        self.redone = 0
        m, pixels = len(entries.order), shape[0] * shape[1]
        real = np.dtype(entries.precision)
        cplx = np.result_type(real, np.complex64)
        self._prepare_smoothing(taps, np.asarray(inverse), cplx)
        self._calibrated = np.empty((m + 1, pixels), cplx)
        self._saturated = np.empty(pixels, np.uint8)
        self._eigenvalue = np.empty(pixels, real)
        self._residual = np.empty(pixels, real)
        self._flat = Reconstructed(
            measured=np.empty((m + 1, pixels), cplx) if taps.size > 1 else self._calibrated,
            brightness=np.empty(pixels, real),
            validity=np.empty(pixels, real),
            flags=np.empty(pixels, np.uint8),
            error=np.empty(pixels, real),
            polynomial=np.empty((m + 1, pixels), cplx),
            reflection=np.empty((m, pixels), cplx),
            phase_rad=np.empty((m, pixels), real),
            weight=np.empty((m, pixels), real),
            count=np.empty(pixels, np.int32),
            uniform=np.empty(pixels, real),
            direct=np.empty(pixels, real),
            indirect=np.empty(pixels, real),
            range_m=np.empty(pixels, real),
        )
        self._result = Reconstructed(*(a.reshape((*a.shape[:-1], *shape)) for a in self._flat))
        self._wide = (
            np.empty((m + 1, _ROOM), np.complex128),
            np.empty(_ROOM),
            np.empty((m, _ROOM)),
            np.empty((m, _ROOM)),
            np.empty(_ROOM, np.int32),
            np.empty(_ROOM),
        )
        self._places = np.empty(_ROOM, np.int64)

    def __call__(self, images: Any, *, spread: Spread = at_once) -> Reconstructed:
        """Reconstruct one frame.

        Parameters
        ----------
        images : array, shape (N, H, W), uint16
            In capture order, as `measure` takes them; one take.
        spread : callable
            How to use several threads.

        Returns
        -------
        Reconstructed
            Views of the workspace: the next call overwrites them.

        Raises
        ------
        ShapeError
            For another number of images or pixels.
        """
        e, flat, settings = self._entries, self._flat, self._settings
        expected = (_IMAGES[settings.zeroth] + 4 * len(e.order), *self._shape)
        if images.shape != expected:
            raise ShapeError("images", f"of shape {images.shape}", f"{expected}")
        raw = np.ascontiguousarray(images, np.uint16).reshape(expected[0], -1)
        zeroth = _ZEROTH[settings.zeroth]
        estimated = int(settings.zeroth == "estimated")

        def measure(start: int, stop: int) -> None:
            e.measure(
                e.order, raw, zeroth, self._inverse, self._stride, settings.full_scale,
                self._calibrated, self._saturated, start, stop,
            )  # fmt: skip

        def smooth(start: int, stop: int) -> None:
            e.smooth(
                self._interleaved(self._calibrated), self._taps, self._weight, self._row(start),
                self._interleaved(flat.measured), self._shape[1], start, stop,
            )  # fmt: skip

        def analyse(start: int, stop: int) -> None:
            for left, right in blocks(start, stop):
                e.eigenvalue(e.order, flat.measured, estimated, self._eigenvalue, left, right)
                e.judge(
                    e.order, estimated, flat.measured, self._saturated, self._eigenvalue,
                    flat.brightness, flat.uniform, flat.validity, flat.flags, settings.epsilon,
                    settings.minimum_brightness, left, right,
                )  # fmt: skip
                e.levinson(
                    e.order, flat.measured, flat.brightness, 1, flat.error, flat.polynomial,
                    flat.reflection, left, right,
                )  # fmt: skip
                e.returns(
                    e.order, e.turns, flat.measured, flat.brightness, 1, flat.uniform,
                    flat.phase_rad, flat.weight, flat.count, self._residual, self._noise,
                    left, right,
                )  # fmt: skip

        def separate(start: int, stop: int) -> None:
            e.separate(
                e.order, flat.phase_rad, flat.weight, flat.flags, flat.direct, flat.indirect,
                flat.range_m, settings.threshold, self._metres, start, stop,
            )  # fmt: skip

        pixels = self._shape[0] * self._shape[1]
        spread(measure, pixels)
        if self._taps.size > 1:
            spread(smooth, self._shape[0], 8)
        spread(analyse, pixels)
        self._redo()
        spread(separate, pixels)
        return self._result

    @property
    def _noise(self) -> float:
        return float(np.finfo(self._entries.precision).eps)

    @staticmethod
    def _interleaved(moments: Any) -> Any:
        """Real and imaginary parts of complex planes as one real plane each."""
        return moments.view(moments.real.dtype)

    def _row(self, start: int) -> Any:
        """Room for a row between two zero margins; each part of the image has its own."""
        row = self._rows.get(start)
        if row is None:
            length = row_length(self._shape[1], self._taps.size)
            row = self._rows[start] = np.zeros(length, np.float32)
        return row

    def _prepare_smoothing(self, taps: Any, inverse: Any, cplx: Any) -> None:
        """Absent pixels count as nothing for their neighbours, and stay NaN themselves."""
        height, width = self._shape
        self._taps, self._rows = taps.astype(np.float32), dict[int, Any]()
        planes = np.broadcast_to(
            inverse.reshape((len(inverse), -1)).astype(cplx), (len(inverse), height * width)
        )
        self._stride = 0 if inverse.ndim == 1 else 1
        self._inverse = np.array(planes if self._stride else planes[:, :LEAST_PIXELS], order="C")
        present = np.isfinite(planes).all(axis=0).reshape(self._shape)
        if taps.size == 1:
            return
        if self._stride:
            self._inverse[:, ~present.reshape(-1)] = 0
        self._weight = normalisation(present, taps)

    def _redo(self) -> None:
        """Redo in double precision what doesn't reproduce its moments."""
        e, flat = self._entries, self._flat
        tolerance = 16 * (len(e.order) + 1) * self._noise
        moments, uniform, phase, weight, count, residual = self._wide
        self.redone, begin = 0, 0
        while True:
            found = e.gather(
                e.order, flat.measured, flat.brightness, self._residual, tolerance, moments,
                self._places, begin,
            )  # fmt: skip
            if not found:
                return
            stop = -(-found // LEAST_PIXELS) * LEAST_PIXELS
            e.wide_eigenvalue(e.order, moments, 0, uniform, 0, stop)
            ill = e.wide_returns(
                e.order, e.wide_turns, moments, uniform, 0, uniform, phase, weight, count,
                residual, self._noise, 0, stop,
            )  # fmt: skip
            if ill:
                where = np.flatnonzero(residual[:stop] > tolerance)
                redo(moments, (phase, weight, uniform, count), where, self._noise)
            e.scatter(
                e.order, self._places, found, phase, weight, count, residual, flat.phase_rad,
                flat.weight, flat.count, self._residual,
            )  # fmt: skip
            self.redone += found
            begin = int(self._places[found - 1]) + 1
