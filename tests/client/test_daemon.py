"""The client and the daemon, together, over real sockets and the emulated camera."""

import asyncio
import io
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from PIL import Image

import transientcam
from tests.serving import Served, serving
from transientcam import AsyncCamera, Camera, Frame, Notice, wire
from transientcam.errors import ProblemError, StreamClosed

_VIDEO: dict[str, Any] = {"harmonics": 3, "zeroth": "estimated", "exposure_s": 0.0005}
_STILL: dict[str, Any] = {"harmonics": 3, "zeroth": "low-frequency", "exposure_s": 0.0005}
_LONG_S = 60.0


@pytest.fixture
def served() -> Iterator[Served]:
    with serving("sim:mirrors?noise=off") as daemon:
        yield daemon


@pytest.fixture
def camera(served: Served) -> Iterator[Camera]:
    with Camera(served.url, timeout_s=60.0) as client:
        client.sequence = _STILL
        yield client


@pytest.fixture
def held(camera: Camera) -> Camera:
    """A camera that stands still, so that several requests are about the same frame."""
    camera.frame("range", wait_s=10.0)
    camera.stop()
    return camera


def _exhaust(stream: transientcam.Stream) -> None:
    """Receive until something is raised."""
    while True:
        stream.receive(timeout_s=_LONG_S)


def test_info_says_what_is_there(camera: Camera) -> None:
    info = camera.info

    assert info["name"] == "transientcam"
    assert info["version"] == transientcam.__version__
    assert {product["name"] for product in info["products"]} == set(wire.PRODUCTS)
    assert camera.camera["simulated"] is True
    assert camera.simulation["scene"] == "mirrors"


def test_a_sequence_is_set_read_changed_and_written_back(camera: Camera) -> None:
    camera.sequence = _VIDEO
    first = camera.sequence
    changed = camera.configure(takes=2)
    camera.sequence = first
    last = camera.sequence

    assert (first["harmonics"], first["zeroth"], first["images"]) == (3, "estimated", 12)
    assert first["frame_rate_hz"] == pytest.approx(18.6, abs=0.05)
    assert (changed["takes"], changed["images"]) == (2, 24)
    assert changed["sequence_id"] > first["sequence_id"]
    assert last | {"sequence_id": 0} == first | {"sequence_id": 0}


def test_a_sequence_that_cannot_be_is_refused_by_name_and_changes_nothing(camera: Camera) -> None:
    before = camera.sequence

    with pytest.raises(ProblemError) as caught:
        camera.sequence = {"harmonics": 99}

    assert (caught.value.status, caught.value.type) == (422, "/problems/invalid-sequence")
    assert (caught.value.field, caught.value.value) == ("harmonics", 99)
    assert camera.sequence == before


def test_validating_touches_nothing(camera: Camera) -> None:
    before = camera.sequence

    planned = camera.validate({"harmonics": 4, "takes": 40})

    assert planned["images"] == 800
    assert camera.sequence == before


def test_every_product_arrives_as_the_contract_says(held: Camera) -> None:
    lengths = {"y": 120, "x": 163, "coefficient": 7, "moment": 4, "image": 16, "time": 64}
    lengths |= {"return": 6, "coordinate": 3, "bound": 2}
    for product, described in wire.PRODUCTS.items():
        frame = held.frame(product)

        assert (frame.product, frame.unit) == (product, described.unit)
        assert (frame.axes, frame.array.dtype.str) == (described.axes, described.dtype)
        assert frame.array.shape == tuple(lengths[axis] for axis in frame.axes)
        assert set(frame.meta) == set(wire.FrameMeta.__annotations__)
        assert len(frame.labels) == (16 if product == "raw" else 0)
        assert (frame.time_s is not None) == ("time" in frame.axes)


def test_the_range_is_that_of_the_scene(held: Camera) -> None:
    range_m, truth_m = held.frame("range").array, held.frame("truth").array

    lit = np.isfinite(range_m) & np.isfinite(truth_m)
    assert lit.mean() > 0.5
    assert np.median(np.abs(range_m - truth_m)[lit]) < 0.05


def test_coefficients_evaluated_here_are_the_transient_evaluated_there(held: Camera) -> None:
    time_s = np.linspace(0.0, 43e-9, 50)

    coefficients = held.frame("coefficients")
    there = held.frame("transient", time_s=time_s)

    assert there.time_s is not None
    np.testing.assert_array_equal(there.time_s, time_s)
    here = transientcam.transient(
        coefficients, time_s, base_frequency_hz=coefficients.meta["base_frequency_hz"]
    )
    assert coefficients.frame == there.frame
    # both work in float32, where a sharp peak keeps about three digits
    scale = np.nanmax(there.array, axis=0)
    assert np.nanmax(np.abs(here - there.array) / scale) < 5e-3


def test_a_pixel_says_what_the_images_say_at_its_place(held: Camera) -> None:
    pixel = held.pixel(x=80, y=60, bins=16)

    assert pixel["range_m"] == pytest.approx(float(held.frame("range").array[60, 80]), rel=1e-4)
    assert len(pixel["time_s"]) == 16


