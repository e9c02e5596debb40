"""Harmonics of the modulation: from a phase sweep into frames and recordings."""

from dataclasses import replace
from importlib.metadata import EntryPoint
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from numpy.typing import NDArray

import transientcam
from tests.server.imaging.recipe.test_calibration import SHAPE, Sensor, capture_of
from tests.server.recording.made import HEIGHT, WIDTH, frame, header, record
from transientcam import opening
from transientcam_driver import ImageLabel, RawFrame, Sequence, open_camera
from transientcam_driver.calibration._sweep import PhaseSweep
from transientcam_driver.clock import VirtualClock
from transientcam_server.errors import NotARecording
from transientcam_server.imaging import (
    Recipe,
    SettingsVersion,
    SweepEvaluation,
    evaluate,
    to_document,
    usable,
)
from transientcam_server.imaging._recipe.waveform import COUNT
from transientcam_server.recording import Recording, recorded_recipe
from transientcam_server.settings import ReconstructionSettings
from transientcam_simulation.emulated._open_usb.prototype import prototype

_Array = NDArray[Any]
SEQUENCE = Sequence(harmonics=3, zeroth="on-off", takes=1)
KNOWN = np.array([[0.03, 0.01j], [0.02j, 0.0]])
HARMONICS = {3: 0.02 - 0.01j, 5: 0.008j, 7: -0.006}
CAPABILITIES = prototype(serial="T", width=SHAPE[1], height=SHAPE[0], bits=12)


class Modulated(Sensor):
    """A sensor whose correlation has harmonics: Re(c_k b_kj exp(-i k theta)) beside the first."""

    def image(
        self, label: ImageLabel, sequence: Sequence, b0: _Array, delay_s: _Array
    ) -> NDArray[np.float64]:
        image = super().image(label, sequence, b0, delay_s)
        if label.frequency_hz:
            turn = 2 * np.pi * label.frequency_hz * (delay_s + self.delay_s) - label.phase_rad
            sub_phases = sequence.sub_phases
            first = np.sum(sub_phases.weights * np.exp(-1j * np.array(sub_phases.phases_rad)))
            turn = turn + np.angle(first)
            gain = b0 * self.gain[label.harmonic] * abs(first) / 2
            image = image + sum(
                gain * (c * np.exp(1j * k * turn)).real for k, c in HARMONICS.items()
            )
        return np.asarray(image)


def steps(sensor: Sensor, lit_dn: float = 800.0) -> list[_Array]:
    """Two takes of b_1 .. b_3 at each step of a sweep through the diffuser."""
    lit = np.full(SHAPE, lit_dn)
    images = [
        sensor.images(each, lit, np.zeros(SHAPE)) for each in PhaseSweep(1).sequences(SEQUENCE)
    ]
    modulated = slice(2, None)  # without those of b_0
    return [np.stack([step, step])[:, modulated].round().astype(np.uint16) for step in images]


def evaluation(**changes: Any) -> SweepEvaluation:
    return SweepEvaluation(replace(CAPABILITIES, **changes), takes=40)


def test_a_sweep_gives_the_harmonics_of_the_sensor() -> None:
    sweep = evaluation()

    found = sweep(iter(steps(Modulated())))

    assert sweep.reason is None
    assert found is not None
    expected = np.zeros((3, COUNT), complex)
    expected[:, :3] = list(HARMONICS.values())
    np.testing.assert_allclose(found, expected, atol=3e-4)  # images are whole numbers


@pytest.mark.parametrize(
    ("lit_dn", "reason"),
    [(0.0, "100% of the pixels are dark"), (9000.0, "100% of the pixels are dark or saturated")],
)
def test_a_sweep_that_shows_nothing_says_why(lit_dn: float, reason: str) -> None:
    sweep = evaluation()

    assert sweep(iter(steps(Modulated(), lit_dn))) is None
    assert sweep.reason is not None
    assert reason in sweep.reason


def test_harmonics_that_are_too_strong_are_left_alone_and_said_so() -> None:
    sweep = evaluation()
    swept = steps(Modulated())
    for number, step in enumerate(swept):  # a third harmonic of 30 %
        for index, label in enumerate(SEQUENCE.labels[2:]):
            phase_rad = label.phase_rad + number * np.pi / 32
            step[:, index] = 1000 + 400 * np.cos(phase_rad) + 120 * np.cos(3 * phase_rad)

    assert sweep(iter(swept)) is None
    assert sweep.reason is not None
    assert "too strong" in sweep.reason
    assert usable(np.full((3, 1), 0.3)) is None


