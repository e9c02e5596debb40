"""`Camera` and `AsyncCamera` against a transport that records: both send the same requests."""

import asyncio
import inspect
import json
from collections.abc import Awaitable, Callable
from typing import Any, assert_type

import httpx
import pytest

import transientcam
from tests.client.conftest import Recording
from transientcam import AsyncCamera, AsyncStream, Camera, Frame, Stream
from transientcam.errors import ParameterError, ProblemError, ServerUnreachable

_URL = "http://lidar.example:8000"
_SEQUENCE = {"harmonics": 3, "takes": 1, "sequence_id": 4, "images": 12}


class _Daemon:
    """Answers every path as the real one does, and keeps the requests."""

    def __init__(self, frame: bytes) -> None:
        self.requests: list[httpx.Request] = []
        self._frame = frame

    def __call__(self, request: httpx.Request) -> httpx.Response:
        self.requests.append(request)
        if request.url.path.endswith(".msgpack"):
            headers = {"content-type": "application/vnd.msgpack"}
            return httpx.Response(200, content=self._frame, headers=headers)
        if request.url.path.endswith(".png"):
            return httpx.Response(200, content=b"\x89PNG", headers={"content-type": "image/png"})
        return httpx.Response(200, json=_SEQUENCE)

    @property
    def last(self) -> tuple[str, str, str, Any]:
        request = self.requests[-1]
        return (
            request.method,
            request.url.path,
            request.url.query.decode(),
            json.loads(request.content) if request.content else None,
        )


@pytest.fixture
def daemon(recorded: dict[str, Recording]) -> _Daemon:
    return _Daemon(recorded["frame"].data)


def _set_sequence(camera: Camera) -> None:
    camera.sequence = {"harmonics": 4}


