"""A calibration measurement: what it holds, what it is good for, and how it is kept."""

import contextlib
import io
import json
import zipfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings, strategies as st

from tests.driver.bench import CAPABILITIES, Bench, number_of, numbered_pixels
from transientcam_driver import (
    CalibrationCapture,
    CalibrationFileError,
    CalibrationMismatch,
    Camera,
    CameraLost,
    FrameTimeout,
    RawFrame,
    Sequence,
    SequenceError,
    SubPhases,
    capture_calibration,
)

SEQUENCE = Sequence(harmonics=2, zeroth="low-frequency", exposure_s=0.5e-3, takes=3)
COUNT = 12
TAKES = 4


@pytest.fixture
def bench() -> Bench:
    return Bench()


@pytest.fixture
def camera(bench: Bench) -> Iterator[Camera]:
    with bench.open(SEQUENCE) as opened:
        yield opened


@pytest.fixture
def capture(camera: Camera) -> CalibrationCapture:
    return capture_calibration(camera, takes=TAKES)


def test_each_image_is_the_mean_of_its_takes(bench: Bench, capture: CalibrationCapture) -> None:
    lit = [number for number, label in bench.images.labels.items() if label.harmonic == 2]
    first = lit[0] - 8  # the first image of the first lit frame

    assert capture.images.shape == (COUNT, CAPABILITIES.height, CAPABILITIES.width)
    for k in range(COUNT):
        takes = [numbered_pixels(first + COUNT * take + k) for take in range(TAKES)]
        np.testing.assert_allclose(capture.images[k], np.mean(takes, axis=0), rtol=1e-6)
    assert capture.kept.shape == (TAKES, COUNT)
    assert capture.rejected_images == 0


def test_dark_images_are_those_without_light(bench: Bench, capture: CalibrationCapture) -> None:
    dark = [number for number, label in bench.images.labels.items() if not label.illumination]
    images = np.array([numbered_pixels(number) for number in dark[:TAKES]], dtype=float)

    assert capture.dark is not None
    assert capture.dark_deviation is not None
    np.testing.assert_allclose(capture.dark, images.mean(axis=0), rtol=1e-5)
    np.testing.assert_allclose(capture.dark_deviation, images.std(axis=0, ddof=1), rtol=1e-4)


def test_it_says_with_what_and_when_it_was_measured(
    bench: Bench, capture: CalibrationCapture
) -> None:
    assert (capture.serial, capture.model) == ("BENCH-1", CAPABILITIES.model)
    assert capture.sequence == replace(SEQUENCE, takes=1)
    assert capture.low_frequency_hz == 0.9e6
    assert capture.temperature_c == 30.0
    assert capture.captured_unix_s == pytest.approx(bench.clock.unix_s(), abs=1.0)
    assert capture.id.startswith("BENCH-1-")


def test_the_sequence_is_restored_and_the_light_is_off(bench: Bench, camera: Camera) -> None:
    capture_calibration(camera, takes=TAKES)

    assert camera.applied.sequence == SEQUENCE
    assert camera.state == "idle"
    assert not bench.lit


def test_the_light_is_off_also_when_it_is_broken_off(bench: Bench, camera: Camera) -> None:
    class Enough(Exception):  # noqa: N818 - nothing has failed
        pass

    def stop(done: int, total: int) -> None:
        if done == TAKES + 1:
            raise Enough

    with pytest.raises(Enough):
        capture_calibration(camera, takes=TAKES, progress=stop)
    assert not bench.lit
    assert camera.applied.sequence == SEQUENCE


def test_a_lost_camera_is_reported(bench: Bench, camera: Camera) -> None:
    with pytest.raises(CameraLost):
        capture_calibration(camera, takes=TAKES, progress=lambda *_: bench.device.unplug())


def test_progress_counts_every_frame(camera: Camera) -> None:
    reported: list[tuple[int, int]] = []

    capture_calibration(camera, takes=TAKES, progress=lambda *each: reported.append(each))

    assert reported == [(done, 2 * TAKES) for done in range(1, 2 * TAKES + 1)]


def test_outliers_are_left_to_the_average(camera: Camera) -> None:
    def without_the_first(takes: Any) -> Any:
        kept = np.ones(takes.shape[:2], dtype=bool)
        kept[0] = number_of(takes[0, 0]) % 2
        return takes[1:].mean(axis=0), kept

    capture = capture_calibration(camera, takes=TAKES, average=without_the_first)

    assert capture.rejected_images == COUNT // 2


def test_one_take_is_none(camera: Camera) -> None:
    with pytest.raises(SequenceError, match="takes = 1"):
        capture_calibration(camera, takes=1)


