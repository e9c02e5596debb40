"""A calibration measurement takes out what each pixel does to phases and amplitudes."""

import asyncio
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest
from numpy.typing import NDArray

import transientcam_moments as tm
from tests.serving import serving
from transientcam import Camera as RemoteCamera
from transientcam.documents import FrameDocument
from transientcam_driver import (
    CalibrationCapture,
    CalibrationMismatch,
    Camera,
    ImageLabel,
    RawFrame,
    Sampling,
    Sequence,
    capture_calibration,
    open_camera,
)
from transientcam_server.imaging import (
    NOMINAL_ID,
    Calibration,
    Pipeline,
    Recipe,
    Workers,
    evaluate,
    load_calibration,
    nominal_gains,
)
from transientcam_server.settings import ReconstructionSettings
from transientcam_simulation.emulated._open_usb.prototype import prototype

_Array = NDArray[Any]
SHAPE = (10, 12)
DARK_DN = 64.0
SEQUENCE = Sequence(harmonics=3, takes=1)
PROTOTYPE = prototype(serial="SIM-ideal-0", width=SHAPE[1], height=SHAPE[0], bits=16)
UNSMOOTHED = ReconstructionSettings(neighbours="none")


class Sensor:
    """A noiseless sensor, each pixel of which has its own delay, and gains that differ by j."""

    def __init__(self) -> None:
        random = np.random.default_rng(5)
        self.delay_s = random.normal(0.0, 0.5e-9, SHAPE)
        self.gain = {0: np.ones(SHAPE)} | {j: random.uniform(0.6, 1.0, SHAPE) for j in range(1, 9)}

    def image(
        self, label: ImageLabel, sequence: Sequence, b0: _Array, delay_s: _Array
    ) -> NDArray[np.float64]:
        """The measurement model of docs/usb-protocol.md, section 5, with this sensor's errors."""
        if not label.illumination:
            return np.full(SHAPE, DARK_DN)
        if not label.frequency_hz:
            return DARK_DN + b0 / 2
        sub_phases = sequence.sub_phases
        gain = np.sum(sub_phases.weights * np.exp(-1j * np.array(sub_phases.phases_rad)))
        moment = b0 * np.exp(2j * np.pi * label.frequency_hz * (delay_s + self.delay_s))
        moment *= self.gain[label.harmonic] * gain * np.exp(-1j * label.phase_rad)
        return np.asarray(DARK_DN + (b0 + moment.real) / 2)

    def images(self, sequence: Sequence, b0: _Array, delay_s: _Array) -> _Array:
        return np.stack([self.image(label, sequence, b0, delay_s) for label in sequence.labels])


def capture_of(sensor: Sensor, sequence: Sequence) -> CalibrationCapture:
    lit = np.full(SHAPE, 800.0)
    images = sensor.images(sequence, lit, np.zeros(SHAPE)).astype(np.float32)
    return CalibrationCapture(
        images=images,
        kept=np.ones((2, len(images)), dtype=bool),
        sequence=sequence,
        low_frequency_hz=0.9e6,
        serial="SIM-ideal-0",
        model="",
        firmware="",
        temperature_c=30.0,
        captured_unix_s=0.0,
        dark=np.full(SHAPE, DARK_DN, np.float32),
        dark_deviation=np.ones(SHAPE, np.float32),
    )


def reconstruction(
    images: _Array, sequence: Sequence, calibration: Calibration | None
) -> tm.Reconstruction:
    frame = RawFrame(0, 1, images, sequence.labels, 0.0, 0.0, 0.1, 30.0, 0)
    recipe = Recipe(
        PROTOTYPE.apply(sequence),
        UNSMOOTHED,
        65535.0,
        None if calibration is None else calibration.gains,
    )
    found: tm.Reconstruction = recipe.reconstruct(frame)
    return found


@pytest.mark.parametrize("zeroth", ["low-frequency", "on-off", "estimated"])
def test_a_pattern_of_gain_and_phase_is_removed(zeroth: Any) -> None:
    sensor, sequence = Sensor(), replace(SEQUENCE, zeroth=zeroth)
    calibration = evaluate(capture_of(sensor, sequence))
    b0 = np.linspace(300, 900, 120).reshape(SHAPE)
    delay_s = np.linspace(2e-9, 30e-9, 120).reshape(SHAPE)
    images = sensor.images(sequence, b0, delay_s)

    found = reconstruction(images, sequence, calibration)
    nominal = reconstruction(images, sequence, None)

    expected_m = tm.SPEED_OF_LIGHT_M_S * delay_s / 2
    assert np.abs(found.range_m - expected_m).max() < 1e-3
    assert np.abs(nominal.range_m - expected_m).max() > 0.1
    assert calibration.gains.bad_pixels == 0


