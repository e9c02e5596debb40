"""A TOFcam660 that is used with chosen multiples of one frequency."""

import numpy as np
import pytest

from tests.driver.cameras.tofcam660.conftest import Emulation
from transientcam_driver import Sequence, SpecError, SubPhases, TriggeredCamera
from transientcam_driver.camera import CameraName
from transientcam_driver.cameras.tofcam660 import DeviceOptions, Region, Tofcam660
from transientcam_server.imaging import Recipe
from transientcam_server.settings import ReconstructionSettings
from transientcam_simulation.entries.tofcam660 import device_options

REGION = Region(152, 112, 168, 128)


@pytest.mark.parametrize("text", ["3,2", "2,4", "0,1", "1,33", "2,", "a", "", "1,2,3,3"])
def test_what_are_no_multiples_is_refused(text: str) -> None:
    with pytest.raises(SpecError, match="multiples = "):
        device_options(CameraName.parse(f"tofcam660:192.168.10.31?multiples={text}"))


def test_two_frequencies_have_the_range_of_their_common_divisor(emulated: Emulation) -> None:
    name = CameraName.parse("tofcam660:127.0.0.1?multiples=2,3")
    options = DeviceOptions(
        settle_s=0.0,
        region=REGION,
        multiples=device_options(name).multiples,
        control_port=emulated.device.control_port,
        data_port=emulated.device.data_port,
    )
    with TriggeredCamera(lambda: Tofcam660(emulated.device.host, options)) as camera:
        applied = camera.configure(
            Sequence(
                7e6, harmonics=2, zeroth="estimated", exposure_s=2e-3, sub_phases=SubPhases("none")
            )
        )
        camera.start()
        frame = camera.read_frame(timeout_s=60.0)
    truth_m = emulated.simulation.truth().range_m[112:128, 152:168]

    found = Recipe(applied, ReconstructionSettings(estimator="likelihood"), 4095.0).reconstruct(
        frame
    )

    assert [label.frequency_hz for label in frame.labels[::4]] == [14e6, 21e6]
    assert np.median(np.abs(found.range_m - truth_m)) < 5e-3