def test_a_picture_holds_the_range_in_millimetres(held: Camera) -> None:
    image = np.asarray(Image.open(io.BytesIO(held.picture("range"))))
    colours = Image.open(io.BytesIO(held.picture("range", colour=True)))

    expected = np.nan_to_num(held.frame("range").array * 1e3).round()
    np.testing.assert_allclose(image, expected, atol=1)
    assert colours.size == (163, 120)


def test_a_refusal_has_its_type(held: Camera) -> None:
    refused: list[tuple[str, dict[str, Any], str]] = [
        ("rang", {}, "unknown-product"),
        ("range", {"bins": 4}, "invalid-request"),
        ("transient", {"bins": 0}, "invalid-request"),
        ("transient", {"bins": 4, "time_s": 1e-9}, "invalid-request"),
        ("range", {"after": 2**50}, "no-frame-yet"),
    ]
    for product, options, slug in refused:
        with pytest.raises(ProblemError) as caught:
            held.frame(product, **options)

        assert caught.value.type == f"/problems/{slug}"
        assert caught.value.detail


def test_a_newer_frame_can_be_waited_for(camera: Camera) -> None:
    first = camera.frame("range", wait_s=10.0)

    second = camera.frame("range", wait_s=10.0, after=first.frame)

    assert second.frame > first.frame


def test_a_stream_brings_each_product_of_each_frame(camera: Camera) -> None:
    camera.sequence = _VIDEO
    frames: list[Frame] = []
    with camera.stream("range", "coefficients", on_notice=lambda notice: None) as stream:
        for frame in stream:
            frames.append(frame)
            if len(frames) == 20:
                break
        hello = stream.hello

    assert hello is not None
    assert [channel.product for channel in hello.channels] == ["range", "coefficients"]
    assert hello.sequence["sequence_id"] == camera.sequence["sequence_id"]
    for one, other in zip(frames[::2], frames[1::2], strict=True):
        assert (one.product, other.product) == ("range", "coefficients")
        assert one.frame == other.frame
    numbers = [frame.frame for frame in frames[::2]]
    assert numbers == sorted(set(numbers))
    shapes = {channel.product: channel.shape for channel in hello.channels}
    assert {frame.product: frame.array.shape for frame in frames} == shapes


def test_a_rate_can_be_limited(camera: Camera) -> None:
    camera.sequence = _VIDEO

    with camera.stream("range", max_rate_hz=4.0) as stream:
        frames = [stream.receive(timeout_s=_LONG_S) for _ in range(4)]

    # a laden machine gives fewer, and never more; one is due a tenth of the period early
    times_s = [frame.meta["device_time_s"] for frame in frames]
    assert (np.subtract(times_s, times_s[0]) > (np.arange(4) - 0.11) / 4.0).all()


def test_a_change_of_the_sequence_is_announced_with_the_new_channels(camera: Camera) -> None:
    with camera.stream("coefficients") as stream:
        before = stream.receive(timeout_s=_LONG_S)
        applied = camera.configure(harmonics=4)
        after = stream.receive(timeout_s=_LONG_S)
        while after.meta["sequence_id"] != applied["sequence_id"]:
            after = stream.receive(timeout_s=_LONG_S)

        assert [notice.kind for notice in stream.notices].count("sequence-changed") == 1
        assert stream.sequence["harmonics"] == 4
        assert stream.channels[0].shape == after.array.shape == (9, 120, 163)
    assert before.array.shape == (7, 120, 163)


def test_a_subscription_to_what_is_not_there_is_refused_with_its_place(camera: Camera) -> None:
    stream = camera.stream("range", "rang")

    with pytest.raises(ProblemError) as caught:
        stream.receive(timeout_s=_LONG_S)

    assert caught.value.type == "/problems/unknown-product"
    with pytest.raises(StreamClosed) as closed:
        stream.receive(timeout_s=_LONG_S)
    assert closed.value.code == wire.CloseCode.BAD_FIRST_MESSAGE


def test_a_wrong_change_of_a_subscription_leaves_the_stream_as_it_was(camera: Camera) -> None:
    with camera.stream("range") as stream:
        stream.receive(timeout_s=_LONG_S)
        stream.subscribe("transient")

        with pytest.raises(ProblemError, match="transient cannot be streamed"):
            _exhaust(stream)
        assert stream.receive(timeout_s=_LONG_S).product == "range"

        stream.subscribe("brightness")
        while stream.receive(timeout_s=_LONG_S).product != "brightness":
            pass  # those of before that were on their way


def test_a_slow_reader_gets_fresh_frames_and_notices_of_those_it_missed(camera: Camera) -> None:
    camera.sequence = _VIDEO
    with camera.stream("range", credits=1) as stream:
        first = stream.receive(timeout_s=_LONG_S)
        # while this reader does nothing, the camera goes on
        newest = camera.latest(wait_s=10.0, after=first.frame + 8)["frame"]
        second = stream.receive(timeout_s=_LONG_S)

    assert second.frame >= newest
    dropped = [notice for notice in stream.notices if notice.kind == "dropped"]
    assert sum(notice.details["count"] for notice in dropped) == second.frame - first.frame - 1