def test_so_it_is_at_three_phases_of_any_multiples(tmp_path: Path) -> None:
    sampling = Sampling((2, 5, 7), (0.0, 2 * np.pi / 3, 4 * np.pi / 3))
    sensor, sequence = Sensor(), replace(SEQUENCE, base_frequency_hz=8e6, sampling=sampling)
    capture_of(sensor, sequence).save(tmp_path / "calibration.npz")
    calibration = load_calibration(tmp_path / "calibration.npz")
    b0 = np.linspace(300, 900, 120).reshape(SHAPE)
    delay_s = np.linspace(2e-9, 100e-9, 120).reshape(SHAPE)
    applied = replace(PROTOTYPE, sampling=sampling).apply(sequence)
    images = sensor.images(sequence, b0, delay_s)
    frame = RawFrame(0, 1, images, sequence.labels, 0.0, 0.0, 0.1, 30.0, 0)
    settings = UNSMOOTHED.model_copy(update={"estimator": "likelihood"})

    found = Recipe(applied, settings, 65535.0, calibration.gains).reconstruct(frame)

    assert calibration.capture.sequence == sequence
    assert np.abs(found.range_m - tm.SPEED_OF_LIGHT_M_S * delay_s / 2).max() < 1e-3
    misfit = calibration.capture.misfit(PROTOTYPE.apply(SEQUENCE), PROTOTYPE)
    assert misfit is not None


@pytest.mark.parametrize("zeroth", ["low-frequency", "on-off"])
def test_calibrated_moments_are_those_of_the_light_in_digital_numbers(zeroth: Any) -> None:
    sensor, sequence = Sensor(), replace(SEQUENCE, zeroth=zeroth)
    calibration = evaluate(capture_of(sensor, sequence))
    b0, delay_s = np.full(SHAPE, 500.0), np.full(SHAPE, 10e-9)

    measured = tm.measure(sensor.images(sequence, b0, delay_s), zeroth=zeroth)
    moments = tm.calibrate(measured, calibration.gains.planes)

    for j in range(4):
        expected = 500.0 * np.exp(2j * np.pi * 23e6 * j * 10e-9)
        np.testing.assert_allclose(moments[j], expected, rtol=1e-4)


def test_an_ideal_sensor_is_calibrated_by_the_nominal_gains() -> None:
    sensor = Sensor()
    sensor.delay_s[:] = 0.0
    sensor.gain = dict.fromkeys(range(9), np.ones(SHAPE))

    gains = evaluate(capture_of(sensor, SEQUENCE)).gains.planes

    nominal = nominal_gains(SEQUENCE)
    np.testing.assert_allclose(
        gains, np.broadcast_to(nominal[:, None, None], gains.shape), rtol=1e-5
    )


def test_hot_noisy_and_dead_pixels_are_found_and_show_their_neighbours() -> None:
    sensor = Sensor()
    capture = capture_of(sensor, SEQUENCE)
    assert capture.dark is not None
    assert capture.dark_deviation is not None
    capture.dark[1, 2] = 900.0
    capture.dark_deviation[7, 8] = 90.0
    capture.images[:, 4, 4] = DARK_DN

    calibration = evaluate(capture)

    assert calibration.gains.bad is not None
    assert np.argwhere(calibration.gains.bad).tolist() == [[1, 2], [4, 4], [7, 8]]
    assert np.isfinite(calibration.gains.planes).all()
    b0, delay_s = np.full(SHAPE, 500.0), np.full(SHAPE, 10e-9)
    images = sensor.images(SEQUENCE, b0, delay_s)
    images[:, calibration.gains.bad] = 4000.0
    found = reconstruction(images, SEQUENCE, calibration)
    assert (found.flags[calibration.gains.bad] & tm.Flags.REPLACED).all()
    assert np.abs(found.range_m - tm.SPEED_OF_LIGHT_M_S * 5e-9).max() < 0.3


# -- on the simulated camera, whose pixels have a pattern, through the whole daemon ----------------