def test_a_camera_or_calibration_without_a_sweep_says_so() -> None:
    few = SweepEvaluation(CAPABILITIES, takes=29)

    assert few.reason == "a phase sweep needs a calibration of 30 takes or more"
    assert evaluation(phase_offsets=False).reason == (
        "the camera cannot shift the phases of its images"
    )
    assert to_document(None) is None


def test_the_document_has_magnitude_and_phase_by_frequency_and_order() -> None:
    document = to_document(np.array([[0.03j, 0.0], [-0.01, 0.004]]))

    assert document == {
        "orders": [3, 5],
        "share": [[0.03, 0.0], [0.01, 0.004]],
        "phase_rad": [[1.5708, 0.0], [3.1416, 0.0]],
        "largest_share": 0.03,
    }


# -- in frames and recordings ----------------------------------------------------------------------


@pytest.fixture(scope="module")
def recipe_and_frame() -> tuple[Recipe, RawFrame, _Array]:
    """A recipe with known harmonics, a frame of a ramp of single returns, and their ranges."""
    sensor = Modulated()
    waveform = evaluation()(iter(steps(sensor)))
    capture = replace(capture_of(sensor, SEQUENCE), waveform=waveform)
    with open_camera("sim:mirrors", clock=VirtualClock()) as camera:
        applied = camera.validate(SEQUENCE)
    delay_s = np.linspace(2e-9, 30e-9, sensor.delay_s.size).reshape(SHAPE)
    images = sensor.images(SEQUENCE, np.full(SHAPE, 900.0), delay_s).round().astype(np.uint16)
    raw = RawFrame(0, 1, images, SEQUENCE.labels, 0.0, 0.0, 0.1, 30.0, 0)
    settings = ReconstructionSettings(neighbours="none", estimator="maximum-entropy")
    recipe = Recipe(applied, settings, 4095.0, evaluate(capture).gains)
    return recipe, raw, 0.5 * 299_792_458.0 * delay_s


def test_frames_have_them_taken_out_unless_settings_keep_them(
    recipe_and_frame: tuple[Recipe, RawFrame, _Array],
) -> None:
    recipe, raw, range_m = recipe_and_frame
    kept = replace(
        recipe, settings=recipe.settings.model_copy(update={"modulation_harmonics": "keep"})
    )

    found, plain = recipe.reconstruct(raw), kept.reconstruct(raw)

    assert found.corrected_pixels == range_m.size
    assert plain.corrected_pixels is None
    error, before = (float(np.abs(each.range_m - range_m).max()) for each in (found, plain))
    assert error < 0.25 * before


def test_a_recording_gives_the_numbers_of_the_daemon(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    point = EntryPoint("hdf5", "transientcam_server.offline._opening:open_recording", opening.GROUP)
    monkeypatch.setattr(opening, "entry_points", lambda group: [point])
    random = np.random.default_rng(2)
    turns = random.normal(0, 0.2, (3, HEIGHT, WIDTH))
    calibration = {
        "calibration": {"id": "measured"},
        "calibration_planes": np.exp(1j * turns).astype(np.complex64),
        "calibration_waveform": KNOWN,
    }
    path = record(tmp_path / "r.h5", 2, reconstruction={}, **calibration)
    live = header(reconstruction={}, **calibration)
    version = SettingsVersion(1, ReconstructionSettings(neighbours="gaussian"))  # as it was

    with transientcam.open(path) as recording:
        range_m = recording[1].range
        changes = {"modulation_harmonics": "keep", "neighbours": "gaussian"}
        kept = transientcam.open(path, settings=changes)[1].range

    np.testing.assert_array_equal(
        range_m, recorded_recipe(live, version).reconstruct(frame(1)).range_m
    )
    plain = replace(live, calibration_waveform=None)
    np.testing.assert_array_equal(
        kept, recorded_recipe(plain, version).reconstruct(frame(1)).range_m
    )
    assert (range_m != kept).any()
    with h5py.File(path) as file:
        assert file["odd"][()].tolist() == [3, 5]
        np.testing.assert_array_equal(file["waveform"], KNOWN)


@pytest.mark.parametrize(
    "waveform", [np.zeros((3, 2), complex), np.full((2, 2), 0.4 + 0j), np.zeros(2, complex)]
)
def test_a_recording_with_other_harmonics_is_refused(tmp_path: Path, waveform: _Array) -> None:
    planes = np.ones((3, HEIGHT, WIDTH), np.complex64)
    path = record(tmp_path / "r.h5", 1, calibration_planes=planes, calibration_waveform=KNOWN)
    with h5py.File(path, "r+") as file:
        del file["waveform"]
        file["waveform"] = waveform

    with pytest.raises(NotARecording, match="waveform"):
        Recording(path)