_CALLS: dict[
    str,
    tuple[Callable[[Camera], object], Callable[[AsyncCamera], Awaitable[object]], tuple[Any, ...]],
] = {
    "info": (lambda c: c.info, lambda c: c.info(), ("GET", "info", "", None)),
    "camera": (lambda c: c.camera, lambda c: c.camera(), ("GET", "camera", "", None)),
    "sequence": (lambda c: c.sequence, lambda c: c.sequence(), ("GET", "sequence", "", None)),
    "set": (
        _set_sequence,
        lambda c: c.set_sequence({"harmonics": 4}),
        ("PUT", "sequence", "", {"harmonics": 4}),
    ),
    "configure": (
        lambda c: c.configure(takes=2),
        lambda c: c.configure(takes=2),
        ("PUT", "sequence", "", {**_SEQUENCE, "takes": 2}),
    ),
    "validate": (
        lambda c: c.validate({"takes": 2}),
        lambda c: c.validate({"takes": 2}),
        ("POST", "sequence/validate", "", {"takes": 2}),
    ),
    "plan": (
        lambda c: c.plan({"range_error_m": 0.005}, estimator="likelihood"),
        lambda c: c.plan({"range_error_m": 0.005}, estimator="likelihood"),
        ("POST", "plan", "", {"target": {"range_error_m": 0.005}, "estimator": "likelihood"}),
    ),
    "start a plan": (
        lambda c: c.start_plan(budget={"capture_s": 0.1}, target=None),
        lambda c: c.start_plan(budget={"capture_s": 0.1}, target=None),
        ("POST", "plan/jobs", "", {"budget": {"capture_s": 0.1}}),
    ),
    "tradeoff": (
        lambda c: c.tradeoff(),
        lambda c: c.tradeoff(),
        ("GET", "tradeoff", "by=range_error_m", None),
    ),
    "start a tradeoff": (
        lambda c: c.start_tradeoff("range_std_m"),
        lambda c: c.start_tradeoff("range_std_m"),
        ("POST", "tradeoff/jobs", "", {"by": "range_std_m"}),
    ),
    "reconstruction": (
        lambda c: c.reconstruction,
        lambda c: c.reconstruction(),
        ("GET", "reconstruction", "", None),
    ),
    "parameters": (
        lambda c: c.parameters,
        lambda c: c.parameters(),
        ("GET", "parameters", "", None),
    ),
    "measure": (
        lambda c: c.calibrations.measure(name="warm", frames=5),
        lambda c: c.calibrations.measure(name="warm", frames=5),
        (
            "POST",
            "calibrations",
            "",
            {"name": "warm", "frames": 5, "activate": False, "force": False},
        ),
    ),
    "activate": (
        lambda c: c.calibrations.activate("nominal"),
        lambda c: c.calibrations.activate("nominal"),
        ("PUT", "calibrations/active", "", {"id": "nominal", "force": False}),
    ),
    "calibration": (
        lambda c: c.calibrations.get("SIM-1"),
        lambda c: c.calibrations.get("SIM-1"),
        ("GET", "calibrations/SIM-1", "", None),
    ),
    "job": (
        lambda c: c.jobs.get("5a0c", wait_s=2.0),
        lambda c: c.jobs.get("5a0c", wait_s=2.0),
        ("GET", "jobs/5a0c", "wait_s=2.0", None),
    ),
    "cancel": (
        lambda c: c.jobs.cancel("5a0c"),
        lambda c: c.jobs.cancel("5a0c"),
        ("POST", "jobs/5a0c/cancel", "", None),
    ),
    "acquisition": (
        lambda c: c.acquisition,
        lambda c: c.acquisition(),
        ("GET", "acquisition", "", None),
    ),
    "start": (
        lambda c: c.start(),
        lambda c: c.start(),
        ("PUT", "acquisition", "", {"running": True}),
    ),
    "stop": (
        lambda c: c.stop(),
        lambda c: c.stop(),
        ("PUT", "acquisition", "", {"running": False}),
    ),
    "latest": (
        lambda c: c.latest(wait_s=2.0, after=4),
        lambda c: c.latest(wait_s=2.0, after=4),
        ("GET", "frames/latest", "wait_s=2.0&after=4", None),
    ),
    "frame": (
        lambda c: c.frame("transient", time_s=[1e-9, 2e-9]),
        lambda c: c.frame("transient", time_s=[1e-9, 2e-9]),
        ("GET", "frames/latest/transient.msgpack", "time_s=1e-09&time_s=2e-09", None),
    ),
    "bins": (
        lambda c: c.frame("cumulative", bins=8, wait_s=1.0, after=3),
        lambda c: c.frame("cumulative", bins=8, wait_s=1.0, after=3),
        ("GET", "frames/latest/cumulative.msgpack", "bins=8&wait_s=1.0&after=3", None),
    ),
    "former": (
        lambda c: c.frame("range", number=7, region=(1, 2, 3, 4), decimation=2),
        lambda c: c.frame("range", number=7, region=(1, 2, 3, 4), decimation=2),
        ("GET", "frames/7/range.msgpack", "region=1%2C2%2C3%2C4&decimation=2", None),
    ),
    "recorded": (
        lambda c: c.frame("streak", recording="a1", number=3, y=60, bins=9),
        lambda c: c.frame("streak", recording="a1", number=3, y=60, bins=9),
        ("GET", "recordings/a1/frames/3/streak.msgpack", "bins=9&y=60", None),
    ),
    "meta": (
        lambda c: c.meta(recording="a1", number=3),
        lambda c: c.meta(recording="a1", number=3),
        ("GET", "recordings/a1/frames/3", "", None),
    ),
    "frames": (lambda c: c.frames, lambda c: c.frames(), ("GET", "frames", "", None)),
    "timeline": (
        lambda c: c.timeline("a1"),
        lambda c: c.timeline("a1"),
        ("GET", "recordings/a1/frames", "", None),
    ),
    "file": (
        lambda c: c.file("range", "png", number=7, decimation=3),
        lambda c: c.file("range", "png", number=7, decimation=3),
        ("GET", "frames/7/range.png", "decimation=3", None),
    ),
    "past": (
        lambda c: c.record(history_s=5.0),
        lambda c: c.record(history_s=5.0),
        ("POST", "recordings", "", {"history_s": 5.0}),
    ),
    "picture": (
        lambda c: c.picture("range", colour=True),
        lambda c: c.picture("range", colour=True),
        ("GET", "frames/latest/range.png", "view=colour", None),
    ),
    "pixel": (
        lambda c: c.pixel(x=80, y=0, bins=16),
        lambda c: c.pixel(x=80, y=0, bins=16),
        ("GET", "frames/latest/pixel", "x=80&y=0&bins=16", None),
    ),
    "simulation": (
        lambda c: c.simulation,
        lambda c: c.simulation(),
        ("GET", "simulation", "", None),
    ),
    "cause": (
        lambda c: c.cause("unplug"),
        lambda c: c.cause("unplug"),
        ("POST", "simulation/faults", "", {"fault": "unplug"}),
    ),
}