@pytest.fixture(scope="module")
def calibrated(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A calibration of the simulated prototype."""
    path = tmp_path_factory.mktemp("calibration") / "prototype.npz"
    with open_camera("sim:calibration?device=prototype") as camera:
        capture_calibration(camera, takes=6, average=tm.average_takes).save(path)
    return path


@pytest.fixture
def wall() -> Iterator[Camera]:
    with open_camera("sim:wall?device=prototype") as camera:
        yield camera


def range_error_m(camera: Camera, calibration: Any) -> float:
    """Median over the pixels of the range's error, its mean removed: what differs among pixels."""
    assert camera.simulation is not None
    camera.start()
    frames = [camera.read_frame() for _ in range(4)]
    camera.stop()
    recipe = Recipe(
        camera.applied,
        ReconstructionSettings(),
        4095.0,
        None if calibration is None else calibration.gains,
    )
    ranges = [recipe.reconstruct(frame).range_m for frame in frames]
    error = np.median(ranges, axis=0) - camera.simulation.truth().range_m
    return float(np.nanmedian(np.abs(error - np.nanmedian(error))))


def test_the_pattern_of_the_simulated_prototype_is_removed(calibrated: Path, wall: Camera) -> None:
    calibration = load_calibration(calibrated)
    calibration.capture.require_fit(wall.applied, wall.capabilities)

    assert range_error_m(wall, calibration) < 0.5 * range_error_m(wall, None)


def with_pipeline(camera: Camera, **options: Any) -> FrameDocument:
    """The metadata of one frame, after its moments were computed."""

    async def main() -> FrameDocument:
        with ThreadPoolExecutor(2, thread_name_prefix="worker") as executor:
            workers = Workers(executor, count=2)
            pipeline = Pipeline(camera, ReconstructionSettings(), workers, **options)
            try:
                camera.start()
                frame = pipeline.frame(camera.read_frame(), camera.applied)
                camera.stop()
                before = frame.meta()
                assert before["rejected_images"] is None
                await frame.reconstruction("moments")
                return frame.meta()
            finally:
                await workers.close(within_s=30.0)

    return asyncio.run(main())


@pytest.mark.parametrize("take_order", ["sequential", "interleaved"])
def test_outlier_images_are_left_out_and_counted(take_order: Any) -> None:
    """Each image of the simulated prototype loses its synchronisation with 7 % probability."""
    sequence = Sequence(harmonics=3, takes=8, take_order=take_order, exposure_s=0.5e-3)
    with open_camera("sim:wall?device=prototype") as camera:
        camera.configure(sequence)
        meta = with_pipeline(camera)

    assert meta["rejected_images"] is not None
    assert 0 < meta["rejected_images"] < 0.25 * sequence.images


def test_without_outliers_none_is_left_out() -> None:
    with open_camera("sim:wall") as camera:
        camera.configure(Sequence(harmonics=2, takes=4, exposure_s=0.5e-3))
        meta = with_pipeline(camera)

    assert meta["rejected_images"] == 0


def test_both_orders_of_takes_give_the_same_moments() -> None:
    found = []
    for take_order in ("sequential", "interleaved"):
        with open_camera("sim:wall?noise=off") as camera:
            document = {"takes": 3, "take_order": take_order, "exposure_s": 0.5e-3}
            camera.configure(Sequence.from_document(document))
            camera.start()
            frame = camera.read_frame()
            recipe = Recipe(camera.applied, ReconstructionSettings(), 65535.0)
            found.append(recipe.reconstruct(frame).moments)

    np.testing.assert_allclose(found[0], found[1], rtol=1e-5)


def test_the_daemon_calibrates_and_says_when_it_cannot(calibrated: Path) -> None:
    identity = load_calibration(calibrated).gains.id
    with (
        serving("sim:wall?device=prototype", calibration=calibrated) as daemon,
        RemoteCamera(daemon.url, timeout_s=60) as camera,
    ):
        notices: list[Any] = []
        with camera.stream("range", on_notice=notices.append) as stream:
            frames = iter(stream)
            assert next(frames).meta["calibration_id"] == identity
            camera.sequence = {"harmonics": 2}
            frame = next(each for each in frames if each.meta["harmonics"] == 2)
            assert frame.meta["calibration_id"] == NOMINAL_ID
            camera.sequence = {"harmonics": 3, "takes": 2}
            frame = next(each for each in frames if each.meta["takes"] == 2)
            assert frame.meta["calibration_id"] == identity

    reported = [notice for notice in notices if notice.kind == "calibration-changed"]
    assert [notice.details["calibration_id"] for notice in reported] == [NOMINAL_ID, identity]
    assert reported[0].details["reason"] == "the calibration is for harmonics = 3, not 2"
    assert reported[1].details["reason"] is None


def test_the_calibration_of_another_camera_is_refused_at_once(calibrated: Path) -> None:
    with (
        pytest.raises(CalibrationMismatch, match="serial = 'SIM-prototype-0', not 'SIM-ideal-0'"),
        serving("sim:wall", calibration=calibrated),
    ):
        pass


def test_frames_without_a_calibration_say_nominal() -> None:
    with serving("sim:wall") as daemon, httpx.Client(base_url=daemon.url, timeout=60) as http:
        meta = http.get("/api/v1/frames/latest", params={"wait_s": 10}).json()

    assert meta["calibration_id"] == NOMINAL_ID
