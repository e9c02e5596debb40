"""Everything between the raw images of a frame and its range, in one pass of compiled stages."""

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from transientcam_compiled import BLOCK, Spread, empty
from transientcam_moments._dispatch import LEAST_PIXELS
from transientcam_moments._kernels.arrays import Booleans, Complexes, FlatReturns, Images, Reals
from transientcam_moments._kernels.padding import normalisation, row_length

if TYPE_CHECKING:  # it brings along the compiler
    from transientcam_moments._kernels.wide import WideReturns

_ZEROTH = {"low-frequency": 0, "on-off": 1, "estimated": 2}
_ROOM = 2048  # pixels that are redone in double precision at a time
_ROWS = 64  # of a part at least: each measures some rows beside its own
_EPS = float(np.finfo(np.float32).eps)
_SATURATED, _REPLACED = 4, 32  # transientcam_moments.Flags


class Stages(NamedTuple):
    """Compiled stages of one order in single precision."""

    order: tuple[int, ...]
    turns: Any
    measure: Callable[..., Any]
    smooth: Callable[..., Any]
    measure_and_smooth: Callable[..., Any]
    analyse: Callable[..., Any]
    steps: int
    separate: Callable[..., Any]
    wide: "WideReturns"


class Planes(NamedTuple):
    """What a pass makes of a frame, each array with the pixels (...) last, and a new one."""

    smoothed: Any
    """Shape (m + 1, ...), complex64: calibrated and smoothed moments before biasing, b_0 estimated
    where it is not measured."""
    brightness: Any
    """Shape (...): b_0 after biasing: in place of b_0 it makes the moments valid."""
    validity: Any
    """Shape (...): smallest eigenvalue over b_0 before biasing."""
    flags: Any
    """Shape (...), uint8: of `transientcam_moments.Flags`."""
    phase_rad: Any
    weight: Any
    count: Any
    """``phase_rad``, ``weight``, ``count``: shapes (m, ...), (m, ...), (...): returns, as in
    `Returns`."""
    uniform: Any
    direct: Any
    indirect: Any
    range_m: Any
    """``uniform``, ``direct``, ``indirect``, ``range_m``: shape (...): what the returns say; range
    NaN where there is none."""
    redone: int = 0
    """Pixels whose returns needed double precision."""


@dataclass(frozen=True)
class Constants:
    """What is the same for every frame."""

    settings: Any
    """Of the reconstruction."""
    inverse: Any
    """Shape (m + 1,) or (m + 1, ...), complex128: what measured moments are multiplied with, the
    reciprocal of a calibration; pixels where it isn't finite have no moments."""
    taps: Any
    """Shape (2 R + 1,): weights of the smoothing along both axes of the pixels, sum 1;
    None for none."""
    range_per_rad_m: float
    """Range of a phase of 1 rad."""
    bad: Any = None
    """Integers (B,): flat places of the pixels to be flagged as replaced."""
    replaced: Callable[[Any], Any] | None = None
    """Takes raw images (N, P) and returns uncalibrated moments (m + 1, B) for
    those pixels."""


