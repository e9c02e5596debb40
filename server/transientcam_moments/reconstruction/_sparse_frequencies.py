"""What follows from moments whose frequencies are not 1 to m times one: few returns, no density."""

from functools import cached_property
from typing import NoReturn

import numpy as np

from transientcam_moments.arrays import Array, namespace
from transientcam_moments.errors import ParameterError
from transientcam_moments.likelihood import MODEL_ERROR, Unwrapped
from transientcam_moments.moment_problem import Coefficients, Peaks, Returns, Separation
from transientcam_moments.noise import MomentNoise
from transientcam_moments.reconstruction._flags import Flags
from transientcam_moments.reconstruction._lazy import Reconstruction
from transientcam_moments.reconstruction._settings import OF_ANY_MULTIPLES


class GappedReconstruction(Reconstruction):
    """A reconstruction of moments b_0 and b_j of any multiples j of the base frequency.

    Plane k of the moments belongs to the k-th of (0, *settings.multiples). Without all multiples
    from 1 to m there is no Toeplitz matrix: nothing is biased, validity is NaN, and coefficients,
    peaks and all densities raise ParameterError. Range and returns are those of `estimate`, by one
    of `OF_ANY_MULTIPLES`. Where b_0 was not measured, its plane is 0 and the brightness is the
    light of the returns that were found.
    """

    _of_any_multiples = True

    @cached_property
    def smoothed(self) -> Array:
        """Moments (K + 1, ...) smoothed over pixels; b_0 is 0 where it was not measured."""
        return self._averaged[0]

    @cached_property
    def eigenvalue(self) -> Array:
        """NaN: there is no Toeplitz matrix."""
        xp = namespace(self.smoothed)
        return xp.full(self.smoothed.shape[1:], np.nan, dtype=self.smoothed.real.dtype)

    @cached_property
    def validity(self) -> Array:
        """NaN: there is no Toeplitz matrix."""
        return self.eigenvalue

    @cached_property
    def _biased(self) -> tuple[Array, Array]:
        return self.smoothed, namespace(self.smoothed).zeros(self.smoothed.shape[1:], dtype=bool)

    @cached_property
    def corrected_pixels(self) -> int | None:
        """None: no harmonics of the modulation are taken out."""
        return None

    @property
    def _has_zeroth(self) -> bool:
        return self.settings.zeroth != "estimated"

    @property
    def _least_brightness(self) -> Array:
        """b_0, or else the largest of the moments, none of which exceeds it."""
        if self._has_zeroth:
            return self.smoothed[0].real
        return abs(self.smoothed[1:]).max(axis=0)

    @cached_property
    def _flags_of_moments(self) -> Array:
        xp = namespace(self.smoothed)
        size = abs(self.smoothed)
        finite = xp.isfinite(size).all(axis=0)
        dark = finite & ~(self._least_brightness > self.settings.least_light(size.dtype))
        found = xp.where(finite, 0, int(Flags.NON_FINITE))
        for flag, where in (
            (Flags.NO_SIGNAL, dark),
            (Flags.NO_SIGNAL, self._undetected),
            (Flags.SATURATED, self._saturated),
            (Flags.REPLACED, self._bad),
        ):
            if where is not None:
                found = found | xp.where(xp.asarray(where), int(flag), 0)
        return found.astype(xp.uint8)

    @property
    def _evidence(self) -> tuple[Array, MomentNoise | None, tuple[int, ...], float]:
        multiples = self.settings.multiples or ()
        measured = (0, *multiples) if self._has_zeroth else multiples
        planes = self.smoothed[-len(measured) :]
        if self.noise is None:
            return planes, None, measured, 0.0
        return planes, MomentNoise(self.noise.variance[-len(planes) :]), measured, MODEL_ERROR

    @cached_property
    def returns(self) -> Returns:
        """Sharp returns and the tail of `estimate`, in as many slots as there are multiples."""
        found = self.estimate
        xp = namespace(found.weight)
        if isinstance(found, Unwrapped):
            there = (found.weight > 0).astype(np.int32)
            phase, weight = found.phase_rad[None], found.weight[None]
            tail, count = xp.zeros_like(found.weight), there
        else:
            phase, weight, tail, count = found.phase_rad, found.weight, found.tail, found.count
        missing = len(self.smoothed) - 1 - len(weight)
        empty = xp.zeros((missing, *weight.shape[1:]), dtype=weight.dtype)
        phase = xp.concatenate([phase, empty + np.nan])
        return Returns(phase, xp.concatenate([weight, empty]), tail, count)

    @cached_property
    def _separation(self) -> Separation:
        if self.settings.technique not in OF_ANY_MULTIPLES:
            limit = (
                f"one of {', '.join(OF_ANY_MULTIPLES)}, for the multiples {self.settings.multiples}"
            )
            raise ParameterError("estimator", self.settings.technique, limit)
        return super()._separation

    @cached_property
    def brightness(self) -> Array:
        """b_0 as it was measured, or else the light of all returns."""
        return self.smoothed[0].real if self._has_zeroth else self.direct + self.indirect

    @cached_property
    def coefficients(self) -> Coefficients:
        """Raises ParameterError."""
        self._refuse("coefficients of a density")

    @cached_property
    def peaks(self) -> Peaks:
        """Raises ParameterError."""
        self._refuse("peaks of a density")

    def _refuse(self, what: str) -> NoReturn:
        raise ParameterError("multiples", self.settings.multiples, f"1 to m, for {what}")
