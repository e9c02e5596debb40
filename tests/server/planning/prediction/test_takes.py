"""What takes give a camera of fixed frequencies."""

from dataclasses import replace

import numpy as np
import pytest

import transientcam_moments as tm
from tests.server.imaging.products.test_pixel import GAPPED, frame_of
from transientcam_driver import AppliedSequence, ImageLabel, TriggeredCamera
from transientcam_driver.clock import VirtualClock
from transientcam_server.imaging import Recipe, factory_gains
from transientcam_server.planning import predict_takes
from transientcam_server.settings import ReconstructionSettings
from transientcam_supervisor import OffSwitch


class FixedDevice:
    """Sends the images of two returns, at 16, 80 and 120 MHz."""

    capabilities = replace(GAPPED, settle_s=0.0, max_takes=6)
    off_switch = OffSwitch()

    def configure(self, applied: AppliedSequence) -> None:
        self._frame = frame_of(applied)

    def prepare(self, labels: tuple[ImageLabel, ...]) -> float:
        return 0.0

    def trigger(self, labels: tuple[ImageLabel, ...]) -> None:
        self._asked = [label.index for label in labels]

    def receive(self, timeout_s: float) -> np.ndarray:
        return self._frame.images[self._asked]

    def temperature_c(self) -> float:
        return 25.0

    def light_off(self) -> None:
        pass

    def close(self) -> None:
        pass


@pytest.mark.parametrize(("read_noise_e", "gain_e_per_dn"), [(10.0, 1.0), (0.01, 1e4)])
def test_scatter_falls_with_the_root_of_the_takes_however_large_the_error_of_the_model(
    read_noise_e: float, gain_e_per_dn: float
) -> None:
    sensor = tm.noise.Sensor(
        gain_e_per_dn=gain_e_per_dn,
        full_well_e=1e9,
        read_noise_e=read_noise_e,
        dark_dn=0.0,
        bits=12,
    )
    with TriggeredCamera(FixedDevice, clock=VirtualClock()) as camera:
        camera.configure(camera.capabilities.sequence_of({"base_frequency_hz": 8e6, "takes": 2}))

        found = predict_takes(camera, sensor, read_s=10.0)

        assert camera.state == "idle"
        camera.start()
        settings = ReconstructionSettings(neighbours="none", estimator="two-returns")
        gains = factory_gains(camera.factory)
        recipe = Recipe(camera.applied, settings, 4095.0, gains, sensor=sensor)
        shown_m = recipe.reconstruct(camera.read_frame(timeout_s=60.0)).range_scatter_m()
    assert [each.takes for each in found] == [1, 2, 4]  # the camera can do six
    one, _, four = found
    assert four.capture_s == pytest.approx(4 * one.capture_s)
    assert four.frame_rate_hz == pytest.approx(one.frame_rate_hz / 4)
    assert four.range_std_m / one.range_std_m == pytest.approx(0.5, rel=0.1)
    assert one.range_std_m == pytest.approx(np.nanmedian(shown_m), rel=0.1)