class OnePass:
    """Reconstructs frames of one order and shape; several threads may call it at once.

    Results are new arrays. What does not leave the pass lives in scratch space, which is kept for
    later frames: one for each call that ever ran at the same time as others.

    ``stages``: of the order that the frames have.
    ``shape``: tuple of int, of the pixels; with taps, height and width, the latter at least
    `LEAST_WIDTH`.
    ``constants``: what is the same for every frame.
    """

    def __init__(self, stages: Stages, shape: tuple[int, ...], constants: Constants) -> None:
        self._stages, self._shape, self._constants = stages, shape, constants
        self._pixels = math.prod(shape)
        self._estimated = constants.settings.zeroth == "estimated"
        self._prepare_calibration(np.asarray(constants.inverse))
        self._idle: list[_Scratch] = []

    def images(self, images: Images, saturated: Booleans | bool | None, spread: Spread) -> Planes:
        """Reconstruct raw images (N, ...), uint16, of one take.

        ``saturated`` (...) replaces what the images themselves show to be saturated.
        """
        s, constants = self._stages, self._constants
        raw = np.ascontiguousarray(images).reshape(len(images), self._pixels)
        smoothed = empty((len(s.order) + 1, self._pixels), np.complex64)
        with self._scratch() as scratch:
            if self._taps is None or constants.replaced is not None:
                calibrated = smoothed if self._taps is None else scratch.calibrated
                spread(partial(self._measure, raw, calibrated, scratch), self._pixels)
                if constants.replaced is not None:
                    moments = constants.replaced(raw)
                    inverse = self._inverse[:, constants.bad if self._stride else slice(1)]
                    calibrated[:, constants.bad] = moments * inverse
                if self._taps is not None:
                    spread(partial(self._smooth, smoothed, scratch), self._shape[0], _ROWS)
            else:
                part = partial(self._measure_and_smooth, raw, smoothed, scratch)
                spread(part, self._shape[0], _ROWS)
            if constants.bad is not None:
                scratch.saturated[constants.bad] = 0
            if saturated is not None:
                scratch.mark_saturated(saturated, self._shape)
            return self._analysed(smoothed, scratch, spread)

    def _measure(
        self, raw: Images, calibrated: Complexes, scratch: "_Scratch", start: int, stop: int
    ) -> None:
        """Write the calibrated moments of some pixels, and which of them are saturated."""
        settings = self._constants.settings
        self._stages.measure(
            self._stages.order, raw, _ZEROTH[settings.zeroth], self._inverse, self._stride,
            settings.full_scale, calibrated, scratch.saturated, start, stop,
        )  # fmt: skip

    def _smooth(self, smoothed: Complexes, scratch: "_Scratch", start: int, stop: int) -> None:
        """Smooth rows of the calibrated moments."""
        self._stages.smooth(
            scratch.calibrated.view(np.float32), self._taps, self._weight, scratch.row(start),
            smoothed.view(np.float32), self._shape[1], start, stop,
        )  # fmt: skip

    def _measure_and_smooth(
        self, raw: Images, smoothed: Complexes, scratch: "_Scratch", start: int, stop: int
    ) -> None:
        """Write the smoothed moments of rows."""
        settings = self._constants.settings
        self._stages.measure_and_smooth(
            self._stages.order, raw, _ZEROTH[settings.zeroth], self._inverse, self._stride,
            settings.full_scale, scratch.calibrated, scratch.saturated, self._taps, self._weight,
            scratch.row(start), scratch.calibrated.view(np.float32), smoothed.view(np.float32),
            self._shape[1], start, stop,
        )  # fmt: skip

    def moments(
        self, smoothed: Complexes, saturated: Booleans | bool | None, spread: Spread
    ) -> Planes:
        """Reconstruct calibrated and smoothed moments (m + 1, ...), complex64.

        ``saturated`` (...) is flagged, where it is given.
        """
        planes = np.ascontiguousarray(smoothed).reshape(len(smoothed), self._pixels)
        if self._estimated:
            planes = planes.copy()
        with self._scratch() as scratch:
            scratch.mark_saturated(False if saturated is None else saturated, self._shape)
            return self._analysed(planes, scratch, spread)

    def _analysed(self, smoothed: Complexes, scratch: "_Scratch", spread: Spread) -> Planes:
        s, constants, settings = self._stages, self._constants, self._constants.settings
        if self._estimated:
            smoothed[0] = 0
        planes = self._new_planes(smoothed)
        found = FlatReturns(None, planes.phase_rad, planes.weight, planes.count, scratch.residual)
        redone: list[int] = []

        def analyse(start: int, stop: int) -> None:
            s.analyse(
                s.order, s.turns, int(self._estimated), smoothed, scratch.saturated,
                scratch.eigenvalue, planes.brightness, planes.uniform, planes.validity,
                planes.flags, settings.epsilon, settings.least_light(np.float32), planes.phase_rad,
                planes.weight, planes.count, scratch.residual, _EPS, s.steps, start, stop,
            )  # fmt: skip
            room = scratch.take_wide()
            redone.append(s.wide(smoothed, planes.brightness, found, room, start, stop))
            scratch.give_wide(room)
            s.separate(
                s.order, planes.phase_rad, planes.weight, planes.flags, planes.direct,
                planes.indirect, planes.range_m, settings.threshold, constants.range_per_rad_m,
                start, stop,
            )  # fmt: skip

        spread(analyse, self._pixels, BLOCK)
        if constants.bad is not None:
            planes.flags[constants.bad] |= _REPLACED
        if self._estimated:
            smoothed[0] = planes.brightness
        shaped = (a.reshape((*a.shape[:-1], *self._shape)) for a in planes[:-1])
        return Planes(*shaped)._replace(redone=sum(redone))

    def _new_planes(self, smoothed: Complexes) -> Planes:
        """Return room for a result: an array a plane, none of which keeps another from the pool."""
        m, pixels = len(self._stages.order), self._pixels
        plane = (empty(pixels, np.float32) for _ in range(6))
        return Planes(
            smoothed=smoothed,
            brightness=next(plane),
            validity=next(plane),
            flags=empty(pixels, np.uint8),
            phase_rad=empty((m, pixels), np.float32),
            weight=empty((m, pixels), np.float32),
            count=empty(pixels, np.int32),
            uniform=next(plane),
            direct=next(plane),
            indirect=next(plane),
            range_m=next(plane),
        )

    @contextmanager
    def _scratch(self) -> Iterator["_Scratch"]:
        try:
            scratch = self._idle.pop()
        except IndexError:
            scratch = _Scratch(self._stages, self._pixels, self._shape, self._taps)
        try:
            yield scratch
        finally:
            self._idle.append(scratch)

    def _prepare_calibration(self, inverse: Complexes) -> None:
        """Prepare what to multiply with: a row of equal numbers, or one number a pixel.

        With smoothing, absent pixels count as nothing for their neighbours, and are NaN behind it.
        """
        taps = self._constants.taps
        self._taps = None if taps is None else taps.astype(np.float32)
        self._stride = 0 if inverse.ndim == 1 else 1
        length = self._pixels if self._stride else LEAST_PIXELS
        planes = inverse.reshape((len(inverse), -1)).astype(np.complex64)
        self._inverse = np.array(np.broadcast_to(planes, (len(inverse), length)), order="C")
        if taps is None:
            return
        present = np.isfinite(planes).all(axis=0)
        self._inverse[:, ~np.broadcast_to(present, length)] = 0
        everywhere = np.broadcast_to(present, self._pixels).reshape(self._shape)
        self._weight = normalisation(everywhere, taps)


