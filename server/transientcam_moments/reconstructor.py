"""From raw images or moments to a reconstruction: in one compiled pass, or stage by stage."""

import math
import threading
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from transientcam_moments import _kernels
from transientcam_moments._arrays import Array, as_array
from transientcam_moments._kernels.one_pass import Constants, OnePass
from transientcam_moments._kernels.padding import LEAST_WIDTH
from transientcam_moments._kernels.parallel import Spread, at_once
from transientcam_moments.bad_pixels import Replacement, checked_mask, fill_bad_pixels
from transientcam_moments.calibration import calibrate, inverse_gains
from transientcam_moments.four_bucket import harmonics_of, measure, saturated, takes_first
from transientcam_moments.ranging import range_m
from transientcam_moments.reconstruction import PassedReconstruction, Reconstruction, Settings
from transientcam_moments.smoothing import gaussian_taps, smooth
from transientcam_moments.takes import average_takes

_SHAPES = 4  # of images that a reconstructor keeps prepared


class Reconstructor:
    """Reconstructs the frames of a camera.

    What does not change from frame to frame is prepared once; several threads may call it at the
    same time, and no result changes with a later call.

    Parameters
    ----------
    settings : Settings, optional
        The paper's, when left out.
    calibration : array, shape (m + 1,) or (m + 1, ...), optional
        Gains to divide by, as `calibrate` takes them.
    bad_pixels : boolean array, shape (H, W), optional
        Pixels that show the mean of their neighbours instead, and are flagged.
    """

    def __init__(
        self,
        settings: Settings | None = None,
        *,
        calibration: Array | None = None,
        bad_pixels: Array | None = None,
    ) -> None:
        self.settings = Settings() if settings is None else settings
        self._calibration = calibration
        self._bad = bad_pixels
        self._lock = threading.Lock()
        self._prepared: dict[tuple[Any, ...], OnePass] = {}

    def __call__(
        self,
        data: Array | Sequence[Array],
        *,
        saturated_pixels: Array | None = None,
        spread: Spread = at_once,
    ) -> Reconstruction:
        """Reconstruct one frame.

        Parameters
        ----------
        data : array
            Real images (N, ...) in capture order, as `measure` takes them, or complex moments
            (m + 1, ...). They must stay as they are if ``measured`` is to be read later.
        saturated_pixels : boolean array, shape (...), optional
            Pixels to be flagged; found in images by themselves.
        spread : callable
            How the compiled pass uses several threads, as `kernels.over` returns it.

        Returns
        -------
        Reconstruction
            Where the compiled pass serves, with range, returns, light, flags and validity
            computed; else with moments measured and nothing else computed yet.

        Raises
        ------
        ShapeError
            When the data have no shape that belongs to images or moments, or calibration or bad
            pixels have another one.
        """
        data = data if isinstance(data, Sequence) else as_array(data)
        if not isinstance(data, Sequence) and np.dtype(data.dtype).kind == "c":
            moments = data if self._bad is None else fill_bad_pixels(data, self._bad)
            return self._of_moments(self._calibrated(moments), saturated_pixels, None, spread)
        takes = takes_first(data, self.settings.takes)
        one_pass = self._pass_of_images(takes)
        if one_pass is not None:
            planes = one_pass.images(takes[0], saturated_pixels, spread)
            return PassedReconstruction(
                planes,
                self.settings,
                lambda: self._measured(takes)[0],
                calibration=self._calibration,
            )
        moments, kept = self._measured(takes)
        if saturated_pixels is None:
            stack = takes.reshape((-1, *moments.shape[1:]))
            saturated_pixels = saturated(stack, full_scale=self.settings.full_scale)
            if self._bad is not None:  # their own values are not used
                saturated_pixels = saturated_pixels & ~self._bad
        return self._of_moments(moments, saturated_pixels, kept, spread)

    def _of_moments(
        self, moments: Array, saturated_pixels: Array | None, kept: Array | None, spread: Spread
    ) -> Reconstruction:
        """Go on from calibrated moments."""
        one_pass = self._pass_of_moments(moments)
        if one_pass is None:
            return Reconstruction(
                moments,
                self.settings,
                saturated_pixels,
                bad_pixels=self._bad,
                kept=kept,
                calibration=self._calibration,
            )
        smoothed = moments
        if moments.ndim == 3:
            smoothed = smooth(moments, self.settings.smoothing_sigma_px)
        planes = one_pass.moments(smoothed, saturated_pixels, spread)
        return PassedReconstruction(planes, self.settings, lambda: moments, kept, self._calibration)

    def _measured(self, takes: Array) -> tuple[Array, Array]:
        """Return calibrated moments of raw images, and which images went into them."""
        average, kept = average_takes(takes)
        if self._bad is not None:
            average = fill_bad_pixels(average, self._bad)
        return self._calibrated(measure(average, zeroth=self.settings.zeroth)), kept

    def _calibrated(self, moments: Array) -> Array:
        return moments if self._calibration is None else calibrate(moments, self._calibration)

    # -- which way -----------------------------------------------------------------------------
    # The compiled pass serves NumPy arrays in single precision, of 64 pixels or more and an order
    # whose kernel "reconstruct" is compiled, where moments keep their harmonics and the range is
    # Pisarenko's, or that of the likelihood, which follows from the pass's moments. It begins with
    # the raw images of one take of uint16, as wide as its smoothing needs, or else (several takes,
    # other images, moments) behind the smoothing. All else goes stage by stage, each computed when
    # it is first read.

    def _pass_of_images(self, takes: Array) -> OnePass | None:
        m = harmonics_of(takes.shape[1], self.settings.zeroth)
        shape = tuple(takes.shape[2:])
        raw = isinstance(takes, np.ndarray) and takes.dtype == np.uint16 and takes.shape[0] == 1
        wide = self._taps(shape) is None or shape[1] >= LEAST_WIDTH
        return self._pass(m, shape) if raw and wide else None

    def _pass_of_moments(self, moments: Array) -> OnePass | None:
        if not isinstance(moments, np.ndarray) or moments.dtype != np.complex64 or not moments.ndim:
            return None
        return self._pass(moments.shape[0] - 1, moments.shape[1:])

    def _pass(self, m: int, shape: tuple[int, ...]) -> OnePass | None:
        usual = self.settings.keep == "harmonics"
        usual = usual and self.settings.estimator in ("pisarenko", "likelihood")
        prepare = _kernels.lookup("reconstruct", m, math.prod(shape))
        masked = self._bad is None or np.shape(self._bad) == shape
        if not usual or prepare is None or not masked:
            return None
        with self._lock:
            found = self._prepared.get((prepare, shape))
            if found is None:
                found = prepare(shape, self._constants(m, shape))
                while len(self._prepared) >= _SHAPES:
                    self._prepared.pop(next(iter(self._prepared)))
                self._prepared[prepare, shape] = found
            return found

    # -- preparing -----------------------------------------------------------------------------

    def _taps(self, shape: tuple[int, ...]) -> Array | None:
        sigma_px = self.settings.smoothing_sigma_px
        return gaussian_taps(sigma_px) if sigma_px > 0 and len(shape) == 2 else None

    def _constants(self, m: int, shape: tuple[int, ...]) -> Constants:
        calibration = np.ones(m + 1) if self._calibration is None else self._calibration
        bad, replaced = self._replacement(shape)
        return Constants(
            self.settings,
            inverse_gains(calibration, (m + 1, *shape)),
            self._taps(shape),
            float(range_m(np.float64(1.0), self.settings.base_frequency_hz)),
            bad,
            replaced,
        )

    def _replacement(
        self, shape: tuple[int, ...]
    ) -> tuple[Array | None, Callable[[Array], Array] | None]:
        """Return the flat places of bad pixels, and how to get moments for them from images."""
        if self._bad is None:
            return None, None
        mask = checked_mask(self._bad, shape)
        if not mask.any() or mask.all():
            return np.flatnonzero(mask), None
        replacement = Replacement(mask)
        zeroth = self.settings.zeroth
        return replacement.places, lambda raw: measure(replacement.values(raw), zeroth=zeroth)


def reconstruct(
    data: Array | Sequence[Array],
    settings: Settings | None = None,
    *,
    calibration: Array | None = None,
    saturated_pixels: Array | None = None,
    bad_pixels: Array | None = None,
) -> Reconstruction:
    """Reconstruct one frame of raw images or of moments.

    As ``Reconstructor(settings, calibration=..., bad_pixels=...)(data, saturated_pixels=...)``,
    which see; for many frames keep the `Reconstructor`.
    """
    reconstructor = Reconstructor(settings, calibration=calibration, bad_pixels=bad_pixels)
    return reconstructor(data, saturated_pixels=saturated_pixels)
