"""Synthetic frames of a Kinect v2, what libfreenect2's processor made of them, and the truth."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

import transientcam_moments as tm
from benchmarks.common.measured_scenes import data_folder
from transientcam_driver.cameras.kinect2 import (
    BASE_FREQUENCY_HZ,
    HEIGHT,
    SAMPLING,
    SUB_IMAGES,
    WIDTH,
    DepthParameters,
    P0Tables,
    Rows,
    codes,
)
from transientcam_driver.cameras.kinect2._codes import SATURATED_DN
from transientcam_server.imaging import Intrinsics

Array = NDArray[Any]
MULTIPLES: Final = SAMPLING.multiples
RADIAN_M: Final = float(tm.range_m(np.float64(1.0), BASE_FREQUENCY_HZ))
RESPONSE: Final = np.array([1.0, 1.322581, 1.612903])
"""Noise of a moment at 16, 80 and 120 MHz over that of a sample, but for sqrt(2 / 3)."""
BLOCK: Final = 8
"""Pixels of a side that have one scene and one P0, and so one code without noise."""


def folder() -> Path:
    """Return where the vectors are; TRANSIENTCAM_TEST_DATA names another folder."""
    found = (data_folder() or Path()) / "kinect2"
    if not found.is_dir():
        raise SystemExit(f"no vectors at {found}: set TRANSIENTCAM_TEST_DATA")
    return found


@dataclass(frozen=True)
class Scene:
    """One scene in the rows that the outputs of libfreenect2 are stored of, without the border."""

    name: str
    moments: Array
    """complex (3, N, 510), at 16, 80 and 120 MHz in counts, decoded and computed here."""
    saturated: Array
    """bool (3, N, 510): which of them have a saturated sample."""
    path_m: Array
    """(N, 510): the true path of the first return, from the light to the camera."""
    stored: dict[str, Array]
    """What libfreenect2 made of it, by name."""
    rows: Array
    """Which rows these are."""
    parameters: DepthParameters

    def of_blocks(self, every: Array) -> Array:
        """Return one value of each block from values of every pixel, and so that of all of them."""
        columns = np.arange(BLOCK // 2 - 1, every.shape[-1], BLOCK)
        return every[..., columns]

    def z_mm(self, path_m: Array, rows: Rows) -> Array:
        """Return the depth of points at the end of paths (N, 510), in mm."""
        lens = self.parameters.lens(rows)
        intrinsics = Intrinsics.of_lens(lens, width=WIDTH, height=HEIGHT, source="camera")
        range_m = np.full((HEIGHT, WIDTH), np.nan)
        range_m[self.rows, 1:-1] = path_m / 2
        return 1e3 * intrinsics.points(range_m)[2, self.rows, 1:-1]

    def slopes(self, rows: Rows) -> tuple[Array, Array]:
        """Return x and y (N, 510) of the rays (x, y, 1)."""
        x, y = self.parameters.lens(rows).slopes(WIDTH, HEIGHT)
        return x[self.rows, 1:-1], y[self.rows, 1:-1]


def load(name: str) -> Scene:
    """Read a scene, and decode it."""
    with np.load(folder() / f"{name}.npz") as archive:
        stored = dict(archive)
    sub_images = stored["packet"].reshape((SUB_IMAGES, -1))
    images = codes.frame_images(sub_images[:-1])
    gains = P0Tables.unpack(stored["p0_response"].tobytes()).gains()
    measured = tm.measure(images, zeroth="estimated", phases_rad=SAMPLING.phases_rad)
    moments = np.asarray(tm.calibrate(measured, gains))[1:]
    saturated = (images == SATURATED_DN).reshape((len(MULTIPLES), -1, HEIGHT, WIDTH)).any(axis=1)
    rows = stored["rows"].astype(int)
    path_m = np.kron(stored["path_m"], np.ones((BLOCK, BLOCK)))
    shown = np.s_[..., rows, 1:-1]
    outputs = {
        key: array[:, 1:-1] for key, array in stored.items() if key.startswith(("ir_", "depth_mm_"))
    }
    parameters = DepthParameters.unpack(stored["depth_parameters_response"].tobytes())
    return Scene(name, moments[shown], saturated[shown], path_m[shown], outputs, rows, parameters)


def noise(sample_std: float) -> tm.noise.MomentNoise:
    """Return the noise of moments whose samples have this standard deviation, in counts."""
    return tm.noise.MomentNoise(2 / 3 * (sample_std * RESPONSE) ** 2)
