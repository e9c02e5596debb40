"""Our driver and our emulation, held to the recorded session of the vendor's client."""

from pathlib import Path

import numpy as np

from tests.driver.cameras.tofcam660.recorded_camera import RecordedCamera
from tests.driver.cameras.tofcam660.session import frames, steps
from transientcam_driver import Sequence, SubPhases, TriggeredCamera
from transientcam_driver.cameras.tofcam660 import Command, DeviceOptions, Region, Tofcam660
from transientcam_driver.cameras.tofcam660._image import HEADER_BYTES
from transientcam_simulation.emulated._tofcam660.firmware import EmulatedFirmware

ROI = Region(100, 90, 180, 150)


class DarkPixels:
    """At the temperature of the recorded camera, in the dark."""

    def temperature_c(self, device_time_s: float) -> float:
        return 41.25

    def expose_for(self, exposure_s: float) -> None:
        pass

    def prepare(self, frequency_hz: float, exposure_s: float) -> None:
        pass

    def differences(self, *_: float, **__: float) -> np.ndarray:
        return np.full((4, 240, 320), 2048, np.uint16)

    def sum(self, *_: float, **__: float) -> np.ndarray:
        return np.zeros((240, 320), np.uint16)


def test_the_emulation_answers_each_recorded_request_byte_for_byte(data_dir: Path) -> None:
    firmware = EmulatedFirmware(DarkPixels(), lambda: 0.0)  # type: ignore[arg-type]

    for step in steps(data_dir):
        answer, image = firmware.handle(step.payload)
        assert answer == step.response, step.name
        assert (image is None) == (step.image is None)
        if image is not None and step.image is not None:
            assert image[:HEADER_BYTES].hex() == step.image["header"]
            assert len(image) == step.image["bytes"]


def test_our_driver_sends_recorded_bytes_and_reads_recorded_images(data_dir: Path) -> None:
    recorded = RecordedCamera(data_dir)
    options = DeviceOptions(
        data_over="tcp",
        region=ROI,
        settle_s=0.0,
        control_port=recorded.control_port,
        data_port=recorded.data_port,
    )
    stored = frames(data_dir)
    with TriggeredCamera(lambda: Tofcam660("127.0.0.1", options)) as camera:
        camera.configure(
            Sequence(
                base_frequency_hz=7e6,
                harmonics=4,
                zeroth="low-frequency",
                exposure_s=300e-6,
                sub_phases=SubPhases("none"),
            )
        )
        camera.start()
        frame = camera.read_frame()
        capabilities = camera.capabilities
    recorded.close()

    first_set = recorded.unknown.pop(0)  # what a camera captures before anything is set
    assert int.from_bytes(first_set[8:10], "big") == Command.SET_INTEGRATION_TIMES
    assert recorded.unknown == []
    for group, megahertz in enumerate(("0.25", "7", "14", "21", "28")):
        wire = stored[f"flex_{megahertz}MHz_dcs_wire_u16"]
        images = frame.images[4 * group : 4 * group + 4]
        corrupt = wire >= 64000
        assert np.array_equal(images[~corrupt], wire[~corrupt])
        assert (images[corrupt] == 4095).all()
    assert frame.temperature_c == 41.25
    assert (capabilities.serial, capabilities.firmware) == ("7-4242", "3.59")
    assert (capabilities.width, capabilities.height) == (80, 60)
