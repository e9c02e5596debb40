"""Each thing is computed once for all requests, on workers, and only when requested."""

import asyncio
import io
import threading
from collections.abc import Awaitable, Callable, Iterator
from concurrent.futures import Executor, ThreadPoolExecutor
from dataclasses import replace
from typing import Any, cast

import numpy as np
import pytest

import transientcam_moments as tm
from tests.moments.compiled_kernels import without_kernels
from transientcam import wire
from transientcam_driver import AppliedSequence, Camera, RawFrame, Sampling, Sequence, open_camera
from transientcam_server.errors import Problem, kinds
from transientcam_server.imaging import (
    MSGPACK,
    Crop,
    Encoding,
    Frame,
    Pipeline,
    Recipe,
    SettingsVersion,
    View,
    Workers,
    suited,
)
from transientcam_server.imaging._encodings.encoding import NPY
from transientcam_server.imaging._frames import frame as module, stages
from transientcam_server.settings import ReconstructionSettings


@pytest.fixture(scope="module")
def camera() -> Iterator[Camera]:
    with open_camera("sim:mirrors?noise=off") as opened:
        yield opened


@pytest.fixture(scope="module")
def raw(camera: Camera) -> RawFrame:
    camera.start()
    frame = camera.read_frame()
    camera.stop()
    return frame