def test_a_camera_that_cannot_take_dark_images_is_calibrated_without() -> None:
    with Bench(replace(CAPABILITIES, zeroths=("low-frequency",))).open(SEQUENCE) as camera:
        capture = capture_calibration(camera, takes=2)

    assert capture.dark is None
    assert capture.dark_deviation is None


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"base_frequency_hz": 20e6}, "base_frequency_hz"),
        ({"harmonics": 3}, "harmonics"),
        ({"zeroth": "on-off"}, "zeroth"),
        ({"exposure_s": 0.6e-3}, "exposure_s"),
        ({"sub_phases": SubPhases("none")}, "sub_phases.scheme"),
        ({"sub_phases": SubPhases("arccos", 4)}, "sub_phases.n"),
    ],
)
def test_another_sequence_is_refused_by_name(
    camera: Camera, capture: CalibrationCapture, change: dict[str, Any], field: str
) -> None:
    applied = camera.validate(replace(SEQUENCE, **change))

    with pytest.raises(CalibrationMismatch, match=f"the calibration is for {field} = ") as caught:
        capture.require_fit(applied, camera.capabilities)

    assert caught.value.field == field


def test_another_camera_is_refused_by_name(camera: Camera, capture: CalibrationCapture) -> None:
    others: dict[str, Any] = {"serial": "X-2", "width": 640, "height": 480}
    for field, value in others.items():
        other = replace(camera.capabilities, **{field: value})

        with pytest.raises(CalibrationMismatch) as caught:
            capture.require_fit(camera.applied, other)

        assert (caught.value.field, caught.value.value) == (field, value)


def test_number_and_order_of_takes_do_not_matter(
    camera: Camera, capture: CalibrationCapture
) -> None:
    other = camera.validate(replace(SEQUENCE, takes=7, take_order="interleaved"))

    capture.require_fit(other, camera.capabilities)


def test_a_file_read_back_is_the_same(capture: CalibrationCapture, tmp_path: Path) -> None:
    path = tmp_path / "calibration"  # no suffix is added
    capture.save(path)

    loaded = CalibrationCapture.load(path)

    assert loaded.id == capture.id
    assert loaded.sequence == capture.sequence
    for name in ("images", "kept", "dark", "dark_deviation"):
        np.testing.assert_array_equal(getattr(loaded, name), getattr(capture, name))


def test_a_file_without_dark_images_is_read_too(
    capture: CalibrationCapture, tmp_path: Path
) -> None:
    replace(capture, dark=None, dark_deviation=None).save(tmp_path / "c.npz")

    assert CalibrationCapture.load(tmp_path / "c.npz").dark is None


def test_every_measurement_has_a_name_of_its_own(capture: CalibrationCapture) -> None:
    names = {
        capture.id,
        replace(capture, images=capture.images + np.float32(1)).id,
        replace(capture, captured_unix_s=0.0).id,
        replace(capture, dark=None).id,
        replace(capture, sequence=replace(SEQUENCE, harmonics=1)).id,
    }
    assert len(names) == 5


def rewrite(path: Path, **changes: Any) -> None:
    """Change entries of a file; None removes one."""
    with np.load(path) as file:
        content = {name: file[name] for name in file.files}
    content |= changes
    np.savez(path, **{name: value for name, value in content.items() if value is not None})


def document(path: Path, **changes: Any) -> str:
    with np.load(path) as file:
        return json.dumps(json.loads(str(file["document"])) | changes)


@pytest.mark.parametrize(
    ("change", "key"),
    [
        (lambda _: {"images": None}, "images"),
        (lambda _: {"images": np.zeros((3, 2, 2), np.float32)}, "images"),
        (lambda _: {"images": np.zeros((COUNT, 5, 12))}, "images"),
        (lambda _: {"kept": np.ones((0, COUNT), dtype=bool)}, "kept"),
        (lambda _: {"dark_deviation": None}, "dark_deviation"),
        (lambda _: {"document": None}, "document"),
        (lambda _: {"document": "{"}, "document"),
        (lambda path: {"document": document(path, format=3)}, "format"),
        (lambda path: {"document": document(path, sequence={"harmonics": 99})}, "document"),
        (lambda path: {"document": document(path, temperature_c="warm")}, "document"),
        (lambda _: {"document": '{"format": 1}'}, "document"),
    ],
)
def test_a_file_that_is_no_calibration_says_what_is_wrong(
    capture: CalibrationCapture, tmp_path: Path, change: Any, key: str
) -> None:
    path = tmp_path / "c.npz"
    capture.save(path)
    rewrite(path, **change(path))

    with pytest.raises(CalibrationFileError) as caught:
        CalibrationCapture.load(path)

    assert caught.value.key == key
    assert str(path) in str(caught.value)


@pytest.mark.parametrize("content", [None, b"", b"no archive", b"PK\x03\x04 cut off", b"\x93NUMPY"])
def test_a_file_that_cannot_be_read_is_named(tmp_path: Path, content: bytes | None) -> None:
    path = tmp_path / "c.npz"
    if content is not None:
        path.write_bytes(content)

    with pytest.raises(CalibrationFileError, match=r"c\.npz: the file is"):
        CalibrationCapture.load(path)


