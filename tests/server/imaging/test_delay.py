"""A camera that says how late light is inside of it: nominal gains take that away."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pytest
from numpy.typing import NDArray

from transientcam_driver import AppliedSequence, RawFrame, Sequence, SubPhases, open_camera
from transientcam_driver.sequence import SPEED_OF_LIGHT_M_S
from transientcam_server.imaging import Recipe, moment_columns, nominal_gains
from transientcam_server.settings import ReconstructionSettings

REGION = (120, 90, 200, 150)


@dataclass(frozen=True)
class Capture:
    applied: AppliedSequence
    frame: RawFrame
    true_m: NDArray[np.float64]


@pytest.fixture(scope="module")
def capture() -> Iterator[Capture]:
    left, top, right, bottom = REGION
    edges = ",".join(map(str, REGION))
    spec = f"tofcam660:emulated?scene=wall&noise=off&settle_s=0&region={edges}"
    with open_camera(spec) as camera:
        applied = camera.configure(
            Sequence(
                base_frequency_hz=7e6,
                harmonics=4,
                zeroth="low-frequency",
                exposure_s=3e-3,
                sub_phases=SubPhases("none"),
            )
        )
        camera.start()
        frame = camera.read_frame(timeout_s=60.0)
        assert camera.simulation is not None
        true_m = camera.simulation.truth().range_m[top:bottom, left:right]
        yield Capture(applied, frame, true_m)


def test_the_range_is_the_scenes(capture: Capture) -> None:
    recipe = Recipe(capture.applied, ReconstructionSettings(), 4095.0)

    found_m = recipe.reconstruct(capture.frame).range_m

    # some pixels are rounded so that they seem to have a second return beside the first
    apart_m = np.abs(found_m - capture.true_m)
    assert np.median(apart_m) < 1e-3
    assert np.percentile(apart_m, 90) < 10e-3
    assert capture.applied.delay_s * SPEED_OF_LIGHT_M_S > 1.0  # else nothing was taken away


def test_the_gains_that_are_written_down_have_the_delay(capture: Capture) -> None:
    applied = capture.applied

    gains = moment_columns(applied, capture.frame.labels, None)["gain"].values

    turns = np.angle(gains / nominal_gains(applied.sequence)) / (2 * np.pi)
    expected = np.arange(5) * applied.sequence.base_frequency_hz * applied.delay_s
    assert (turns - expected + 0.5) % 1 == pytest.approx(np.full(5, 0.5))
