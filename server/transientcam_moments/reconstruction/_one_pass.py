"""A reconstruction most of which one compiled pass has computed."""

from collections.abc import Callable
from functools import cached_property
from typing import Any

import numpy as np

from transientcam_moments._kernels.one_pass import Planes
from transientcam_moments.arrays import Array
from transientcam_moments.moment_problem import Coefficients, Returns, levinson
from transientcam_moments.reconstruction import Reconstruction
from transientcam_moments.reconstruction._flags import INVALID, Flags
from transientcam_moments.reconstruction._settings import Settings


class PassedReconstruction(Reconstruction):
    """A reconstruction most of which one compiled pass has computed.

    Parameters
    ----------
    planes : Planes
        Of the pass.
    settings : Settings
        Those it was made with.
    measure : callable
        Returns the calibrated moments that are not smoothed; called when they are first read.
    corrected : boolean array, shape (...), optional
        Where known harmonics were taken out; none are known, when left out.
    share : array, shape (H, W), optional
        Its `variance_share`.
    given
        As of `Reconstruction`.
    """

    def __init__(
        self,
        planes: Planes,
        settings: Settings,
        measure: Callable[[], Array],
        *,
        corrected: Array | None = None,
        share: Array | None = None,
        **given: Any,
    ) -> None:
        super().__init__(None, settings, **given)
        self._measure = measure
        self.smoothed = planes.smoothed
        self._averaged = planes.smoothed, share
        self._corrected = planes.smoothed, corrected
        self.validity = planes.validity
        nothing = (planes.count == 0) & (planes.flags & int(INVALID) == 0)  # as of uniform light
        self._flags_of_moments = planes.flags
        if nothing.any():
            self._flags_of_moments = planes.flags | np.uint8(Flags.NO_SIGNAL) * nothing
        self.returns = Returns(planes.phase_rad, planes.weight, planes.uniform, planes.count)
        self.brightness = planes.brightness
        if settings.technique == "pisarenko":  # else it follows from another estimate
            self.uniform = planes.uniform
        # in a turn that begins elsewhere, or with others before it, another return may be first
        end = 0.0 if settings.least_range_m else settings.start_rad + 2 * np.pi
        usual = self._low is None and not (planes.phase_rad >= end).any()
        if settings.technique == "pisarenko" and usual:
            self.direct = planes.direct
            self.indirect = planes.indirect
            if settings.base_frequency_hz is not None:
                self.range_m = planes.range_m
        if self._undetected is not None:
            no_signal = np.where(self._undetected, np.uint8(Flags.NO_SIGNAL), np.uint8(0))
            self._flags_of_moments = self._flags_of_moments | no_signal
            if "range_m" in vars(self):
                self.range_m = np.where(self._undetected, np.float32(np.nan), planes.range_m)

    @cached_property
    def measured(self) -> Array:
        """Calibrated moments (m + 1, ...), not smoothed; read from the data once more."""
        return self._measure()

    @cached_property
    def coefficients(self) -> Coefficients:
        """Coefficients of the maximum entropy density; no biased moments are made for them."""
        return levinson(self.smoothed, brightness=self.brightness)

    @property
    def _shape(self) -> tuple[int, tuple[int, ...]]:
        return self.smoothed.shape[0] - 1, tuple(self.smoothed.shape[1:])

    @cached_property
    def _biased(self) -> tuple[Array, Array]:
        biased = (self._flags_of_moments & int(Flags.BIASED)) > 0
        if self.settings.zeroth == "estimated":
            return self.smoothed, biased
        moments = self.smoothed.copy()
        moments[0] = self.brightness
        return moments, biased