def test_notes_are_kept_with_it_and_do_not_change_its_id(
    capture: CalibrationCapture, tmp_path: Path
) -> None:
    noted = replace(capture, notes={"name": "after warm-up", "invalid_share": 0.002})

    noted.save(tmp_path / "noted.npz")

    again = CalibrationCapture.load(tmp_path / "noted.npz")
    assert again.notes == {"name": "after warm-up", "invalid_share": 0.002}
    assert again.id == capture.id


def test_an_id_may_stand_in_an_address_whatever_the_serial_number(
    capture: CalibrationCapture,
) -> None:
    odd = replace(capture, serial="../Kamera 7/ü")

    assert odd.id.startswith("Kamera-7-")
    assert odd.id.replace("-", "").isalnum()
    assert replace(capture, serial="..").id.startswith("camera-")


def test_what_unpacks_to_too_much_is_not_unpacked(
    capture: CalibrationCapture, tmp_path: Path
) -> None:
    path = tmp_path / "large.npz"
    capture.save(path)

    with pytest.raises(CalibrationFileError, match="unpacked, but must be at most 1000"):
        CalibrationCapture.load(path, max_bytes=1000)


def test_it_can_be_ended_while_no_frame_comes(
    camera: Camera, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Enough(Exception):  # noqa: N818 - nothing has failed
        pass

    reported: list[tuple[int, int]] = []

    def silent(camera: Camera, *, timeout_s: float) -> RawFrame:
        raise FrameTimeout(timeout_s)

    def lose_patience(*each: int) -> None:
        reported.append((each[0], each[1]))
        if len(reported) == 3:
            raise Enough

    monkeypatch.setattr(type(camera), "read_frame", silent)
    with pytest.raises(Enough):
        capture_calibration(camera, takes=TAKES, progress=lose_patience)
    assert reported == [(0, 2 * TAKES)] * 3
    assert camera.applied.sequence == SEQUENCE


def with_members(path: Path, **changed: Any) -> None:
    """Change members of a file: an array, or bytes as they are."""
    with np.load(path) as file:
        content = dict(file)
    with zipfile.ZipFile(path, "w") as archive:
        for name, value in {**content, **changed}.items():
            packed = io.BytesIO()
            if isinstance(value, bytes):
                packed.write(value)
            else:
                np.save(packed, value)
            archive.writestr(f"{name}.npy", packed.getvalue())


HUGE = b"{'descr': '<f4', 'fortran_order': False, 'shape': (1000000000000, 2, 2), }"


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"images": np.full((12, 3, 4), np.nan, np.float32)}, "images is from nan to nan"),
        ({"images": np.full((12, 3, 4), -1, np.float32)}, "images is from -1.0 to -1.0"),
        ({"images": b"\x93NUMPY\x01\x00\x4b\x00" + HUGE + b"\n"}, "an array of shape"),
        ({"images": b"\x93NUMPY\x01\x00\x05\x00((((\n"}, "must be an .npz"),
        ({"images": b"\x93NUMPY\x09\x00\x05\x00"}, "must be an .npz"),
    ],
)
def test_arrays_that_no_camera_captured_are_refused_whatever_they_say(
    capture: CalibrationCapture, tmp_path: Path, changed: dict[str, Any], message: str
) -> None:
    path = tmp_path / "odd.npz"
    capture.save(path)
    if isinstance(changed["images"], np.ndarray):
        shape = (len(capture.images), *capture.images.shape[1:])
        changed = {"images": np.broadcast_to(changed["images"][0, 0, 0], shape).copy()}
    with_members(path, **changed)

    with pytest.raises(CalibrationFileError, match=message):
        CalibrationCapture.load(path)


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("serial", "9" * 5000),
        ("model", "line\nbreak"),
        ("temperature_c", float("nan")),
        ("captured_unix_s", 10**400),
        ("notes", 7),
    ],
)
def test_figures_and_names_that_cannot_be_are_refused(
    capture: CalibrationCapture, tmp_path: Path, field: str, value: Any
) -> None:
    path = tmp_path / "odd.npz"
    capture.save(path)
    with np.load(path) as file:
        document = json.loads(str(file["document"]))
    with_members(path, document=np.array(json.dumps({**document, field: value})))

    with pytest.raises(CalibrationFileError, match="document"):
        CalibrationCapture.load(path)


@settings(
    max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(data=st.data())
def test_no_change_of_bytes_raises_anything_else(
    data: st.DataObject, capture: CalibrationCapture, tmp_path: Path
) -> None:
    path = tmp_path / "bent.npz"
    capture.save(path)
    content = bytearray(path.read_bytes())
    places = st.lists(st.integers(0, len(content) - 1), min_size=1, max_size=8)
    for place in data.draw(places):
        content[place] = data.draw(st.integers(0, 255))
    path.write_bytes(content[: data.draw(st.integers(0, len(content)))])

    with contextlib.suppress(CalibrationFileError):
        CalibrationCapture.load(path)
