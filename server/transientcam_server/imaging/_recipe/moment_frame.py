"""A capture whose moments came from another service, without the images."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from transientcam_driver import RawFrame

OF_IMAGES: Final = ("rejected_images", "repaired_images", "unrepaired_images", "filled_images")
"""What a frame's metadata say of what was done to its images before they became moments."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MomentFrame(RawFrame):
    """A capture that enters a pipeline behind the step from images to moments.

    ``images`` is empty, (0, H, W); ``labels`` are those of the images that were captured.
    """

    moments: NDArray[np.complex64]
    """complex64 (m + 1, H, W) in DN: calibrated, bad pixels replaced, neither smoothed nor
    biased."""
    saturated: NDArray[np.bool_]
    """bool (H, W): pixels that were saturated in an image."""
    treated: Mapping[str, Any]
    """What was done to the images, under the names `OF_IMAGES`."""
    ambient_dn: float = 0.0
    """Light in DN an image that is not the camera's, of the median pixel: all are taken to have
    that."""

    @property
    def size_bytes(self) -> int:
        """What a frame takes in memory, but for a few hundred bytes."""
        return self.moments.nbytes + self.saturated.nbytes
