"""An OPT8241-CDK as a camera: frequencies, exposures, frames that are dropped, and its light."""

from dataclasses import replace

import numpy as np
import pytest

from tests.opt8241.standing import SERIAL, Marked, camera_of, emulated
from transientcam_driver import CameraLost, DeviceRefused, SequenceError, SpecError
from transientcam_driver.camera import CameraName
from transientcam_driver.clock import VirtualClock
from transientcam_opt8241 import Opt8241, Request, plugin as opt8241, registers as reg
from transientcam_opt8241._device import quad_images
from transientcam_simulation.emulated import Fault


@pytest.mark.parametrize("quads", [4, 6])
def test_eight_multiples_of_12_5_mhz_are_one_frame(quads: int) -> None:
    clock = VirtualClock()
    device = emulated(quads, clock=clock)
    with camera_of(device, quads=quads, clock=clock) as camera:
        wanted = {"base_frequency_hz": 12.5e6, "harmonics": 8}
        camera.configure(camera.capabilities.sequence_of(wanted))
        camera.start()
        frame = camera.read_frame()

    labels = {(round(each.frequency_hz / 12.5e6), each.phase_rad) for each in frame.labels}
    assert labels == {(j, 2 * np.pi * k / quads) for j in range(1, 9) for k in range(quads)}
    by_frequency = frame.images.reshape(8, quads, 240, 320)
    above = by_frequency[:, :, 100, 100].astype(int) - 2048
    expected = np.rint(12.5 * np.arange(1, 9))[:, None] + 200 * np.arange(quads)
    assert np.abs(above - expected).max() <= 1  # 12.5 to even, and 4 Hz less than that


def test_a_quad_at_either_end_of_its_scale_is_saturated() -> None:
    words = np.zeros((240, 320, 4), "<u2")
    words[0, 0] = 0x7FF, 0x800, 0x801, 0xFFFF
    words[5, 6, 3] = 0xF123  # the upper four bits say nothing

    images = quad_images(words.tobytes(), 4)

    assert images[:, 0, 0].tolist() == [4095, 4095, 1, 2047]
    assert images[3, 5, 6] == 2048 + 0x123
    assert images[0, 1, 1] == 2048


def test_the_sensor_exposes_for_as_long_as_the_sequence_says() -> None:
    clock = VirtualClock()
    pixels = Marked(4)
    device = emulated(clock=clock)
    device._pixels = pixels
    with camera_of(device, clock=clock) as camera:
        wanted = {"base_frequency_hz": 20e6, "harmonics": 1, "exposure_s": 1e-4}
        applied = camera.configure(camera.capabilities.sequence_of(wanted))
        camera.start()
        camera.read_frame()

    assert applied.sequence.exposure_s == pytest.approx(3 / 30720)
    frequency_hz, exposure_s = pixels.taken[-1]
    assert exposure_s == pytest.approx(applied.sequence.exposure_s)
    assert frequency_hz == pytest.approx(20e6, abs=100)


def test_the_light_is_on_only_for_the_frames_that_are_read() -> None:
    clock = VirtualClock()
    device = emulated(clock=clock)
    with camera_of(device, clock=clock) as camera:
        camera.start()
        assert not device.lit
        camera.read_frame()
        assert not device.lit
    assert not device.lit


@pytest.mark.parametrize("fault", [Fault.DROP, Fault.CORRUPT_PIXELS])
def test_a_short_frame_is_counted(fault: Fault) -> None:
    clock = VirtualClock()
    device = emulated(clock=clock)
    with camera_of(device, clock=clock) as camera:
        camera.start()
        camera.read_frame()
        device.inject(fault)
        frame = camera.read_frame()

    assert frame.lost_images == camera.counters.lost == 4


def test_a_camera_whose_frames_stay_away_is_lost() -> None:
    clock = VirtualClock()
    device = emulated(clock=clock)
    with camera_of(device, clock=clock) as camera:
        camera.start()
        camera.read_frame()
        device.registers._put(reg.OUTPUT_MODE, 1)
        with pytest.raises(
            CameraLost, match=r"5 times in a row images were lost: no frame came within 0\.6 s"
        ):
            camera.read_frame(timeout_s=60.0)
        assert not device.lit


def test_an_exposure_that_the_camera_refuses_is_an_error() -> None:
    device = emulated()
    opened = Opt8241(device.connect())
    applied = opened.capabilities.apply(opened.capabilities.sequence_of({}))
    longer = replace(applied, sequence=replace(applied.sequence, exposure_s=1e-3))

    with pytest.raises(DeviceRefused, match="duty cycle"):
        opened.configure(longer)


def test_frequencies_beyond_the_data_sheet_are_refused() -> None:
    with camera_of(emulated()) as camera:
        for wanted in ({"base_frequency_hz": 9e6}, {"base_frequency_hz": 40e6, "harmonics": 3}):
            with pytest.raises(SequenceError, match="base_frequency_hz"):
                camera.configure(camera.capabilities.sequence_of(wanted))


def test_no_request_of_the_firmware_loader_is_ever_sent() -> None:
    device = emulated()
    link = device.connect()
    sent: list[tuple[int, int]] = []
    write = link.control_out

    def noted(request: Request, value: int, index: int, data: bytes) -> None:
        sent.append((request, value))
        write(request, value, index, data)

    link.control_out = noted  # type: ignore[method-assign]
    Opt8241(link).close()

    assert {request for request, _ in sent} == {0x03, 0x09, 0x0B}
    slaves = {value for request, value in sent if request == 0x09}
    assert slaves == {reg.BANK_0, reg.BANK_3}
    assert {value for request, value in sent if request == 0x03} == {0x5400}


def test_a_report_names_what_the_maintainer_needs() -> None:
    opened = Opt8241(emulated().connect())

    facts = dict(opened.facts())

    assert facts["firmware"] == "0.17"
    assert facts["serial number"] == SERIAL
    assert facts["temperature"] == "sensor 35 °C, light 40 °C"
    assert "58:82 = 0186a0" in facts["registers"]


def test_a_name_with_other_phases_is_refused() -> None:
    with pytest.raises(SpecError, match="phases = '5': must be one of 4, 6"):
        opt8241.PLUGIN.check(CameraName.parse("opt8241:emulated?phases=5"))
    opt8241.PLUGIN.check(CameraName.parse("opt8241:0042?phases=6"))
    with pytest.raises(SpecError, match="scene belongs to opt8241:emulated"):
        opt8241.PLUGIN.check(CameraName.parse("opt8241?scene=hall"))