def _awaited(daemon: _Daemon, call: Callable[[AsyncCamera], Awaitable[object]]) -> object:
    async def run() -> object:
        transport = httpx.MockTransport(daemon)
        async with AsyncCamera(_URL, token="secret", transport=transport) as camera:
            return await call(camera)

    return asyncio.run(run())


@pytest.mark.parametrize("name", _CALLS)
def test_both_cameras_send_the_same_requests(name: str, daemon: _Daemon) -> None:
    call, async_call, (method, path, query, body) = _CALLS[name]
    expected = (method, f"/api/v1/{path}", query, body)

    with Camera(_URL, token="secret", transport=httpx.MockTransport(daemon)) as camera:
        result = call(camera)
    assert daemon.last == expected

    async_result = _awaited(daemon, async_call)
    assert daemon.last == expected
    assert name == "set" or repr(result) == repr(async_result)


@pytest.mark.parametrize("spelling", ["diffuser", "diffusor"])
def test_a_diffuser_may_be_spelt_as_it_was_before(spelling: str, daemon: _Daemon) -> None:
    with Camera(_URL, token="secret", transport=httpx.MockTransport(daemon)) as camera:
        camera.simulate(**{spelling: True})  # type: ignore[arg-type]

    assert daemon.last == ("PUT", "/api/v1/simulation", "", {"diffusor": True})


def test_parts_of_the_simulation_that_are_not_given_are_left_out(daemon: _Daemon) -> None:
    with Camera(_URL, transport=httpx.MockTransport(daemon)) as camera:
        for parts in ({"scene": "corner"}, {"diffusor": False}, {"effects": {"fog": "on"}}):
            camera.simulate(**parts)
            assert daemon.last == ("PUT", "/api/v1/simulation", "", parts)


def test_a_sequence_that_was_read_is_sent_as_it_is(daemon: _Daemon) -> None:
    applied = {"harmonics": 3, "sub_phases": {"scheme": "arccos", "n": 8}, "sampling": None}
    with Camera(_URL, transport=httpx.MockTransport(daemon)) as camera:
        camera.sequence = applied

    assert daemon.last == ("PUT", "/api/v1/sequence", "", applied)


def test_every_request_carries_token_and_user_agent(daemon: _Daemon) -> None:
    with Camera(_URL, token="secret", transport=httpx.MockTransport(daemon)) as camera:
        camera.info  # noqa: B018 - reading it sends a request
    _awaited(daemon, lambda camera: camera.info())

    for request in daemon.requests:
        assert request.headers["authorization"] == "Bearer secret"
        assert request.headers["user-agent"] == f"transientcam/{transientcam.__version__}"


def test_without_a_token_no_authorization_is_sent(daemon: _Daemon) -> None:
    with Camera(_URL, transport=httpx.MockTransport(daemon)) as camera:
        camera.info  # noqa: B018 - reading it sends a request

    assert "authorization" not in daemon.requests[0].headers


def _public(kind: type) -> set[str]:
    return {name for name, _ in inspect.getmembers(kind) if not name.startswith("_")}


def test_the_twins_have_the_same_face() -> None:
    assert _public(AsyncCamera) == _public(Camera) | {"set_sequence", "set_reconstruction"}
    assert _public(AsyncStream) == _public(Stream)


@pytest.mark.parametrize("name", sorted(_public(Camera) & _public(AsyncCamera)))
def test_the_twins_take_the_same_arguments(name: str) -> None:
    one, other = getattr(Camera, name), getattr(AsyncCamera, name)
    if inspect.isfunction(one) and inspect.isfunction(other):
        assert inspect.signature(one).parameters == inspect.signature(other).parameters


