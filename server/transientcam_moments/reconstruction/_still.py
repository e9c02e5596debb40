"""Averaging over the frames of a stream as the settings have it."""

from dataclasses import dataclass, replace

import numpy as np

from transientcam_moments.arrays import Array
from transientcam_moments.images import Repair
from transientcam_moments.noise import (
    CapturedImages,
    ImageNoise,
    MomentNoise,
    Sensor,
    Still,
    average_frames,
)
from transientcam_moments.reconstruction._neighbours import known_noise, measured_noise
from transientcam_moments.reconstruction._settings import Settings


@dataclass(frozen=True, slots=True, eq=False)
class Measured:
    """Moments of one frame, and what goes with them: between images and all that follows.

    A `Reconstructor` that is called with what another one measured, in `Reconstruction.measured`,
    with the same settings, calibration and bad pixels goes on to the same results, but for noise of
    pixels with recovered images; of one take the compiled pass may round in another way.

    Attributes
    ----------
    moments : array, shape (m + 1, ...)
        Of this frame alone: calibrated, neither smoothed nor averaged.
    saturated : boolean array, shape (...), optional
        Pixels to be flagged.
    kept, repaired, images, low : optional
        As of `Reconstruction`.
    ambient_dn : float
        Light in DN an image that was not the camera's, the same for all pixels: without images.
    corrupt : bool
        Whether images were not as they were captured: it is averaged with no other frame.
    image_noise : optional
        Of the settings' sensor, or else as the images show it; once it is averaged.
    still : Still, optional
        The average with the frames before, which is gone on with; None where there is none.
    """

    moments: Array
    saturated: Array | None = None
    kept: Array | None = None
    repaired: Repair | None = None
    images: CapturedImages | None = None
    low: Array | None = None
    ambient_dn: float = 0.0
    corrupt: bool = False
    image_noise: Sensor | ImageNoise | None = None
    still: Still | None = None

    def average_alone(self) -> "Measured | None":
        """Return the average without all that `measure` returns again; None where there is none."""
        if self.still is None:
            return None
        none = np.empty(0)
        still = self.still._replace(noise=MomentNoise(none), mean=none, recent=none, seen=none)
        return Measured(still.moments, image_noise=self.image_noise, still=still)

    @property
    def is_alone(self) -> bool:
        """Whether it is of `average_alone`."""
        return self.still is not None and not self.still.mean.size

    def beside(self, measured: "Measured") -> "Measured":
        """Return what `measure` gave of the same data with this average."""
        return replace(measured, image_noise=self.image_noise, still=self.still)


def over_frames(
    frame: Measured, before: Measured | None, settings: Settings, calibration: Array | None
) -> Measured:
    """Average a frame with the one before; it stays as it is where no one knows its noise."""
    known = known_noise(frame.moments, settings, frame.images)
    images = frame.images
    noise = measured_noise(frame.moments, settings, known, calibration, images, frame.ambient_dn)
    if noise is None or frame.moments.ndim != 3:
        return frame
    left_out = frame.saturated
    if left_out is not None and images is not None and images.saturated_pixels is not None:
        left_out = left_out & ~images.saturated_pixels  # recovered, or NaN
        noise = MomentNoise(noise.variance * images.variance)
    still = average_frames(
        frame.moments,
        noise,
        None if before is None else before.still,
        most_frames=settings.still_frames,
        multiples=None if settings.multiples is None else (0, *settings.multiples),
        left_out=left_out,
        corrupt=frame.corrupt,
    )
    return replace(frame, image_noise=known, still=still)
