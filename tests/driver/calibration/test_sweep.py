"""The phase sweep of a calibration: what is captured, and what the file keeps of it."""

import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.driver.bench import CAPABILITIES, Bench, numbered_pixels
from transientcam_driver import (
    CalibrationCapture,
    CalibrationFileError,
    Sequence,
    SequenceError,
    SubPhases,
    capture_calibration,
    open_camera,
)
from transientcam_driver.clock import VirtualClock

SEQUENCE = Sequence(harmonics=2, zeroth="low-frequency", exposure_s=0.5e-3)
WAVEFORM = np.array([[0.1, 0.02j], [0.2, 0.0]])
STEPS = 16


class Swept:
    """Keeps what it is to evaluate."""

    def __init__(self, found: NDArray[Any] | None = WAVEFORM) -> None:
        self.steps: list[NDArray[np.uint16]] = []
        self.found = found

    def __call__(self, steps: Iterator[NDArray[np.uint16]]) -> NDArray[Any] | None:
        self.steps += list(steps)
        return self.found


def test_each_step_is_the_same_sequence_at_phases_between_the_four() -> None:
    bench, swept = Bench(), Swept()
    with bench.open(SEQUENCE) as camera:
        capture = capture_calibration(camera, takes=30, waveform=swept)
        assert camera.applied.sequence == SEQUENCE
    assert not bench.lit

    shown = sorted(bench.images.labels.items())
    first = 30 * (6 + 12)  # behind 30 dark frames and 30 of the calibration
    turns = [round(label.phase_rad / (2 * math.pi) * 64, 9) for _, label in shown[first:]]
    expected = [q * 16 + step for step in range(STEPS) for _ in range(3 * 3) for q in range(4)]
    assert turns == expected
    assert [step.shape for step in swept.steps] == [(3, 8, 5, 12)] * STEPS
    numbers = [number for number, label in shown[first:] if label.harmonic]
    images = np.concatenate([step.reshape(-1, 5, 12) for step in swept.steps])
    for image, number in zip(images, numbers, strict=True):
        np.testing.assert_array_equal(image, numbered_pixels(number))
    assert capture.waveform is not None
    np.testing.assert_array_equal(capture.waveform, WAVEFORM)
    assert capture.sequence.phase_offset_rad == 0.0


def test_progress_counts_the_frames_of_the_sweep() -> None:
    reported: list[tuple[int, int]] = []
    with Bench().open(SEQUENCE) as camera:
        capture_calibration(
            camera, takes=30, waveform=Swept(), progress=lambda *each: reported.append(each)
        )

    total = 30 + 30 + 3 * STEPS
    assert reported == [(done, total) for done in range(1, total + 1)]


def test_a_camera_that_cannot_shift_its_phases_is_not_swept() -> None:
    swept = Swept()
    with Bench(replace(CAPABILITIES, phase_offsets=False)).open(SEQUENCE) as camera:
        capture = capture_calibration(camera, takes=30, waveform=swept)
        with pytest.raises(SequenceError, match=r"phase_offset_rad.*0 on this camera"):
            camera.configure(replace(SEQUENCE, phase_offset_rad=0.1))

    assert capture.waveform is None
    assert swept.steps == []


def test_too_few_takes_to_find_outliers_have_no_sweep() -> None:
    with Bench().open(SEQUENCE) as camera:
        assert capture_calibration(camera, takes=29, waveform=Swept()).waveform is None


@pytest.mark.parametrize("offset_rad", [-0.1, 2 * math.pi, math.nan])
def test_an_offset_of_more_than_a_turn_is_refused(offset_rad: float) -> None:
    with pytest.raises(SequenceError, match="from 0 to a turn"):
        replace(SEQUENCE, phase_offset_rad=offset_rad)


def test_documents_of_a_sequence_have_no_offset() -> None:
    shifted = replace(SEQUENCE, phase_offset_rad=0.1)

    assert shifted.to_document() == SEQUENCE.to_document()
    with pytest.raises(SequenceError, match="phase_offset_rad"):
        Sequence.from_document({"phase_offset_rad": 0.1})


def test_a_simulated_device_shows_its_correlation_at_every_phase() -> None:
    # its third harmonic at 46 MHz, without sub-phases (imperfections.py)
    spec = "sim:calibration?device=prototype&noise=off&outliers=off&pixel-pattern=off"
    with open_camera(spec, clock=VirtualClock()) as camera:
        swept = Swept()
        camera.configure(Sequence(harmonics=2, zeroth="estimated", sub_phases=SubPhases("none")))
        capture_calibration(camera, takes=30, waveform=swept)

    images = np.mean(swept.steps, axis=1)[:, 4:]  # (steps, 4, H, W)
    correlation = images.transpose(1, 0, 2, 3).reshape(64, -1).mean(axis=1)
    spectrum = np.abs(np.fft.rfft(correlation))
    assert spectrum[3] / spectrum[1] == pytest.approx(0.032, abs=1e-4)


def test_the_harmonics_are_kept_in_the_file_and_old_files_open(tmp_path: Path) -> None:
    with Bench().open(SEQUENCE) as camera:
        without = capture_calibration(camera, takes=2)
    with_harmonics = replace(without, waveform=WAVEFORM.astype(complex))
    assert with_harmonics.id != without.id

    with_harmonics.save(tmp_path / "with.npz")
    without.save(tmp_path / "without.npz")

    loaded = CalibrationCapture.load(tmp_path / "with.npz")
    assert loaded.waveform is not None
    np.testing.assert_array_equal(loaded.waveform, WAVEFORM)
    assert loaded.id == with_harmonics.id
    assert CalibrationCapture.load(tmp_path / "without.npz").waveform is None
    for name, number in (("with", 2), ("without", 1)):
        with np.load(tmp_path / f"{name}.npz") as file:
            assert f'"format": {number}' in str(file["document"])


@pytest.mark.parametrize(
    "waveform",
    [
        np.zeros((3, 2), complex),
        np.zeros((2, 65), complex),
        np.zeros(2, complex),
        np.full((2, 2), np.nan, complex),
        np.zeros((2, 2)),
    ],
)
def test_other_harmonics_in_a_file_are_refused(tmp_path: Path, waveform: NDArray[Any]) -> None:
    with Bench().open(SEQUENCE) as camera:
        capture = capture_calibration(camera, takes=2)
    replace(capture, waveform=waveform).save(tmp_path / "c.npz")

    with pytest.raises(CalibrationFileError, match="waveform"):
        CalibrationCapture.load(tmp_path / "c.npz")
