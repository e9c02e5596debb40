"""Frames of the emulated Kinect v2, and what libfreenect2 itself read of them over USB.

`benchmarks.kinect2.by_libfreenect2` makes the outputs that are read here.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

import transientcam_moments as tm
from benchmarks.common.records import ROOT
from benchmarks.common.tables import Table, heads
from benchmarks.kinect2.decoding import ERRORS, ROUNDING, TOO_LONG, errors
from tests.driver.cameras.kinect2 import libfreenect2
from tests.driver.cameras.kinect2.vectors import MULTIPLES, RADIAN_M, Array, noise
from transientcam_driver.camera import CameraName
from transientcam_driver.cameras.kinect2 import HEIGHT, SAMPLING, WIDTH, Kinect2Camera
from transientcam_driver.cameras.kinect2._codes import SATURATED_DN
from transientcam_driver.cameras.kinect2._parameters import LIGHT_X_M
from transientcam_driver.clock import VirtualClock
from transientcam_simulation.entries.kinect2 import PLUGIN

SCENES: Final = ("corner", "hall")
STEP: Final = 12
"""Every so many rows and columns are stored."""
EVERY: Final = np.s_[STEP // 2 :: STEP, STEP // 2 :: STEP]
STORED: Final = ROOT / "tests" / "driver" / "cameras" / "kinect2" / "libfreenect2.npz"


def spec(scene: str) -> str:
    """Return the name of the camera in front of a scene; its frames are all the same."""
    return f"kinect2:emulated?scene={scene}&noise=off"


@dataclass(frozen=True)
class ObservedFrame:
    """One frame of the emulated camera, every so many pixels (N, M) of it."""

    moments: Array
    """complex (3, N, M), at 16, 80 and 120 MHz, decoded and computed here."""
    saturated: Array
    """Which pixels have a saturated sample."""
    true_m: Array
    """Range of the first return."""
    slopes: tuple[Array, Array]
    """x and y of the rays (x, y, 1), as libfreenect2 has them."""

    @classmethod
    def of(cls, scene: str) -> "ObservedFrame":
        """Capture one frame through packets and codes."""
        with PLUGIN.open(CameraName.parse(spec(scene)), VirtualClock()) as camera:
            assert isinstance(camera, Kinect2Camera)
            camera.start()
            images = camera.read_frame(timeout_s=600.0).images[:, *EVERY]
            assert camera.simulation is not None
            true_m = camera.simulation.truth().first_return_m[EVERY]
            assert camera.factory is not None
            gains, lens = camera.factory.gains, camera.factory.lens
            assert gains is not None
            assert lens is not None
        measured = tm.measure(images, zeroth="estimated", phases_rad=SAMPLING.phases_rad)
        moments = np.asarray(tm.calibrate(measured, gains[:, *EVERY]))[1:]
        # the principal point is in the middle, so that rows may be counted from either end
        x, y = (each[EVERY] for each in lens.slopes(WIDTH, HEIGHT))
        return cls(moments, (images == SATURATED_DN).any(axis=0), true_m, (x, y))

    def infrared(self) -> Array:
        """Return the infrared image that libfreenect2's arithmetic makes of it."""
        return np.asarray(np.minimum(16 / 3 * np.abs(self.moments).sum(axis=0), 65_535))

    def depth_mm(self) -> Array:
        """Return the depth that libfreenect2's arithmetic, stated anew, makes of it."""
        path_m = np.where(self.saturated, 0.0, libfreenect2.path_m(self.moments))
        return libfreenect2.depth_mm(path_m, *self.slopes)

    def range_m(self, depth_mm: Array) -> Array:
        """Return the range at libfreenect2's depth, its speed of light put right; NaN if void."""
        x, y = self.slopes
        along = depth_mm / 1e3 * np.sqrt(x * x + y * y + 1)
        path_m = along + np.sqrt(along**2 - 2 * depth_mm / 1e3 * LIGHT_X_M * x)
        return np.where(depth_mm > 0, path_m / 2 / TOO_LONG, np.nan)


def stored(scene: str) -> dict[str, Array]:
    """Return what libfreenect2 made of a scene: `ir`, `depth_mm` and `depth_mm_filtered`."""
    with np.load(STORED) as archive:
        return {
            name.removeprefix(f"{scene}_"): archive[name]
            for name in archive
            if name.startswith(f"{scene}_")
        }


def tables() -> Iterator[Table]:
    """Hold libfreenect2's depths and our ranges of the same frames against the truth."""
    made = Table("Read by libfreenect2", heads(f"scene, one frame without noise | {ERRORS}"))
    apart_mm, same = 0.0, 1.0
    for scene in SCENES:
        seen, theirs = ObservedFrame.of(scene), stored(scene)
        two = tm.two_returns(seen.moments, noise(ROUNDING), harmonics=MULTIPLES)
        ours_m = RADIAN_M * np.asarray(two.separate().phase_rad)
        found_m: dict[str, Any] = {
            "libfreenect2, filters off": seen.range_m(theirs["depth_mm"]),
            "libfreenect2, filters on": seen.range_m(theirs["depth_mm_filtered"]),
            "`tm.two_returns`": ours_m,
            "the same, `unexplained` left out": np.where(two.explained(), ours_m, np.nan),
        }
        for name, range_m in found_m.items():
            if np.isfinite(range_m).any():
                made.rows.append((f"`{scene}`: {name}", *errors(range_m - seen.true_m)))
        restated, depth_mm = seen.depth_mm(), theirs["depth_mm"]
        both = (restated > 0) & (depth_mm > 0)
        apart_mm = max(apart_mm, float(np.abs(restated - depth_mm)[both].max()))
        same = min(same, float(((restated > 0) == (depth_mm > 0)).mean()))
    made.notes.append(
        f"Frames of `{spec('corner')}` and of `hall`, every {STEP}th row and column. Errors are "
        "those of the first return's range, libfreenect2's from its depth with its speed of light "
        "put right. Most pixels of `hall` have three returns, which three frequencies cannot "
        "separate: they show that two are too few, and the pixel has the flag `unexplained`. So "
        "has every pixel of the corner without noise, where light comes back over a while. "
        "libfreenect2's arithmetic as it is stated on this page is void in the same pixels "
        f"({same:.2%} of them), and its depths are within {apart_mm:.2f} mm of those that it gave."
    )
    yield made