class _Scratch:
    """Room for what one call computes on the way."""

    def __init__(
        self, stages: Stages, pixels: int, shape: tuple[int, ...], taps: Reals | None
    ) -> None:
        m = len(stages.order)
        self.saturated = np.empty(pixels, np.uint8)
        self.eigenvalue = np.empty(pixels, np.float32)
        self.residual = np.empty(pixels, np.float32)
        self._stages = stages
        self._wide: list[Any] = []
        if taps is not None:
            self.calibrated = np.empty((m + 1, pixels), np.complex64)
            self._row_length = row_length(shape[1], taps.size)
            self._rows: dict[int, Any] = {}

    def row(self, start: int) -> Any:
        """Room for a row between two zero margins; those that begin at each row have their own."""
        row = self._rows.get(start)
        if row is None:
            row = self._rows[start] = np.zeros(self._row_length, np.float32)
        return row

    def take_wide(self) -> Any:
        """Room for pixels that are redone in double precision, for one part of the image."""
        try:
            return self._wide.pop()
        except IndexError:
            return self._stages.wide.room(_ROOM)

    def give_wide(self, room: tuple[Any, ...]) -> None:
        """Keep such room for another part."""
        self._wide.append(room)

    def mark_saturated(self, saturated: Booleans | bool, shape: tuple[int, ...]) -> None:
        """Take the flags of saturated pixels from a boolean array, or from one for all."""
        marked = np.broadcast_to(np.asarray(saturated, bool), shape).reshape(-1)
        np.multiply(marked, np.uint8(_SATURATED), out=self.saturated)
