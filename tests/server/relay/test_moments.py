"""A relay of moments before a real origin: what is equal to the origin's, and what is refused."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest

import transientcam
import transientcam_moments as tm
from tests.server.relay.forwarder import forwarding
from tests.serving import Served, serving
from tests.waiting import wait_until
from transientcam_driver import CalibrationError, CameraLost
from transientcam_server.relay import Origin, RelayCamera

PATIENCE_S = 60.0
TAKES: dict[str, Any] = {
    "harmonics": 2,
    "zeroth": "low-frequency",
    "exposure_s": 0.0002,
    "takes": 3,
}
SAME: tuple[str, ...] = (
    "range",
    "direct",
    "indirect",
    "uniform",
    "brightness",
    "validity",
    "flags",
)
SAME += ("coefficients", "moments", "measured_moments", "returns", "pointcloud")
LONG = {"seconds": 60.0}


@contextmanager
def relay_of(url: str, product: str = "measured_moments", **settings: Any) -> Iterator[Served]:
    name = f"relay:{url}?timeout_s={PATIENCE_S:g}&product={product}"
    with serving(name, history=LONG, **settings) as daemon:
        yield daemon


@pytest.fixture(scope="module")
def origin() -> Iterator[Served]:
    with serving("sim:corner", history=LONG) as daemon:
        daemon.start_all_workers()
        yield daemon


@pytest.fixture(scope="module")
def relay(origin: Served) -> Iterator[Served]:
    with relay_of(origin.url) as daemon, transientcam.Camera(daemon.url) as camera:
        daemon.start_all_workers()
        camera.latest(wait_s=10.0)  # its stream stands, whose threads stay
        yield daemon


@pytest.fixture
def at_origin(origin: Served) -> Iterator[transientcam.Camera]:
    with transientcam.Camera(origin.url, timeout_s=PATIENCE_S) as camera:
        camera.configure(**TAKES)
        yield camera


@pytest.fixture
def at_relay(relay: Served, at_origin: transientcam.Camera) -> Iterator[transientcam.Camera]:
    with transientcam.Camera(relay.url, timeout_s=PATIENCE_S) as camera:
        yield camera


def frame_of(relay: Served, wanted: Callable[[Any], bool]) -> tuple[int, int]:
    """Return the number of a frame whose metadata are as wanted, here and at the origin."""
    with transientcam.Camera(relay.url) as camera, camera.stream("flags") as stream:
        while not wanted((frame := stream.receive(timeout_s=PATIENCE_S)).meta):
            pass
    kept = relay.service.history.newest(1e6)
    return frame.frame, next(each.raw.number for each in kept if each.number == frame.frame)


def of_takes(meta: Any) -> bool:
    return bool(meta["takes"] == TAKES["takes"])


def test_what_is_computed_of_moments_is_the_origins_to_the_bit(
    at_origin: transientcam.Camera, at_relay: transientcam.Camera, relay: Served
) -> None:
    number, theirs = frame_of(relay, of_takes)
    for product in SAME:
        ours = at_relay.frame(product, number=number)
        its = at_origin.frame(product, number=theirs)
        assert ours.array.tobytes() == its.array.tobytes(), product
    for product in ("transient", "bounds", "density_std"):
        first, second = (
            camera.frame(product, number=n, bins=3, region=(40, 40, 8, 8)).array
            for camera, n in ((at_relay, number), (at_origin, theirs))
        )
        np.testing.assert_array_equal(first, second)


def test_metadata_and_memory_are_those_of_moments(
    at_origin: transientcam.Camera, at_relay: transientcam.Camera, relay: Served
) -> None:
    number, theirs = frame_of(relay, of_takes)
    ours = dict(at_relay.frame("range", number=number).meta)
    its = dict(at_origin.frame("range", number=theirs).meta)
    for name in ("rejected_images", "repaired_images", "pixels", "predicted_range_std_m"):
        assert ours[name] == its[name] is not None, name
    planes_bytes = 8 * (TAKES["harmonics"] + 1) + 1  # moments, and whether it is saturated
    kept = relay.service.history.frame(number).raw
    assert kept.size_bytes == planes_bytes * ours["width"] * ours["height"]


def test_smoothing_and_biasing_are_the_relays_own(
    at_origin: transientcam.Camera, at_relay: transientcam.Camera, relay: Served
) -> None:
    own = {"neighbours": "none", "bias": 0.1, "estimator": "pisarenko"}
    before = at_relay.reconstruction
    at_relay.reconstruction = own
    try:
        version = at_relay.reconstruction["reconstruction_id"]
        number, theirs = frame_of(relay, lambda meta: meta["reconstruction_id"] == version)
    finally:
        at_relay.reconstruction = before
    ours = at_relay.frame("moments", number=number).array
    its = at_origin.frame("measured_moments", number=theirs).array
    np.testing.assert_array_equal(ours[1:], its[1:])  # not smoothed, and biased in b_0 alone
    assert (ours[0].real >= its[0].real).all()


def test_pixels_that_were_saturated_are_flagged_at_the_relay_too(
    at_origin: transientcam.Camera, at_relay: transientcam.Camera, relay: Served
) -> None:
    at_origin.configure(**TAKES | {"exposure_s": 0.01, "takes": 2})
    number, theirs = frame_of(relay, lambda meta: meta["takes"] == 2)
    at_origin.configure(**TAKES)
    ours = at_relay.frame("flags", number=number)
    assert (ours.array & np.uint8(tm.Flags.SATURATED)).any()
    np.testing.assert_array_equal(ours.array, at_origin.frame("flags", number=theirs).array)


def test_a_calibration_of_the_origin_comes_with_the_first_frame_of_it(
    at_origin: transientcam.Camera, at_relay: transientcam.Camera, origin: Served, relay: Served
) -> None:
    at_origin.simulate(diffuser=True)
    job = at_origin.calibrations.measure(frames=4, activate=True, harmonics=False)
    active = at_origin.wait_for(job["id"])["result"]["calibration"]
    number, theirs = frame_of(relay, lambda meta: meta["calibration_id"] == active)
    for product in ("range", "flags"):
        ours = at_relay.frame(product, number=number).array
        np.testing.assert_array_equal(ours, at_origin.frame(product, number=theirs).array)
    at_origin.simulate(diffuser=False)  # not before: images of both in one capture tell of motion
    assert at_relay.calibrations.active()["calibration_id"] == active
    at_origin.calibrations.activate("nominal")
    frame_of(relay, lambda meta: meta["calibration_id"] == "nominal")
    for each in relay.service.history.newest(1e6):  # no moments of the one with gains of the other
        its = origin.service.history.frame(each.raw.number).meta()
        assert each.meta()["calibration_id"] == its["calibration_id"]


@pytest.mark.parametrize(
    "request_images",
    [
        lambda camera: camera.record(frames=1),
        lambda camera: camera.calibrations.activate("nominal"),
        lambda camera: setattr(camera, "reconstruction", {"spoilt_images": "fill"}),
        lambda camera: camera.plan({"range_std_m": 0.01}),
    ],
    ids=["recording", "calibration", "corrupt-images", "plan"],
)
def test_what_needs_images_is_refused_with_the_origins_address(
    at_relay: transientcam.Camera, origin: Served, request_images: Callable[[Any], Any]
) -> None:
    with pytest.raises(transientcam.ProblemError, match=origin.url) as refused:
        request_images(at_relay)
    assert refused.value.type == "/problems/only-moments"
    assert refused.value.document["origin"] == origin.url


def test_averaging_over_frames_is_refused_where_no_one_states_the_noise(
    at_relay: transientcam.Camera, relay: Served, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(relay.service, "sensor", None)
    with pytest.raises(transientcam.ProblemError, match="still_frames") as refused:
        at_relay.reconstruction = {"still_frames": 16}
    assert refused.value.type == "/problems/only-moments"
    assert at_relay.reconstruction["still_frames"] == 1


def test_there_are_no_images_and_the_reason_is_stated(
    at_relay: transientcam.Camera, relay: Served
) -> None:
    assert at_relay.camera["origin"]["product"] == "measured_moments"
    absent = {each["name"]: each["reason"] for each in at_relay.info["absent_products"]}
    assert "moments alone" in absent["raw"]
    assert httpx.get(f"{relay.url}/api/v1/frames/latest/raw.npy").status_code == 404
    with pytest.raises(CameraLost, match=r"no raw: .*moments alone"):
        RelayCamera(Origin(relay.url, None, timeout_s=PATIENCE_S))


def test_what_becomes_of_corrupt_images_is_stated_as_at_the_origin(
    at_origin: transientcam.Camera, at_relay: transientcam.Camera
) -> None:
    before = at_origin.reconstruction
    assert at_relay.reconstruction["spoilt_images"] == before["spoilt_images"]
    at_origin.reconstruction = before | {"spoilt_images": "keep"}
    try:
        wait_until(lambda: at_relay.reconstruction["spoilt_images"] == "keep")
    finally:
        at_origin.reconstruction = before
    wait_until(lambda: at_relay.reconstruction["spoilt_images"] == before["spoilt_images"])


def test_a_calibration_for_a_relay_of_moments_is_refused(origin: Served, tmp_path: Path) -> None:
    given = tmp_path / "calibration.npz"
    with (
        pytest.raises(CalibrationError, match=f"{origin.url}.*product=raw"),
        relay_of(origin.url, calibration=given),
    ):
        pass


def test_a_chain_has_the_same_moments(at_origin: transientcam.Camera, relay: Served) -> None:
    with relay_of(relay.url) as second, transientcam.Camera(second.url) as camera:
        number, between = frame_of(second, of_takes)
        assert len(camera.meta(number=number)["hops"]) == 2
        theirs = relay.service.history.frame(between).raw.number
        ours = camera.frame("range", number=number)
        np.testing.assert_array_equal(ours.array, at_origin.frame("range", number=theirs).array)


def test_a_cut_connection_is_resumed(at_origin: transientcam.Camera, origin: Served) -> None:
    with (
        forwarding(origin.url) as network,
        relay_of(network.url) as relay,
        transientcam.Camera(relay.url) as camera,
        camera.stream("range") as stream,
    ):
        stream.receive(timeout_s=PATIENCE_S)
        network.cut()
        while "camera-back" not in [each.kind for each in stream.notices]:
            stream.receive(timeout_s=PATIENCE_S)
        assert camera.camera["origin"]["reconnects"] >= 1
        number, theirs = frame_of(relay, of_takes)
        ours = camera.frame("range", number=number)
        np.testing.assert_array_equal(ours.array, at_origin.frame("range", number=theirs).array)
