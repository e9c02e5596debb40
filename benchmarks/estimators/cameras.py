"""How far apart two returns have to be for a camera: bounds, estimators, and one frame.

The bound is arithmetic; moments have noise of a known seed, and so has the frame of the emulated
TOFcam660, so that none depends on the machine.
"""

from collections.abc import Iterator
from typing import Final

import numpy as np

from benchmarks.common.tables import Table
from benchmarks.estimators import camera_estimates, camera_pairs
from benchmarks.estimators.camera_estimates import Measured, first_return_std_m
from transientcam_driver import Sequence, SubPhases, open_camera
from transientcam_driver.cameras.tofcam660._image import FULL_SCALE_DN
from transientcam_server.imaging import Recipe
from transientcam_server.settings import ReconstructionSettings

SEPARATIONS_M: Final = (0.3, 0.6, 1.2, 2.4, 5.0)
HALL: Final = "tofcam660:emulated?scene=hall&settle_s=0&seed=1"


CAMERAS: Final = (
    Measured("TOFcam660, 7 MHz x 1..4", 7e6, (1, 2, 3, 4)),
    Measured("TOFcam660, 3.5 MHz x 1..8", 3.5e6, tuple(range(1, 9))),
    Measured("TOFcam660, 14 MHz x 1..2", 14e6, (1, 2)),
    Measured("prototype of the paper, 23 MHz x 1..3", 23e6, (1, 2, 3)),
    Measured("prototype of the paper, 23 MHz x 1..4", 23e6, (1, 2, 3, 4)),
)


def table() -> Table:
    """Compute the bounds of all cameras."""
    columns = ("frequencies", *(f"{each:g} m apart" for each in SEPARATIONS_M))
    made = Table("Least deviation of the nearer of two returns", columns)
    for camera in CAMERAS:
        bounds = (first_return_std_m(camera, each) for each in SEPARATIONS_M)
        made.rows.append((camera.name, *map(_shown, bounds)))
    return made


def frame_of_hall() -> str:
    """Say how well one frame of the emulated TOFcam660 tells the returns of `hall` apart."""
    sequence = Sequence(
        base_frequency_hz=7e6,
        harmonics=4,
        zeroth="low-frequency",
        exposure_s=2e-3,
        sub_phases=SubPhases("none"),
    )
    with open_camera(HALL) as camera:
        applied = camera.configure(sequence)
        camera.start()
        frame = camera.read_frame(timeout_s=600.0)
        assert camera.simulation is not None
        truth = camera.simulation.truth()
    found = Recipe(applied, ReconstructionSettings(), FULL_SCALE_DN).reconstruct(frame)
    range_m = np.abs(found.range_m - truth.range_m)
    direct = np.abs(found.direct - truth.direct) / truth.brightness
    return (
        f"One frame of `{HALL}` with 7 MHz x 1..4, b_0 at 0.25 MHz and 2 ms an image: the range is "
        f"within {np.median(range_m) * 1e3:.1f} mm in half of all pixels and within "
        f"{np.percentile(range_m, 90) * 1e3:.0f} mm in 90 % of them, the direct light within "
        f"{np.median(direct):.2%} and {np.percentile(direct, 90):.2%} of the brightness."
    )


def _shown(std_m: float) -> str:
    if std_m >= 10.0:
        return "more than 10 m"
    return f"{std_m * 1e3:.0f} mm" if std_m < 1.0 else f"{std_m:.1f} m"


def tables() -> Iterator[Table]:
    """Compare estimators and bounds."""
    yield camera_estimates.table()
    yield camera_pairs.table()
    made = table()
    made.notes.append(frame_of_hall())
    yield made