def test_type_checkers_see_what_either_returns(daemon: _Daemon) -> None:
    async def asynchronous() -> None:
        async with AsyncCamera(_URL, transport=httpx.MockTransport(daemon)) as camera:
            assert_type(await camera.frame("range"), Frame)
            assert_type(await camera.picture("range"), bytes)
            assert_type(await camera.start(), dict[str, Any])
            assert_type(await camera.jobs.cancel("5a0c"), dict[str, Any])

    with Camera(_URL, transport=httpx.MockTransport(daemon)) as camera:
        assert_type(camera.frame("range"), Frame)
        assert_type(camera.picture("range"), bytes)
        assert_type(camera.start(), dict[str, Any])
        assert_type(camera.jobs.cancel("5a0c"), dict[str, Any])
    asyncio.run(asynchronous())


def test_a_request_that_cannot_be_built_is_refused_when_its_method_is_called() -> None:
    with pytest.raises(ParameterError, match="number is 0"):
        _ = AsyncCamera(_URL).frame("range", number=0)


def test_a_refusal_reaches_the_caller_of_either() -> None:
    def refuse(request: httpx.Request) -> httpx.Response:
        problem = {"type": "/problems/unknown-product", "detail": "No.", "known": ["range"]}
        headers = {"content-type": "application/problem+json"}
        return httpx.Response(404, content=json.dumps(problem).encode(), headers=headers)

    async def asynchronous() -> None:
        async with AsyncCamera(_URL, transport=httpx.MockTransport(refuse)) as camera:
            await camera.frame("rang")

    with Camera(_URL, transport=httpx.MockTransport(refuse)) as camera:
        with pytest.raises(ProblemError) as caught:
            camera.frame("rang")
        assert caught.value.document["known"] == ["range"]
    with pytest.raises(ProblemError, match="No"):
        asyncio.run(asynchronous())


def test_a_network_that_fails_reaches_the_caller_of_either_as_one_error() -> None:
    def fail(request: httpx.Request) -> httpx.Response:
        raise httpx.ConnectError("Connection refused", request=request)

    async def asynchronous() -> None:
        async with AsyncCamera(_URL, transport=httpx.MockTransport(fail)) as camera:
            await camera.info()

    with (
        Camera(_URL, transport=httpx.MockTransport(fail)) as camera,
        pytest.raises(ServerUnreachable, match=f"{_URL}: Connection refused"),
    ):
        camera.info  # noqa: B018 - reading it sends a request
    with pytest.raises(ServerUnreachable, match=f"{_URL}: Connection refused"):
        asyncio.run(asynchronous())


def test_no_answer_over_the_real_network_is_server_unreachable() -> None:
    with Camera("http://127.0.0.1:1", timeout_s=60.0) as camera:
        with pytest.raises(ServerUnreachable, match=r"http://127\.0\.0\.1:1: Connection refused"):
            camera.frame("range")
        with pytest.raises(ServerUnreachable, match="Connection refused"):
            next(iter(camera.stream("range")))


@pytest.mark.parametrize(
    ("arguments", "options", "field"),
    [
        ((), {}, "products"),
        (("range",), {"credits": 0}, "credits"),
        (("range",), {"credits": 65}, "credits"),
        (("range",), {"max_rate_hz": 0.0}, "max_rate_hz"),
        (("range",), {"max_rate_hz": float("nan")}, "max_rate_hz"),
        (("range",), {"max_rate_hz": float("inf")}, "max_rate_hz"),
        ((transientcam.Subscription("range", -1.0),), {}, "max_rate_hz"),
    ],
)
def test_a_stream_that_cannot_be_is_refused_before_it_connects(
    arguments: tuple[Any, ...], options: dict[str, Any], field: str
) -> None:
    with Camera(_URL) as camera, pytest.raises(ParameterError) as caught:
        camera.stream(*arguments, **options)

    assert caught.value.field == field


def test_a_camera_shows_where_it_is() -> None:
    with Camera("lidar.example:8000/") as camera:
        assert repr(camera) == f"<Camera {_URL}>"
        assert repr(AsyncCamera(_URL)) == f"<AsyncCamera {_URL}>"
