"""What raw images show: the labels from which their order, their weights and b_0 follow."""

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any, Final

import numpy as np

from transientcam_moments.arrays import MAX_MULTIPLE, Array
from transientcam_moments.errors import ParameterError, ShapeError
from transientcam_moments.images import (
    FOUR_PHASES_RAD,
    LEAST_PHASES,
    SAME_PHASE_RAD,
    is_four_bucket,
    phase_weights,
)
from transientcam_moments.reconstruction._settings import Settings

_SAME_FREQUENCY: Final = 1e-6  # relative


class Labels:
    """What each of N raw images of a frame shows, in the order of capture.

    Parameters
    ----------
    harmonic : integer array, shape (N,)
        Modulated at this multiple of the base frequency; 0 for images of the zeroth moment.
    phase_rad : array, shape (N,)
        Phase of the modulation: 0, pi / 2, pi and 3 pi / 2, or any three or more.
    frequency_hz : array, shape (N,), optional
        Of the modulation; 0 where nothing is modulated. The base frequency follows from it.
    illumination : boolean array, shape (N,), optional
        False where the light is off; needed where b_0 is measured with the light on and off.
    take : integer array, shape (N,), optional
        Which of several captures of the same images; one capture, when left out.

    Raises
    ------
    ShapeError
        When the labels are not of one length.
    ParameterError
        When the images of all multiples and takes are not at the same three or more phases, and
        those of the zeroth moment neither at these, nor two, nor none, or when the frequencies
        are not multiples of one.

    Notes
    -----
    Sec. 3.1 and 4.3: b_0 is measured at a low frequency, by an image with and one without light,
    or not at all. Row k of everything here belongs to `multiples` k, row 0 to b_0.
    """

    def __init__(
        self,
        harmonic: Array,
        phase_rad: Array,
        frequency_hz: Array | None = None,
        illumination: Array | None = None,
        take: Array | None = None,
    ) -> None:
        count = np.size(harmonic)
        lit = np.ones(count, bool) if illumination is None else illumination
        takes = np.zeros(count, int) if take is None else take
        self.harmonic = _column("harmonic", harmonic, count, np.int64)
        self.phase_rad = _column("phase_rad", phase_rad, count, float)
        self.frequency_hz = (
            None if frequency_hz is None else _column("frequency_hz", frequency_hz, count, float)
        )
        self.illumination = _column("illumination", lit, count, bool)
        self.take = _column("take", takes, count, np.int64)
        self._require_a_capture()

    @property
    def harmonics(self) -> int:
        """How many frequencies there are beside that of b_0: the order m, of consecutive ones."""
        return len(self.multiples)

    @cached_property
    def multiples(self) -> tuple[int, ...]:
        """Which multiples of the base frequency there are, ascending."""
        return tuple(int(each) for each in np.unique(self.harmonic[self.harmonic > 0]))

    @cached_property
    def phases_rad(self) -> tuple[float, ...]:
        """Phases of the images of each frequency, from 0 to a turn, ascending."""
        first = (self.harmonic == self.multiples[0]) & (self.take == self.take[0])
        found = np.sort(self._turned[first])
        return FOUR_PHASES_RAD if is_four_bucket(found) else tuple(found.tolist())

    @property
    def takes(self) -> int:
        """How many captures of the same images there are."""
        return len(np.unique(self.take))

    @property
    def zeroth(self) -> str:
        """How b_0 was measured: "low-frequency", "on-off" or "estimated"."""
        of_zeroth = self.harmonic == 0
        if not of_zeroth.any():
            return "estimated"
        return "low-frequency" if self.illumination[of_zeroth].all() else "on-off"

    @property
    def base_frequency_hz(self) -> float | None:
        """f; None where no frequencies are given."""
        if self.frequency_hz is None:
            return None
        lowest = self.multiples[0]
        return float(self.frequency_hz[self.harmonic == lowest][0]) / lowest

    @cached_property
    def order(self) -> Array:
        """Places (N,) of the images in the order that `measure` takes them in."""
        return np.lexsort((self._turned, ~self.illumination, self.harmonic, self.take))

    def in_order(self, images: Any) -> Any:
        """Return images (N, ...) in the order that `measure` takes them in.

        Raises
        ------
        ShapeError
            When there is not one label for each image.
        """
        count = len(self.harmonic)
        if len(images) != count:
            raise ShapeError("images", f"{len(images)} of them", f"{count}: one for each label")
        if np.array_equal(self.order, np.arange(count)):
            return images
        if isinstance(images, Sequence):
            return [images[index] for index in self.order]
        return images[self.order]

    @cached_property
    def weight(self) -> Array:
        """Weights (m + 1, N), complex128: b_j is sum_i weight_ji image_i, before division by gains.

        Those of a moment add up to 0, so that dark level and ambient light cancel; those of takes
        are of their mean. b_0 at a low frequency is the modulus of that sum (see `modulus`), and
        all weights of one that was not measured are 0.
        """
        weights = np.zeros((self.harmonics + 1, len(self.harmonic)), dtype=np.complex128)
        for row, j in enumerate((0, *self.multiples)):
            for take in np.unique(self.take):
                here = (self.harmonic == j) & (self.take == take)
                if j or self.zeroth == "low-frequency":
                    weights[row, here] = phase_weights(self.phase_rad[here])
        if self.zeroth == "on-off":
            weights[0] = np.where(self.harmonic == 0, np.where(self.illumination, 2.0, -2.0), 0.0)
        return weights / self.takes

    @property
    def modulus(self) -> Array:
        """Which moments (m + 1,) are the modulus of their sum: b_0 at a low frequency."""
        taken = np.zeros(self.harmonics + 1, dtype=bool)
        taken[0] = self.zeroth == "low-frequency"
        return taken

    def settings(self, given: Settings) -> Settings:
        """Return settings with what the labels say filled in.

        Raises
        ------
        ParameterError
            When the settings say something else.
        """
        found: dict[str, Any] = {
            "zeroth": self.zeroth,
            "takes": self.takes,
            "base_frequency_hz": self.base_frequency_hz,
            "multiples": self.multiples,
            "phases_rad": self.phases_rad,
        }
        if self.frequency_hz is not None and self.zeroth == "low-frequency":
            found["low_frequency_hz"] = float(self.frequency_hz[self.harmonic == 0][0])
        known = {name: value for name, value in found.items() if value is not None}
        for name, value in known.items():
            stated = getattr(given, name)
            if stated not in (None, value):
                raise ParameterError(name, stated, f"{value!r}, as the labels of the images say")
        return replace(given, **known)

    @cached_property
    def _turned(self) -> Array:
        """Phases (N,) from 0 to a turn; those that rounding put just below a turn are 0."""
        turned = np.mod(self.phase_rad, 2 * np.pi)
        return np.where(turned > 2 * np.pi - SAME_PHASE_RAD, 0.0, turned)

    def _require_a_capture(self) -> None:
        known = (self.harmonic >= 0) & (self.harmonic <= MAX_MULTIPLE)
        if not known.all() or not self.multiples:
            raise ParameterError(
                "harmonic", self.harmonic.tolist(), f"0 .. m, with m from 1 to {MAX_MULTIPLE}"
            )
        if len(self.phases_rad) < LEAST_PHASES:
            self._refuse(self.multiples[0], self.take[0])
        for take in np.unique(self.take):
            for j in (0, *self.multiples):
                here = (self.take == take) & (self.harmonic == j)
                lit = sorted(self.illumination[here])
                sampled = all(lit) and self._at_the_same_phases(here)
                if not sampled and not (j == 0 and lit in ([], [False, True])):
                    self._refuse(j, take)
        zeroths = {int(np.sum((self.take == t) & (self.harmonic == 0))) for t in self.take}
        if len(zeroths) > 1:
            raise ParameterError("harmonic", self.harmonic.tolist(), "the same images in each take")
        self._require_multiples()

    def _at_the_same_phases(self, here: Array) -> bool:
        found = np.sort(self._turned[here])
        return len(found) == len(self.phases_rad) and np.allclose(
            found, self.phases_rad, rtol=0, atol=SAME_PHASE_RAD
        )

    def _refuse(self, harmonic: int, take: int) -> None:
        here = (self.take == take) & (self.harmonic == harmonic)
        degrees = np.round(np.degrees(self.phases_rad), 3).tolist()
        wanted = degrees if len(degrees) >= LEAST_PHASES else "three or more phases"
        raise ParameterError(
            f"phase_rad of harmonic {harmonic} in take {int(take)}, in degrees, and illumination",
            (np.degrees(self.phase_rad[here]).tolist(), self.illumination[here].tolist()),
            f"{wanted} once each with the light on"
            + ("; one with and one without light; or none" if harmonic == 0 else ""),
        )

    def _require_multiples(self) -> None:
        base_hz = self.base_frequency_hz
        if base_hz is None or self.frequency_hz is None:
            return
        of = self.harmonic > 0
        found, multiples = self.frequency_hz[of], self.harmonic[of] * base_hz
        if not base_hz > 0 or not np.allclose(found, multiples, rtol=_SAME_FREQUENCY):
            raise ParameterError(
                "frequency_hz", found.tolist(), "harmonic times one frequency above 0"
            )


def _column(name: str, values: Array, count: int, dtype: Any) -> Array:
    column = np.asarray(values)
    if column.shape != (count,):
        raise ShapeError(name, f"of shape {column.shape}", f"({count},): one for each image")
    return column.astype(dtype)
