"""Frames on a device: what goes there and comes back, and what is done again in double."""

import math
from collections.abc import Callable, Sequence
from itertools import count
from typing import Any

import numpy as np

from transientcam_compiled import Spread
from transientcam_moments._dispatch import HEAVY_PIXELS, LEAST_PIXELS, lookup
from transientcam_moments._gpu._shader import EPS, PLANES, ZEROTH, rows, shader
from transientcam_moments._kernels.arrays import Booleans, Complexes, Images
from transientcam_moments._kernels.one_pass import Constants, Planes
from transientcam_moments._kernels.padding import normalisation
from transientcam_moments.arrays import Array
from transientcam_moments.moment_problem import redo, sparse

_SATURATED, _REPLACED = 4, 32  # transientcam_moments.Flags
KEYS = count()


class DevicePass:
    """Reconstructs frames of one order and shape on a device; has the face of `OnePass`.

    ``compute``: takes this pass and what it uploads; returns rows of results (n, P), those of
    `PLANES` first, or None where the device gave none.
    ``hostile``: see `shader`.
    """

    def __init__(
        self, compute: Callable[["DevicePass", Sequence[Array]], Any], m: int,
        shape: tuple[int, ...], constants: Constants, *, images: bool, hostile: bool = False,
    ) -> None:  # fmt: skip
        self._compute, self._m, self._shape, self._constants = compute, m, shape, constants
        self.pixels = math.prod(shape)
        self._images = images
        zeroth = constants.settings.zeroth
        self._estimated = zeroth == "estimated"
        self.code = shader(m, zeroth, images=images, hostile=hostile)
        bad = 0 if constants.bad is None or not images else len(constants.bad)
        replaced = bad if constants.replaced is not None else 0
        raw = 2 * self.pixels * (ZEROTH[zeroth] + 4 * m) if images else 0
        self.sizes = (
            (raw + 3) // 4 * 4,
            8 * replaced * (m + 1),
            8 * self.pixels * (m + 1),
            4 * self.pixels * rows(m, images=images),
        )
        self.key = next(KEYS)  # unlike that of any other
        self.inputs = self._inputs(replaced)

    def _inputs(self, replaced: int) -> tuple[Array, ...]:
        """Return what stays from frame to frame, as `_device.prepare` takes it."""
        constants, settings = self._constants, self._constants.settings
        taps = constants.taps if self._images else None
        planes = np.asarray(constants.inverse, np.complex64).reshape(self._m + 1, -1)
        usable = np.isfinite(planes).all(axis=0)
        present = np.broadcast_to(usable, self.pixels)
        if not self._images:
            present = np.ones_like(present)
        weight = np.where(present, np.float32(1), np.float32(np.nan))
        if taps is not None:
            weight = normalisation(present.reshape(self._shape), taps)[::2]
        taps = np.ones(1) if taps is None else taps
        places = np.zeros(self.pixels if replaced else 1, np.uint32)
        if replaced:
            places[constants.bad] = np.arange(1, replaced + 1)
        height, width = self._shape if len(self._shape) == 2 else (1, self.pixels)
        params = np.zeros(12, np.uint32)
        params[:5] = width, height, taps.size // 2, planes.shape[1] > 1, replaced
        params[6:].view(np.float32)[:] = (
            settings.epsilon, settings.least_light(np.float32), settings.full_scale,
            settings.threshold, constants.range_per_rad_m, np.nan,
        )  # fmt: skip
        inverse = np.where(usable, planes, 0).view(np.float32)
        return params, inverse, np.concatenate([weight, taps]).astype(np.float32), places

    def images(
        self, images: Images, saturated: Booleans | bool | None, spread: Spread
    ) -> Planes | None:
        """Reconstruct raw images as `OnePass.images` does; None where the device failed."""
        raw = np.ascontiguousarray(images).reshape(len(images), self.pixels)
        given: list[Array] = [raw]
        if self._constants.replaced is not None:
            given.append(np.asarray(self._constants.replaced(raw), np.complex64))
        found = self._compute(self, given)
        if found is None:
            return None
        smoothed = found[len(PLANES) + 2 * self._m :].reshape(-1).view(np.complex64)
        return self._planes(found, smoothed.reshape(-1, self.pixels), saturated, spread)

    def moments(
        self, smoothed: Complexes, saturated: Booleans | bool | None, spread: Spread
    ) -> Planes | None:
        """Reconstruct moments as `OnePass.moments` does; None where the device failed."""
        planes = np.ascontiguousarray(smoothed).reshape(len(smoothed), self.pixels)
        found = self._compute(self, [planes])
        if found is None:
            return None
        if self._estimated:
            planes = planes.copy()
        return self._planes(found, planes, False if saturated is None else saturated, spread)

    def _planes(
        self, found: Array, smoothed: Complexes, saturated: Booleans | bool | None, spread: Spread
    ) -> Planes:
        m, bad = self._m, self._constants.bad
        *numbers, packed = found[: len(PLANES)]
        phase, weight = found[len(PLANES) :][:m], found[len(PLANES) + m :][:m]
        packed = packed.view(np.uint32)
        flags, number = (packed & 255).astype(np.uint8), (packed >> 8).astype(np.int32)
        if saturated is not None:
            given = np.broadcast_to(np.asarray(saturated, bool), self._shape).reshape(-1)
            flags = (flags & np.uint8(255 - _SATURATED)) | np.uint8(_SATURATED) * given
        elif bad is not None:
            flags[bad] &= np.uint8(255 - _SATURATED)
        brightness, validity, uniform, direct, indirect, range_m, residual = numbers
        if self._estimated:
            smoothed[0] = brightness
        planes = Planes(
            smoothed, brightness, validity, flags, phase, weight, number, uniform,
            direct, indirect, range_m,
        )  # fmt: skip
        ill = np.flatnonzero(residual > sparse.largest_residual(m, EPS))
        if ill.size:
            self._redo(planes, ill, spread)
        if bad is not None:
            flags[bad] |= _REPLACED
        shaped = (each.reshape((*each.shape[:-1], *self._shape)) for each in planes[:-1])
        return Planes(*shaped)._replace(redone=ill.size)

    def _redo(self, planes: Planes, ill: Array, spread: Spread) -> None:
        """Find the returns of pixels again that single precision is not enough for."""
        moments = planes.smoothed[:, ill].astype(np.complex128)
        moments[0] = planes.brightness[ill]
        kernel = lookup("pisarenko", self._m, max(ill.size, HEAVY_PIXELS), "d")
        if kernel is None:
            found = [each[..., ill] for each in (planes.phase_rad, planes.weight)]
            found += [planes.uniform[ill], planes.count[ill]]
            redo(moments, found, np.arange(ill.size), EPS)
        else:
            # a kernel takes no fewer
            room = np.resize(np.arange(ill.size), max(ill.size, LEAST_PIXELS))
            given = np.ascontiguousarray(moments[:, room])
            found = [each[..., : ill.size] for each in kernel(given, noise=EPS, spread=spread)]
        phase, weight, _, count = found
        phase = phase.astype(np.float32)
        phase[phase >= 2 * np.pi] = 0  # rounded up
        weight = weight.astype(np.float32)
        planes.phase_rad[:, ill], planes.weight[:, ill], planes.count[ill] = phase, weight, count
        threshold = self._constants.settings.threshold
        one: Array = np.ones(ill.size, np.float32)
        first: Array
        direct, indirect, first = sparse.separate(
            (0,) * self._m, threshold, one, list(phase), list(weight)
        )
        planes.direct[ill], planes.indirect[ill] = direct, indirect
        valid = (planes.flags[ill] & 10) == 0
        metres = np.float32(self._constants.range_per_rad_m)
        planes.range_m[ill] = np.where(valid, first * metres, np.float32(np.nan))
