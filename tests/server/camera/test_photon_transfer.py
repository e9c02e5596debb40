"""Photon transfer: against the sensors of scenes that hide them, and against drawn frames."""

from pathlib import Path

import numpy as np
import pytest

import transientcam_moments as tm
from tests.server.planning.looks import SCENE
from transientcam_driver import Sequence, open_camera
from transientcam_driver.clock import VirtualClock
from transientcam_server.camera import PhotonTransfer, measure_photon_transfer
from transientcam_server.errors import Problem


def scene(folder: Path, **sensor: float) -> str:
    """A panel that fills the picture, darker towards its edges; the camera's sensor is this one."""
    path = folder / "hidden.toml"
    lines = [f"{name} = {value}" for name, value in sensor.items()]
    stage = SCENE.format(light=4e7, ambient=0.0, away_m=1.5, width_m=3.0)
    path.write_text("\n".join([stage, "[sensor]", *lines]))
    return f"sim:{path}"


@pytest.mark.parametrize(
    ("gain", "read_noise_e", "full_well_e"),
    [(0.5, 1.0, 40_000.0), (9.0, 30.0, 20_000.0), (20.0, 100.0, 40_000.0)],
)
def test_a_hidden_sensor_is_found(
    tmp_path: Path, gain: float, read_noise_e: float, full_well_e: float
) -> None:
    spec = scene(tmp_path, gain_e_per_dn=gain, read_noise_e=read_noise_e, full_well_e=full_well_e)
    with open_camera(spec, clock=VirtualClock()) as camera:
        before = camera.configure(Sequence(harmonics=2, exposure_s=1e-3)).sequence

        found = measure_photon_transfer(camera, frames=8)

        assert camera.applied.sequence == before
    sensor = found.sensor
    assert sensor.gain_e_per_dn == pytest.approx(gain, rel=0.05)
    assert sensor.dark_dn == pytest.approx(64.0, abs=1.0)
    true = tm.noise.Sensor(gain, full_well_e, read_noise_e)
    signal = np.array([0.0, 10.0, 100.0, 1000.0])
    stated = np.sqrt(sensor.image_variance(signal) / true.image_variance(signal))
    np.testing.assert_allclose(stated, 1.0, atol=0.15)
    room_e = min(full_well_e, gain * (4095 - 64))
    assert sensor.full_well_e == pytest.approx(room_e, rel=0.08)


def test_differences_of_two_taps_tell_a_sensor_that_has_their_noise(tmp_path: Path) -> None:
    hidden = scene(tmp_path, gain_e_per_dn=5.0, read_noise_e=20.0).removeprefix("sim:")
    with open_camera(f"opt8241:emulated?scene={hidden}", clock=VirtualClock()) as camera:
        sensor = measure_photon_transfer(camera, frames=4).sensor
        assert camera.simulation is not None
        stated = camera.simulation.sensor

    # each of both has its own noise, and half of their difference is what is seen
    assert sensor.gain_e_per_dn == pytest.approx(2 * 5.0, rel=0.05)
    assert sensor.read_noise_e == pytest.approx(2**0.5 * 20.0, rel=0.1)
    assert sensor.dark_dn == pytest.approx(2048.0)
    assert stated.gain_e_per_dn == 2 * 5.0
    assert stated.read_noise_e == pytest.approx(2**0.5 * 20.0)


def points(gain: float, dark: float, *, full: float = np.inf, seed: int = 0) -> np.ndarray:
    """Variances of 60 groups of 1000 values each, up to 3000 DN; beyond ``full`` hardly any."""
    random = np.random.default_rng(seed)
    signal = np.linspace(0.0, 3000.0, 60)
    variance = (dark + signal / gain) * random.chisquare(1000, 60) / 1000
    return np.array([np.minimum(signal, full), np.where(signal > full, 0.1 * variance, variance)])


def test_the_figures_are_those_of_the_standard() -> None:
    found = PhotonTransfer.of(points(4.0, 9.0, full=2000.0), 64.0, 12, full_dn=2000.0)
    told = found.to_document()["emva1288"]

    assert found.saturates
    assert told["saturation_capacity_e"] == pytest.approx(8000.0, rel=0.03)
    assert told["snr_max_db"] == pytest.approx(10 * np.log10(8000.0), abs=0.2)
    assert told["system_gain_dn_per_e"] == pytest.approx(0.25, rel=0.02)
    assert told["temporal_dark_noise_e"] == pytest.approx(12.0, rel=0.05)  # 4 e/DN x 3 DN
    assert told["dynamic_range_db"] == pytest.approx(20 * np.log10(8000 / 12.5), abs=0.5)


def test_frames_that_do_not_tell_are_refused() -> None:
    flat = points(1e9, 9.0)
    with pytest.raises(Problem, match="hardly grows with the light"):
        PhotonTransfer.of(flat, 64.0, 12)
    with pytest.raises(Problem, match="3 points are between"):
        PhotonTransfer.of(flat[:, :3] * 0, 64.0, 12)
