"""A camera that reports gains of its pixels: frames and replays are computed with them."""

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

import transientcam_moments as tm
from tests.server.recording.made import APPLIED, CAPABILITIES, HEIGHT, WIDTH, frame, header
from transientcam_driver import CalibrationMismatch, FactoryCalibration
from transientcam_driver.clock import VirtualClock
from transientcam_server.imaging import (
    FACTORY_ID,
    Calibration,
    Pipeline,
    Recipe,
    Workers,
    factory_gains,
)
from transientcam_server.imaging._errors_of_range.noise import moment_noise
from transientcam_server.recording import RecordingWriter, ReplayCamera
from transientcam_server.settings import ReconstructionSettings

_RNG = np.random.default_rng(8)
SIZES = np.array([1.0, 0.5, 2.0])
PHASES = _RNG.uniform(0, 2 * np.pi, (3, HEIGHT, WIDTH))
PLANES = (SIZES[:, None, None] * np.exp(1j * PHASES)).astype(np.complex64)
PLANES[0] = 1


@dataclass(frozen=True)
class Source:
    factory: FactoryCalibration | None
    capabilities: Any = CAPABILITIES
    simulation: None = None


REPORTING = Source(FactoryCalibration(PLANES))


@contextmanager
def pipeline_of(source: Source, calibration: object = None) -> Iterator[Pipeline]:
    with ThreadPoolExecutor(1) as executor:
        yield Pipeline(
            source,
            ReconstructionSettings(),
            Workers(executor, count=1),
            calibration=cast("Calibration | None", calibration),
        )


def test_frames_have_the_gains_that_the_camera_reports() -> None:
    with pipeline_of(REPORTING) as pipeline:
        gains = pipeline.gains_for(APPLIED)
        made = pipeline.frame(frame(1), APPLIED)

    assert gains is not None
    assert (gains.id, gains.bad) == (FACTORY_ID, None)
    assert (gains.planes == PLANES).all()
    assert made.recipe.gains is gains
    assert made.meta()["calibration_id"] == FACTORY_ID


def test_a_camera_that_reports_none_has_the_nominal_gains() -> None:
    for source in (Source(None), Source(FactoryCalibration())):
        with pipeline_of(source) as pipeline:
            assert pipeline.gains_for(APPLIED) is None


def test_a_measured_calibration_goes_before_them_where_it_fits() -> None:
    fits = [None, CalibrationMismatch("harmonics", 2, 3)]
    measured = SimpleNamespace(
        gains=object(), capture=SimpleNamespace(misfit=lambda *_: fits.pop(0))
    )

    with pipeline_of(REPORTING, measured) as pipeline:
        assert pipeline.gains_for(APPLIED) is measured.gains
        without = pipeline.gains_for(APPLIED)

    assert without is not None
    assert without.id == FACTORY_ID


def test_moments_are_divided_by_them() -> None:
    raw = frame(2)
    settings = ReconstructionSettings(neighbours="none")
    recipe = Recipe(APPLIED, settings, 4095.0, factory_gains(REPORTING.factory))

    found = recipe.reconstruct(raw)

    images = raw.images.reshape(2, 4, HEIGHT, WIDTH).astype(float)
    phasors = images[:, 0] - images[:, 2] + 1j * (images[:, 1] - images[:, 3])
    np.testing.assert_allclose(found.smoothed[1:], phasors / PLANES[1:], rtol=1e-4)


def test_noise_grows_where_they_are_small() -> None:
    sensor = tm.noise.Sensor()
    brightness = np.full((HEIGHT, WIDTH), 500.0)
    smoothed = np.stack([brightness + 0j] * 3)
    planes = {"ambient": None, "smoothed": smoothed, "variance_share": None}
    plain = SimpleNamespace(gaussian_px=0.0)
    found = cast("tm.Reconstruction", SimpleNamespace(settings=plain, **planes))
    settings = ReconstructionSettings(smoothing_px=0.0)
    nominal = Recipe(APPLIED, settings, 4095.0, sensor=sensor)

    reported = replace(nominal, gains=factory_gains(REPORTING.factory))

    gain = np.abs(nominal.nominal_gains[1:])
    ratio = moment_noise(reported, found).variance[1:] / moment_noise(nominal, found).variance[1:]
    expected = (gain / SIZES[1:]) ** 2
    np.testing.assert_allclose(ratio, np.broadcast_to(expected[:, None, None], ratio.shape), 1e-5)


def test_a_replay_reports_what_the_recorded_camera_did(tmp_path: Path) -> None:
    path = tmp_path / "a.h5"
    calibration = {"id": FACTORY_ID}
    writer = RecordingWriter(path, header(calibration=calibration, calibration_planes=PLANES))
    writer.append(frame(0))
    writer.close({})

    with ReplayCamera(path, clock=VirtualClock()) as camera:
        reported = camera.factory

    assert reported is not None
    assert reported.gains is not None
    assert (reported.gains == PLANES).all()


@pytest.mark.parametrize("planes", [None, PLANES])
def test_a_replay_of_other_gains_reports_none(tmp_path: Path, planes: Any) -> None:
    path = tmp_path / "a.h5"
    identity = "nominal" if planes is None else "TC-1-0123456789ab"
    made = header(calibration={"id": identity}, calibration_planes=planes)
    RecordingWriter(path, made).close({})

    with ReplayCamera(path, clock=VirtualClock()) as camera:
        assert camera.factory is None
