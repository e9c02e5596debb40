"""The corner of a room in front of an emulated Kinect v2, by one return and by two."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

import transientcam_moments as tm
from benchmarks.common.picture import blank, saved
from benchmarks.common.tables import Table, heads
from benchmarks.kinect2.decoding import ERRORS, TOO_LONG, errors
from tests.driver.cameras.kinect2 import libfreenect2
from tests.driver.cameras.kinect2.vectors import MULTIPLES, RADIAN_M, Array
from transientcam_driver.camera import CameraName
from transientcam_driver.cameras.kinect2 import SAMPLING
from transientcam_driver.clock import VirtualClock
from transientcam_server.camera import sensor_of
from transientcam_server.imaging import Intrinsics
from transientcam_server.settings import SensorSettings
from transientcam_simulation.entries.kinect2 import PLUGIN

SPEC: Final = "kinect2:emulated?scene=corner&seed=1"
STEP: Final = 4
"""Every so many rows and columns are computed."""
LIBFREENECT2: Final = "libfreenect2"
ONE: Final = "`tm.unwrap`, one return"
TWO: Final = "`tm.two_returns`"


@dataclass(frozen=True)
class Corner:
    """Ranges in m of every fourth pixel, by estimator, and the true ones."""

    found_m: dict[str, Array]
    true_m: Array
    lens: Intrinsics


def captured() -> Corner:
    """Capture one frame through the emulated camera, and estimate it in three ways."""
    with PLUGIN.open(CameraName.parse(SPEC), VirtualClock()) as camera:
        camera.start()
        images = camera.read_frame(timeout_s=600.0).images
        assert camera.simulation is not None
        assert camera.factory is not None
        assert camera.factory.lens is not None
        gains = camera.factory.gains
        assert gains is not None
        true_m = camera.simulation.truth().range_m
        lens = camera.factory.lens
        sensor = sensor_of(camera, SensorSettings())
    every = np.s_[:, STEP // 2 :: STEP, STEP // 2 :: STEP]
    measured = tm.measure(images[every], zeroth="estimated", phases_rad=SAMPLING.phases_rad)
    moments = np.asarray(tm.calibrate(measured, gains[every]))[1:]
    noise = tm.noise.moment_noise(
        np.abs(moments).mean(axis=0),
        sensor,
        calibration=np.abs(gains).mean(axis=(1, 2)),
        zeroth="estimated",
        phases_rad=SAMPLING.phases_rad,
    )
    of_three = tm.noise.MomentNoise(noise.variance[1:])
    one = tm.unwrap(moments, of_three, harmonics=MULTIPLES)
    two = tm.two_returns(moments, of_three, harmonics=MULTIPLES)
    path_m = libfreenect2.path_m(moments) / TOO_LONG
    found_m = {
        LIBFREENECT2: np.where(path_m > 0, path_m / 2, np.nan),
        ONE: RADIAN_M * np.asarray(one.phase_rad),
        TWO: RADIAN_M * np.asarray(two.separate().phase_rad),
    }
    height, width = images.shape[1:]
    intrinsics = Intrinsics.of_lens(lens, width=width, height=height, source="camera")
    return Corner(found_m, true_m[every[1:]], intrinsics)


def tables(figures: Path) -> Iterator[Table]:
    """Hold the three against the truth, and draw kinect2-corner.png."""
    corner = captured()
    draw(corner, figures / "kinect2-corner.png")
    yield table(corner)


def table(corner: Corner) -> Table:
    """Hold the three against the truth."""
    rows = [(name, *errors(each - corner.true_m)) for name, each in corner.found_m.items()]
    return Table("A corner of a room", heads(f"one frame of the corner | {ERRORS}"), rows)


def draw(corner: Corner, path: Path) -> None:
    """Draw the middle row from above, and how far each estimate is off."""
    row = len(corner.true_m) // 2
    figure = blank(9, 3.6)
    above, error = figure.subplots(1, 2)
    columns = STEP * np.arange(corner.true_m.shape[1]) + STEP // 2
    slope = (columns - corner.lens.cx) / corner.lens.fx
    along = np.hypot(slope, 1.0)
    for name, range_m in {"truth": corner.true_m, **corner.found_m}.items():
        z_m = range_m[row] / along
        style = {"color": "black", "linewidth": 1.0} if name == "truth" else {"linewidth": 1.2}
        above.plot(slope * z_m, z_m, label=name.replace("`", ""), **style)
        if name != "truth":
            error.plot(columns, 1e3 * (range_m - corner.true_m)[row], linewidth=1.2)
            error.lines[-1].set_color(above.lines[-1].get_color())
    above.set(title="the middle row from above", xlabel="x / m", ylabel="z / m", aspect="equal")
    above.legend(fontsize=8)
    error.axhline(0.0, color="black", linewidth=1.0)
    error.set(title="error of the range", xlabel="column", ylabel="mm")
    path.write_bytes(saved(figure, "png"))
