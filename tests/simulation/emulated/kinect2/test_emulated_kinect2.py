"""The emulated Kinect v2: what its pixels measure, and which requests it takes."""

import struct
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from transientcam_driver.camera import Sensor
from transientcam_driver.cameras.kinect2 import P0Tables, Request, _commands as commands, codes
from transientcam_driver.cameras.kinect2._codes import SATURATED_DN
from transientcam_driver.clock import VirtualClock
from transientcam_driver.errors import TransferStalled
from transientcam_simulation.emulated import build_kinect2, find_scene
from transientcam_simulation.emulated._kinect2 import EmulatedFirmware

SPEED_OF_LIGHT_M_S = 299_792_458.0
TwoFrames = tuple[NDArray[Any], NDArray[Any], NDArray[Any], NDArray[Any], Sensor]
PATCH = np.s_[:, 180:240, 220:290]


@pytest.fixture(scope="module")
def two_frames() -> TwoFrames:
    device, simulation = build_kinect2(find_scene("wall"), seed=1, clock=VirtualClock())
    frames = [
        codes.frame_images(device._pixels.sub_images(number, device_time_s=number / 30))
        for number in range(2)
    ]
    assert frames[0].max() < SATURATED_DN
    device.firmware.suspended = False
    p0 = _answer(device.firmware, commands.READ_P0)
    one, other = (frame[PATCH].astype(float) for frame in frames)
    truth = simulation.truth()
    path_m = 2 * truth.range_m[PATCH[1:]]
    return one, other, P0Tables.unpack(p0).units[PATCH].astype(float), path_m, simulation.sensor


def test_phases_are_those_of_the_path_and_of_the_tables_that_the_camera_reports(
    two_frames: TwoFrames,
) -> None:
    one, _, p0, path_m, _ = two_frames
    # sample k = g Re(b exp(i (2 pi k / 3 - P0))), b = a exp(2 pi i f D / c); images are at
    # 0, 120 and 240 degrees of exp(-i theta): k = 0, 2, 1
    for place, (frequency_hz, table) in enumerate(((16e6, 1), (80e6, 0), (120e6, 2))):
        samples = one[3 * place : 3 * place + 3]
        phasor = sum(
            sample * np.exp(-2j * np.pi * k / 3)
            for sample, k in zip(samples, (0, 2, 1), strict=True)
        )
        expected_rad = 2 * np.pi * frequency_hz * path_m / SPEED_OF_LIGHT_M_S
        expected_rad = expected_rad - p0[table] * 31e-6 * np.pi
        off_rad = np.angle(phasor * np.exp(-1j * expected_rad))
        assert abs(off_rad.mean()) < 2e-3
        assert off_rad.std() < 0.02


def test_noise_is_that_of_the_sensor_that_the_simulation_states(two_frames: TwoFrames) -> None:
    one, other, _, _, sensor = two_frames
    amplitude = np.abs(one[0] + one[1] * np.exp(2j * np.pi / 3) + one[2] * np.exp(4j * np.pi / 3))
    half_e = amplitude.mean() * 2 / 3 / 2 * sensor.gain_e_per_dn  # of b_0 = |b|
    read_e = sensor.read_noise_e
    # companding to steps of up to 64 codes is part of it
    rounding = np.mean([_step(image) ** 2 / 12 for image in one[:3]])
    expected_dn2 = (half_e + read_e**2) / sensor.gain_e_per_dn**2 + rounding

    found_dn2 = ((one[:3] - other[:3]) ** 2).mean() / 2

    assert found_dn2 == pytest.approx(expected_dn2, rel=0.15)


def _step(image: NDArray[Any]) -> NDArray[Any]:
    """Distance of neighbouring codes at a sample, by the table of the notes."""
    size = np.abs(image - (1 << 14))
    return np.where(size < 256, 1.0, 2.0 ** (np.floor(np.log2(np.maximum(size, 256))) - 7))


def _answer(firmware: EmulatedFirmware, request: Request, sequence: int = 5) -> bytes:
    firmware.write(request.pack(sequence))
    answer = firmware.read(request.most_bytes)
    assert firmware.read(16) == struct.pack("<II8x", 0x0A6FE000, sequence)
    return answer


@pytest.mark.parametrize(
    "data",
    [
        b"",
        commands.STOP.pack(1)[:-1],
        commands.STOP.pack(1) + bytes(8),
        b"\0" + commands.STOP.pack(1)[1:],
        struct.pack("<5I", 0x06022009, 1, 0, 0x77, 0),
        commands.INITIALISE_STREAMS.pack(1),
        commands.STREAMING_ON.pack(1),
    ],
    ids=["empty", "short", "two parameters", "magic", "unknown", "not ready", "not initialised"],
)
def test_a_request_that_is_malformed_or_out_of_order_stalls(data: bytes) -> None:
    firmware = EmulatedFirmware("1", bytes(92), bytes(4))

    with pytest.raises(TransferStalled):
        firmware.write(data)
    with pytest.raises(TransferStalled):
        firmware.read(16)
    assert not firmware.lit