def test_an_unplugged_camera_is_reported_and_comes_back_by_itself(camera: Camera) -> None:
    with camera.stream("range") as stream:
        stream.receive(timeout_s=_LONG_S)
        camera.cause("unplug")
        lost = _until(stream, "camera-lost", lambda: camera.cause("replug"))
        frame = stream.receive(timeout_s=_LONG_S)
        kinds = [notice.kind for notice in stream.notices]

    assert lost.details["reason"]
    assert kinds.index("camera-lost") < kinds.index("camera-back")
    assert frame.array.shape == (120, 163)


def _until(stream: transientcam.Stream, kind: str, then: Any) -> Notice:
    """Receive until a notice came, do something then, and return the notice."""
    while True:
        for notice in stream.notices:
            if notice.kind == kind:
                then()
                return notice
        try:
            stream.receive(timeout_s=0.2)
        except transientcam.FrameTimeout:
            continue


def test_a_lost_image_is_reported(camera: Camera) -> None:
    with camera.stream("range") as stream:
        stream.receive(timeout_s=_LONG_S)
        camera.cause("corrupt-image")
        while "lost-images" not in [notice.kind for notice in stream.notices]:
            frame = stream.receive(timeout_s=_LONG_S)

    assert frame.frame > 0


def test_a_stream_survives_a_restart_of_the_daemon() -> None:
    with serving("sim:mirrors?noise=off") as first:
        port = int(first.url.rpartition(":")[2])
        client = Camera(first.url, timeout_s=60.0)
        stream = client.stream("range", reconnect=True)
        stream.receive(timeout_s=_LONG_S)
    with serving("sim:mirrors?noise=off", port=port), client:
        frame = stream.receive(timeout_s=_LONG_S)
        while "reconnected" not in [notice.kind for notice in stream.notices]:
            frame = stream.receive(timeout_s=_LONG_S)
        assert frame.product == "range"


def test_a_daemon_that_stops_closes_its_streams() -> None:
    with serving("sim:mirrors?noise=off") as daemon:
        client = Camera(daemon.url, timeout_s=60.0)
        stream = client.stream("range")
        stream.receive(timeout_s=_LONG_S)
    with client, pytest.raises(StreamClosed) as caught:
        _exhaust(stream)
    assert caught.value.code == wire.CloseCode.GOING_AWAY


def test_the_asynchronous_twin_does_all_of_it(served: Served) -> None:
    async def run() -> None:
        async with AsyncCamera(served.url, timeout_s=60.0) as camera:
            assert (await camera.info())["name"] == "transientcam"
            applied = await camera.set_sequence(_VIDEO)
            assert applied["images"] == 12
            assert (await camera.configure(takes=2))["images"] == 24
            await camera.set_sequence(_VIDEO)
            frame = await camera.frame("range", wait_s=10.0)
            assert frame.array.shape == (120, 163)
            with pytest.raises(ProblemError, match="no product 'rang'"):
                await camera.frame("rang")
            async with camera.stream("range", "coefficients") as stream:
                products = [(await stream.receive()).product for _ in range(4)]
            assert products == ["range", "coefficients"] * 2

    asyncio.run(run())


def test_many_readers_take_the_same_frames_at_once(served: Served) -> None:
    async def read(camera: AsyncCamera) -> list[int]:
        async with camera.stream("range") as stream:
            return [(await stream.receive(timeout_s=_LONG_S)).frame for _ in range(5)]

    async def run() -> list[list[int]]:
        async with AsyncCamera(served.url, timeout_s=60.0) as camera:
            return list(await asyncio.gather(*(read(camera) for _ in range(8))))

    for numbers in asyncio.run(run()):
        assert numbers == sorted(set(numbers))


def test_a_stream_begins_with_a_frame_that_has_passed(camera: Camera) -> None:
    with camera.stream("flags") as live:
        latest = live.receive(timeout_s=_LONG_S).frame
        while live.receive(timeout_s=_LONG_S).frame < latest + 4:
            pass
    with camera.stream("flags", start=latest) as stream:
        numbers = [stream.receive(timeout_s=_LONG_S).frame for _ in range(4)]

    assert numbers == list(range(latest, latest + 4))


def test_a_thin_stream_holds_the_values_of_the_whole_one(camera: Camera) -> None:
    thin = wire.Subscription("range", encoding="u16", region=(10, 20, 60, 40), decimation=4)
    with camera.stream("range", thin) as stream:
        whole, part = (stream.receive(timeout_s=_LONG_S) for _ in range(2))

    assert part.frame == whole.frame
    assert part.meta["region"] == [10, 20, 60, 40]
    expected = whole.array[20:60:4, 10:70:4]
    np.testing.assert_allclose(part.array, expected, atol=0.51 * part.extra["scale"])