@pytest.fixture
def calls(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Names of stages in the order they were computed; each on a worker."""
    computed: list[str] = []

    def counted(found: tm.Reconstruction, stage: str) -> None:
        assert threading.current_thread().name.startswith("worker")
        computed.append(stage)
        read(found, stage)

    read = stages._read
    monkeypatch.setattr(stages, "_read", counted)
    return computed


@pytest.fixture
def hops(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Names of the functions that were run on a worker, in order."""
    ran: list[str] = []
    run = Workers.run

    async def counted(self: Workers, compute: Callable[..., Any], *arguments: Any) -> Any:
        ran.append(compute.__name__)
        return await run(self, compute, *arguments)

    monkeypatch.setattr(Workers, "run", counted)
    return ran


def with_frame(
    camera: Camera,
    raw: RawFrame,
    test: Callable[[Pipeline, Frame], Awaitable[None]],
    *,
    sensor: tm.noise.Sensor | None = None,
) -> None:
    async def main() -> None:
        with ThreadPoolExecutor(2, thread_name_prefix="worker") as executor:
            workers = Workers(executor, count=2)
            # whose numbers are the same whether its kernel is compiled or not
            settings = ReconstructionSettings(estimator="pisarenko", neighbours="gaussian")
            pipeline = Pipeline(camera, settings, workers, sensor=sensor)
            try:
                await test(pipeline, pipeline.frame(raw, camera.applied))
            finally:
                await workers.close(within_s=30.0)

    asyncio.run(main())


def test_nothing_is_computed_that_is_not_requested(
    camera: Camera, raw: RawFrame, calls: list[str]
) -> None:
    async def test(pipeline: Pipeline, frame: Frame) -> None:
        assert frame.meta()["reconstruct_s"] is None
        assert frame.meta()["pixels"] is None
        await frame.product(pipeline.product("raw"))
        assert calls == []
        await frame.product(pipeline.product("coefficients"))
        assert calls == ["light", "coefficients"]

    with_frame(camera, raw, test)


def test_simultaneous_requests_share_one_computation_and_the_same_bytes(
    camera: Camera, raw: RawFrame, calls: list[str]
) -> None:
    async def test(pipeline: Pipeline, frame: Frame) -> None:
        wanted = [pipeline.product(name) for name in ("range", "direct", "range", "coefficients")]
        asking = [frame.encoded(product, MSGPACK, channel=0) for product in wanted for _ in "abc"]
        encoded = await asyncio.gather(*asking)

        assert sorted(calls) == ["coefficients", "light", "returns"]
        assert encoded[0] is encoded[1] is encoded[6]
        assert encoded[0] is not encoded[3]

    with_frame(camera, raw, test)


def test_a_product_takes_two_hops_to_a_worker(
    camera: Camera, raw: RawFrame, hops: list[str]
) -> None:
    async def test(pipeline: Pipeline, frame: Frame) -> None:
        await frame.encoded(pipeline.product("range"), MSGPACK, channel=0)
        assert hops == ["compute", "_made"]

    with_frame(camera, raw, test)


def test_products_requested_together_share_the_first_hop(
    camera: Camera, raw: RawFrame, hops: list[str]
) -> None:
    async def test(pipeline: Pipeline, frame: Frame) -> None:
        names = ("brightness", "range", "direct", "indirect", "coefficients")
        await asyncio.gather(
            *(frame.encoded(pipeline.product(name), MSGPACK, channel=0) for name in names)
        )
        assert hops == ["compute", *["_made"] * len(names)]

    with_frame(camera, raw, test)


@pytest.mark.parametrize("name", ["coefficients", "returns", "range"])
def test_a_region_is_that_of_the_whole_whichever_is_requested_first(
    camera: Camera, raw: RawFrame, name: str
) -> None:
    view = View(crop=Crop((30, 20, 41, 13), 3))

    async def test(pipeline: Pipeline, frame: Frame) -> None:
        product = pipeline.product(name)
        region, whole, again = [
            np.load(io.BytesIO(await frame.encoded(product, encoding, each)))
            for encoding, each in ((NPY, view), (NPY, View()), (replace(NPY, name="npy2"), view))
        ]
        assert whole.shape[-2:] == (120, 163)
        np.testing.assert_array_equal(region, whole[..., 20:33:3, 30:71:3])
        np.testing.assert_array_equal(again, region)

    with_frame(camera, raw, test)


def test_requests_that_wait_when_the_workers_close_are_answered(
    camera: Camera, raw: RawFrame, monkeypatch: pytest.MonkeyPatch
) -> None:
    begun, end = threading.Event(), threading.Event()

    def compute(*arguments: Any) -> stages.Computed:
        begun.set()
        end.wait()
        return stages.compute(*arguments)

    monkeypatch.setattr(module, "compute", compute)

    async def test(pipeline: Pipeline, frame: Frame) -> None:
        requests = [
            asyncio.ensure_future(work)
            for work in (
                frame.encoded(pipeline.product("range"), MSGPACK),
                frame.product(pipeline.product("direct")),
                frame.reconstruction("returns"),
            )
        ]
        left = asyncio.ensure_future(frame.encoded(pipeline.product("direct"), MSGPACK))
        await asyncio.to_thread(begun.wait)
        left.cancel()  # by its own client
        closed = asyncio.ensure_future(frame._workers.close(within_s=30.0))
        *answers, cancelled = await asyncio.gather(*requests, left, return_exceptions=True)
        end.set()
        assert await closed
        assert isinstance(cancelled, asyncio.CancelledError)
        for answer in answers:
            assert isinstance(answer, Problem)
            assert answer.kind is kinds.SHUTTING_DOWN

    with_frame(camera, raw, test)


def test_an_array_that_is_there_is_not_computed_again(camera: Camera, raw: RawFrame) -> None:
    async def test(pipeline: Pipeline, frame: Frame) -> None:
        computed = []

        def count(*_: Any) -> Any:
            computed.append(1)
            return np.zeros((120, 163), dtype=np.float32)

        product = replace(pipeline.product("range"), compute=count)
        await frame.encoded(product, NPY)
        await frame.encoded(product, MSGPACK)
        assert (await frame.product(product)).shape == (120, 163)
        assert len(computed) == 1

    with_frame(camera, raw, test)


@pytest.mark.parametrize("encoding", [MSGPACK, NPY])
def test_arrays_travel_in_the_type_of_the_contract_whatever_they_were_computed_in(
    camera: Camera, raw: RawFrame, encoding: Encoding
) -> None:
    array = np.asfortranarray(np.arange(120.0 * 163.0).reshape(120, 163))

    async def test(pipeline: Pipeline, frame: Frame) -> None:
        product = replace(pipeline.product("direct"), compute=lambda *_: array)
        data = await frame.encoded(product, encoding)
        found = wire.parse_frame(data).array if encoding is MSGPACK else np.load(io.BytesIO(data))
        assert found.dtype == np.dtype("<f4")
        np.testing.assert_array_equal(found, array)

    with_frame(camera, raw, test)


def test_the_meta_states_what_the_computation_took_and_found(camera: Camera, raw: RawFrame) -> None:
    async def test(pipeline: Pipeline, frame: Frame) -> None:
        await frame.product(pipeline.product("range"))
        meta = frame.meta()

        assert meta["reconstruct_s"] is not None
        assert meta["reconstruct_s"] > 0.0
        assert meta["pixels"] is not None
        assert meta["pixels"]["total"] == 163 * 120
        # which pixels are there is known of each answer alone
        assert set(meta) == set(wire.FrameMeta.__annotations__) - {"region", "decimation"}
        assert set(meta["pixels"]) == set(wire.PixelCounts.__annotations__)

    with_frame(camera, raw, test)


def test_frames_are_counted_from_one(camera: Camera, raw: RawFrame) -> None:
    async def test(pipeline: Pipeline, frame: Frame) -> None:
        assert frame.number == 1
        assert pipeline.frame(raw, camera.applied).number == 2

    with_frame(camera, raw, test)


def test_a_caller_that_stops_waiting_does_not_stop_it_for_the_others(
    camera: Camera, raw: RawFrame
) -> None:
    async def test(pipeline: Pipeline, frame: Frame) -> None:
        product = pipeline.product("range")
        impatient = asyncio.ensure_future(frame.product(product))
        patient = asyncio.ensure_future(frame.product(product))
        await asyncio.sleep(0)
        impatient.cancel()

        assert (await patient).shape == (120, 163)

    with_frame(camera, raw, test)


def test_a_failure_raises_in_all_callers_and_is_logged_once(
    camera: Camera, raw: RawFrame, caplog: pytest.LogCaptureFixture
) -> None:
    def fail(*_: Any) -> Any:
        raise ZeroDivisionError

    async def test(pipeline: Pipeline, frame: Frame) -> None:
        broken = replace(pipeline.product("direct"), compute=fail)
        following = pipeline.frame(raw, camera.applied)
        results = await asyncio.gather(
            frame.product(broken),
            frame.encoded(broken, NPY),
            following.product(broken),
            frame.product(pipeline.product("range")),
            return_exceptions=True,
        )
        assert all(isinstance(each, Problem) for each in results[:3])
        assert isinstance(results[3], np.ndarray)

    with_frame(camera, raw, test)
    assert [record.levelname for record in caplog.records] == ["ERROR"]


def test_what_was_asked_at_some_times_of_flight_is_not_kept_forever(
    camera: Camera, raw: RawFrame
) -> None:
    async def test(pipeline: Pipeline, frame: Frame) -> None:
        product = pipeline.product("transient")
        for index in range(20):
            await frame.encoded(product, NPY, View((index * 1e-9,)))

        assert len(frame._over_time) <= 4

    with_frame(camera, raw, test)


def test_long_answers_leave_a_worker_to_everything_else(camera: Camera, raw: RawFrame) -> None:
    gate = threading.Event()

    def wait_at_the_gate(*_: Any) -> Any:
        assert gate.wait(60.0)
        return np.zeros((1, 120, 163), dtype=np.float32)

    async def test(pipeline: Pipeline, frame: Frame) -> None:
        endless = replace(pipeline.product("transient"), compute=wait_at_the_gate)
        long = [
            asyncio.ensure_future(frame.product(endless, View((index * 1e-9,))))
            for index in range(5)
        ]
        # with both workers at the gate this would never end
        assert (await frame.product(pipeline.product("range"))).shape == (120, 163)
        gate.set()
        await asyncio.gather(*long)

    with_frame(camera, raw, test)


def test_former_frames_leave_a_worker_to_the_newest(camera: Camera, raw: RawFrame) -> None:
    gate = threading.Event()

    def wait_at_the_gate(*_: Any) -> Any:
        assert gate.wait(60.0)
        return np.zeros((120, 163), dtype=np.float32)

    async def test(pipeline: Pipeline, frame: Frame) -> None:
        endless = replace(pipeline.product("range"), needs="raw", compute=wait_at_the_gate)
        former = [
            asyncio.ensure_future(frame.bare().encoded(endless, MSGPACK, channel=index))
            for index in range(5)
        ]
        # with both workers at the gate this would never end
        assert (await frame.product(pipeline.product("range"))).shape == (120, 163)
        gate.set()
        await asyncio.gather(*former)

    with_frame(camera, raw, test)


def test_a_bare_frame_is_the_same_with_nothing_computed(
    camera: Camera, raw: RawFrame, calls: list[str]
) -> None:
    async def test(pipeline: Pipeline, frame: Frame) -> None:
        first = await frame.product(pipeline.product("range"))
        bare = frame.bare()
        assert (bare.number, bare.raw, bare.recipe) == (frame.number, frame.raw, frame.recipe)
        assert bare.meta()["reconstruct_s"] is None
        np.testing.assert_array_equal(await bare.product(pipeline.product("range")), first)
        assert calls == ["light", "returns"] * 2

    with_frame(camera, raw, test)


def test_too_many_times_of_flight_are_refused_before_anything_is_computed(
    camera: Camera, raw: RawFrame, calls: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "MAX_ANSWER_BYTES", 163 * 120 * 4)

    async def test(pipeline: Pipeline, frame: Frame) -> None:
        with pytest.raises(Problem, match="at most 1"):
            await frame.product(pipeline.product("transient"), View((0.0, 1e-9)))
        assert calls == []

    with_frame(camera, raw, test)


def test_an_unknown_product_is_answered_with_the_known_ones(camera: Camera, raw: RawFrame) -> None:
    async def test(pipeline: Pipeline, frame: Frame) -> None:
        with pytest.raises(Problem) as caught:
            pipeline.product("x" * 1000)
        # no sensor is stated here, but images tell their noise
        assert caught.value.extensions["known"] == sorted(wire.PRODUCTS)
        assert len(str(caught.value.extensions["value"])) < 100

    with_frame(camera, raw, test)


def test_frames_are_of_the_estimator_that_is_set_compiled_or_not(
    camera: Camera, raw: RawFrame
) -> None:
    async def test(pipeline: Pipeline, frame: Frame) -> None:
        pipeline.reconstruction = SettingsVersion(7, ReconstructionSettings())
        with without_kernels():
            meta = pipeline.frame(raw, camera.applied).meta()

        assert meta["estimator"] == "likelihood"
        assert meta["reconstruction_id"] == 7

    with_frame(camera, raw, test, sensor=tm.noise.Sensor())


@pytest.mark.parametrize(
    ("multiples", "technique"), [((2, 3), "unwrapped-phase"), ((2, 10, 15), "two-returns")]
)
def test_frequencies_with_gaps_have_an_estimator_of_their_own(
    multiples: tuple[int, ...], technique: str
) -> None:
    gapped = Sequence(harmonics=len(multiples), sampling=Sampling(multiples))

    assert technique_of(gapped) == technique
    assert suited(ReconstructionSettings(), gapped.sampling) == ReconstructionSettings()


def technique_of(sequence: Sequence) -> str:
    """Return the estimator of recorded frames of a sequence with the usual settings."""
    applied = AppliedSequence(sequence, 0, 12, 1.0, 1.0, 18.7, 1.0, 8e6)
    return Recipe(applied, ReconstructionSettings(), 4095.0, sensor=tm.noise.Sensor()).technique


def test_a_large_frame_takes_all_cores_unless_another_is_computed(
    camera: Camera, raw: RawFrame, monkeypatch: pytest.MonkeyPatch
) -> None:
    all_cores = tm.kernels.over(cast("Executor", None), 2)
    spreads: list[tm.kernels.Spread] = []
    two_at_once = threading.Barrier(2)
    reconstruct = Recipe.reconstruct

    def noting(*arguments: Any, spread: tm.kernels.Spread, **given: Any) -> tm.Reconstruction:
        spreads.append(spread)
        if len(spreads) <= 2:
            two_at_once.wait(60.0)
        return reconstruct(*arguments, **given)

    monkeypatch.setattr(module, "spread_of", lambda raw: all_cores)
    monkeypatch.setattr(Recipe, "reconstruct", noting)

    async def test(pipeline: Pipeline, frame: Frame) -> None:
        second, third = (pipeline.frame(raw, camera.applied) for _ in range(2))
        await asyncio.gather(frame.reconstruction("returns"), second.reconstruction("returns"))
        await third.reconstruction("returns")

    with_frame(camera, raw, test)
    assert spreads == [all_cores, tm.kernels.at_once, all_cores]
