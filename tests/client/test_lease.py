"""Leases as blocks, on a real daemon."""

import asyncio
from collections.abc import Iterator
from typing import Any

import pytest

import transientcam
from tests.serving import Served, serving
from transientcam import AsyncCamera, Camera
from transientcam.errors import ProblemError, ProtocolError, ServerUnreachable
from transientcam.requests import Request

OTHER = {"harmonics": 4}


@pytest.fixture(scope="module")
def daemon() -> Iterator[Served]:
    with serving("sim:mirrors?noise=off") as served:
        served.start_all_workers()
        yield served


@pytest.fixture
def camera(daemon: Served) -> Iterator[Camera]:
    with Camera(daemon.url, timeout_s=60.0) as client:
        yield client


@pytest.fixture
def other(daemon: Served) -> Iterator[Camera]:
    with Camera(daemon.url, timeout_s=60.0) as client:
        yield client


def test_in_the_block_only_this_camera_changes_things(camera: Camera, other: Camera) -> None:
    with camera.lease("anna") as lease:
        camera.configure(**OTHER)
        with pytest.raises(ProblemError) as caught:
            other.configure(harmonics=3)
        assert other.sequence["harmonics"] == 4
        assert not lease.lost

    assert caught.value.type == "/problems/lease-held"
    assert caught.value.document["holder"] == "anna"
    other.configure(harmonics=3)
    camera.configure(harmonics=4)


def test_the_lease_outlives_its_duration_many_times(daemon: Served, camera: Camera) -> None:
    desk = daemon.service.lease
    with camera.lease("anna", duration_s=1.5) as lease:
        first = desk.current
        assert first is not None
        watched = camera.stream("flags")
        while (now := desk.current) is not None and now.expires_s < first.expires_s + 3.0:
            watched.receive()
        assert now is not None
        assert now.id == first.id

        assert not lease.lost
    assert desk.current is None


def test_a_lease_that_is_held_is_not_given(camera: Camera, other: Camera) -> None:
    with camera.lease("anna"), pytest.raises(ProblemError) as caught, other.lease("bert"):
        pass

    assert caught.value.status == 409
    other.configure(harmonics=3)


def test_a_lease_that_was_taken_over_is_lost_and_changes_nothing_more(
    camera: Camera, other: Camera
) -> None:
    with camera.lease("anna", duration_s=1.0) as lease, other.lease("bert", takeover=True):
        with pytest.raises(ProblemError) as caught:
            camera.configure(**OTHER)
        assert lease._thread is not None
        lease._thread.join()  # it ends when a renewal is refused
        assert lease.lost

    assert caught.value.type == "/problems/lease-lost"
    camera.configure(harmonics=3)


def test_the_light_goes_off_whichever_client_holds_the_lease(camera: Camera, other: Camera) -> None:
    with camera.lease("anna"):
        assert other.safe_off()["running"] is False
        assert camera.start()["running"] is True


def test_asyncio_has_it_all_too(daemon: Served) -> None:
    async def run() -> tuple[Any, ...]:
        async with (
            AsyncCamera(daemon.url, timeout_s=60.0) as camera,
            AsyncCamera(daemon.url, timeout_s=60.0) as other,
        ):
            async with camera.lease("anna", duration_s=1.0) as lease:
                await camera.configure(**OTHER)
                with pytest.raises(ProblemError) as held:
                    await other.configure(harmonics=3)
                async with other.lease("bert", takeover=True):
                    with pytest.raises(ProblemError) as lost:
                        await camera.configure(harmonics=3)
                    assert lease._task is not None
                    await lease._task
            stopped = await other.safe_off()
            await other.start()
            return held.value.type, lost.value.type, lease.lost, lease.holder, stopped["running"]

    assert asyncio.run(run()) == (
        "/problems/lease-held",
        "/problems/lease-lost",
        True,
        "anna",
        False,
    )
    assert daemon.service.lease.current is None


class Answers:
    """What a daemon would answer, request by request."""

    def __init__(self, *answers: dict[str, Any] | Exception) -> None:
        self._answers = list(answers)
        self.asked: list[str] = []

    def __call__(self, request: Request[Any]) -> dict[str, Any]:
        self.asked.append(request.method)
        answer = self._answers.pop(0)
        if isinstance(answer, Exception):
            raise answer
        return answer


TERMS = {"holder": "anna", "duration_s": 3600.0}


def test_an_answer_without_an_id_is_no_lease() -> None:
    with pytest.raises(ProtocolError, match="lease_id"):
        transientcam.Lease(Answers({"held": True}), lambda _: None, TERMS).__enter__()


def test_an_error_in_the_block_wins_over_one_at_its_end() -> None:
    shown: list[str | None] = []
    ask = Answers({"lease_id": "x"}, ServerUnreachable("http://a", "gone"))

    with pytest.raises(ZeroDivisionError), transientcam.Lease(ask, shown.append, TERMS):
        _ = 1 / 0

    assert ask.asked == ["POST", "DELETE"]
    assert shown == ["x", None]


def test_a_lease_that_cannot_be_given_back_says_so() -> None:
    shown: list[str | None] = []
    ask = Answers({"lease_id": "x"}, ServerUnreachable("http://a", "gone"))

    with pytest.raises(ServerUnreachable), transientcam.Lease(ask, shown.append, TERMS):
        pass

    assert shown == ["x", None]


def test_a_renewal_that_does_not_come_through_is_tried_again() -> None:
    renewed = []

    def ask(request: Request[Any]) -> dict[str, Any]:
        if request.method == "PUT":
            renewed.append(request)
            if len(renewed) == 1:
                raise ServerUnreachable("http://a", "gone for a moment")
            raise ProblemError(status=409, type="/problems/lease-lost")
        return {"lease_id": "x"}

    with transientcam.Lease(ask, lambda _: None, TERMS | {"duration_s": 0.003}) as lease:
        assert lease._thread is not None
        lease._thread.join()

    assert len(renewed) == 2
    assert lease.lost
