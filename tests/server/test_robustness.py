"""What goes wrong for one leaves all others undisturbed."""

import socket
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any, NoReturn

import httpx
import pytest
from websockets.client import ClientProtocol
from websockets.uri import parse_uri

import transientcam_moments as tm
from tests.server.streaming import streaming
from tests.serving import Served
from tests.waiting import wait_until
from transientcam import wire
from transientcam_server.broadcast import Delivery

LATEST = "/api/v1/frames/latest"
PATIENCE_S = 60.0


def fault(http: httpx.Client, name: str) -> None:
    assert http.post("/api/v1/simulation/faults", json={"fault": name}).status_code == 200


@contextmanager
def never_reading(url: str, *products: str) -> Iterator[socket.socket]:
    """A client that subscribes and then reads nothing more."""
    uri = parse_uri(url)
    protocol = ClientProtocol(uri, subprotocols=[wire.SUBPROTOCOL])  # type: ignore[list-item]
    with socket.socket() as connection:
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        connection.settimeout(PATIENCE_S)
        connection.connect((uri.host, uri.port))
        protocol.send_request(protocol.connect())
        connection.sendall(b"".join(protocol.data_to_send()))
        answer = b""
        while b"\r\n\r\n" not in answer:
            answer += connection.recv(1)
        protocol.receive_data(answer)
        list(protocol.events_received())
        message = {
            "type": "subscribe",
            "v": 1,
            "subscriptions": [{"product": product} for product in products],
        }
        protocol.send_binary(wire.pack(message))
        connection.sendall(b"".join(protocol.data_to_send()))
        yield connection


def test_a_client_that_never_reads_loses_frames_and_no_other_does(served: Served) -> None:
    hub = served.service.hub
    with (
        streaming(served.stream_url) as healthy,
        never_reading(served.stream_url, "raw", "coefficients"),
    ):
        healthy.subscribe("flags")
        wait_until(lambda: len(hub.subscribers) == 2)
        (stuck,) = (each for each in hub.subscribers if len(each.channels) == 2)
        wait_until(lambda: stuck.channels[0].dropped > 3)
        messages = [healthy.receive() for _ in range(10)]

        waiting = [item for item in stuck._waiting if isinstance(item, Delivery)]
        assert len(waiting) <= served.settings.stream.queue_frames
        # a busy machine drops frames of the healthy one too, and reports them before the next one
        frames = [at for at, each in enumerate(messages) if isinstance(each, wire.Frame)]
        between = messages[frames[0] : frames[-1] + 1]
        numbers = [each.meta["frame"] for each in between if isinstance(each, wire.Frame)]
        dropped = sum(
            each.details["count"]
            for each in between
            if isinstance(each, wire.Notice) and each.kind == "dropped"
        )
        assert numbers[-1] - numbers[0] + 1 == len(numbers) + dropped


def test_a_client_that_never_reads_does_not_delay_the_shutdown() -> None:
    from tests.serving import serving

    with (
        serving("sim:mirrors?noise=off") as daemon,
        never_reading(daemon.stream_url, "raw", "coefficients"),
    ):
        wait_until(lambda: len(daemon.service.hub.subscribers) == 1)
        (stuck,) = daemon.service.hub.subscribers
        wait_until(lambda: stuck.channels[0].dropped > 0)


@pytest.mark.parametrize("name", ["corrupt-image", "drop-image"])
def test_a_corrupt_image_costs_its_frame_and_is_reported(
    served: Served, http: httpx.Client, name: str
) -> None:
    with streaming(served.stream_url) as client:
        client.subscribe("flags")
        client.frame()
        fault(http, name)
        notice = client.notice("lost-images")
        following = [client.frame() for _ in range(2)]

    assert notice.details["count"] >= 1
    numbers = [frame.meta["frame"] for frame in following]
    assert min(numbers) >= notice.details["frame"]
    assert http.get("/readyz").status_code == 200
    counters = http.get("/api/v1/camera").json()["counters"]
    assert counters["corrupt"] + counters["lost"] >= 1


def test_the_frame_after_a_lost_image_says_so_in_its_meta(
    served: Served, http: httpx.Client
) -> None:
    with streaming(served.stream_url) as client:
        client.subscribe("flags")
        client.frame()
        lost: list[int] = []
        while not any(lost) and len(lost) < 50:
            fault(http, "corrupt-image")  # again: a busy machine may drop the frame that says so
            lost.append(client.frame().meta["lost_images"])

    assert lost[-1] >= 1


def test_an_unplugged_camera_is_reported_and_comes_back_by_itself(
    served: Served, http: httpx.Client
) -> None:
    with streaming(served.stream_url) as client:
        client.subscribe("range")
        before = client.frame().meta["frame"]

        fault(http, "unplug")
        lost = client.notice("camera-lost")
        not_ready = http.get("/readyz")
        refused = http.put("/api/v1/sequence", json={"harmonics": 4})
        alive = http.get("/livez")
        last = http.get(LATEST)

        fault(http, "replug")
        client.notice("camera-back")
        after = client.frame().meta["frame"]

    assert lost.details["reason"]
    assert not_ready.status_code == 503
    assert not_ready.json()["type"] == "/problems/not-ready"
    assert any("lost" in reason for reason in not_ready.json()["reasons"])
    assert (refused.status_code, refused.json()["type"]) == (503, "/problems/camera-lost")
    assert alive.status_code == 200
    assert last.status_code == 200
    assert after > before
    assert http.get("/readyz").status_code == 200


def test_the_sequence_survives_an_unplug(served: Served, http: httpx.Client) -> None:
    wanted = {"harmonics": 2, "zeroth": "on-off", "exposure_s": 0.001}
    http.put("/api/v1/sequence", json=wanted)
    with streaming(served.stream_url) as client:
        client.subscribe("moments")
        client.frame()
        fault(http, "unplug")
        client.notice("camera-lost")
        fault(http, "replug")
        client.notice("camera-back")
        frame = client.frame()

    assert frame.array.shape[0] == 3
    assert frame.meta["zeroth"] == "on-off"
    document = http.get("/api/v1/sequence").json()
    assert {key: document[key] for key in wanted} == wanted
    assert document["sequence_id"] == frame.meta["sequence_id"]


def test_an_unplug_is_noticed_while_nothing_is_captured(served: Served, http: httpx.Client) -> None:
    http.put("/api/v1/acquisition", json={"running": False})
    fault(http, "unplug")
    wait_until(lambda: http.get("/readyz").status_code == 503)

    fault(http, "replug")
    wait_until(lambda: http.get("/readyz").status_code == 200)

    document = http.get("/api/v1/acquisition").json()
    assert (document["running"], document["state"]) == (False, "stopped")


def _break(*_: Any) -> NoReturn:
    raise ZeroDivisionError("broken on purpose")


def test_a_product_that_fails_fails_alone(served: Served, http: httpx.Client) -> None:
    products = served.service.pipeline.products
    products["direct"] = replace(products["direct"], compute=_break)
    with streaming(served.stream_url) as client:
        client.subscribe("direct", "range")
        problem = client.error()
        frames = [client.frame() for _ in range(3)]

        response = http.get(f"{LATEST}/direct", params={"wait_s": 10.0})
        healthy = http.get(f"{LATEST}/range", params={"wait_s": 10.0})

    assert problem["type"] == "/problems/product-failed"
    assert problem["product"] == "direct"
    assert {frame.product for frame in frames} == {"range"}
    assert (response.status_code, response.json()["product"]) == (500, "direct")
    assert "purpose" not in response.text
    assert healthy.status_code == 200


def test_a_failing_product_is_reported_once_and_again_only_after_it_worked(served: Served) -> None:
    products = served.service.pipeline.products
    working = products["direct"]
    broken = replace(working, compute=_break)
    products["direct"] = broken
    with streaming(served.stream_url) as client:
        client.subscribe("direct", "flags")
        channels = served.service.hub.subscribers[0].channels
        kinds = [type(client.receive()) for _ in range(5)]
        channels[0].product = working
        client.receive_until(lambda m: isinstance(m, wire.Frame) and m.product == "direct")
        channels[0].product = broken
        client.error()

    assert kinds.count(wire.ErrorMessage) == 1


def test_a_stage_that_fails_takes_only_what_stands_on_it(
    served: Served, http: httpx.Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    # without a low frequency, whose phase says which returns are in which turn
    http.put("/api/v1/sequence", json={"zeroth": "estimated"}).raise_for_status()
    monkeypatch.setattr(tm.Reconstruction, "returns", property(_break))
    http.get(LATEST, params={"wait_s": 10.0})
    following = {"wait_s": 10.0, "after": http.get(LATEST).json()["frame"]}

    statuses = {
        name: http.get(f"{LATEST}/{name}", params=following).status_code
        for name in ("range", "direct", "uniform", "coefficients", "moments", "raw", "transient")
    }

    assert {name for name, status in statuses.items() if status == 500} == {
        "range",
        "direct",
        "uniform",
    }
    assert set(statuses.values()) == {200, 500}


def test_a_failing_report_of_a_frame_does_not_end_the_acquisition(served: Served) -> None:
    acquisition = served.service.acquisition
    report = acquisition._report
    failures = []

    def fail_once(event: Any) -> None:
        acquisition._report = report
        failures.append(event)
        raise ZeroDivisionError

    acquisition._report = fail_once
    wait_until(lambda: bool(failures))
    frames = acquisition.status().frames

    wait_until(lambda: acquisition.status().frames > frames)


def test_a_viewer_that_is_stuck_is_disconnected_after_a_while_and_all_others_stay() -> None:
    from tests.serving import serving

    with serving("sim:mirrors?noise=off", limits={"stalled_s": 0.2}) as daemon:
        hub = daemon.service.hub
        with (
            streaming(daemon.stream_url) as healthy,
            never_reading(daemon.stream_url, "raw", "coefficients"),
        ):
            healthy.subscribe("flags")
            wait_until(lambda: len(hub.subscribers) == 2)
            while hub.clients == 2:  # the healthy one has to read, or it would be stuck, too
                healthy.frame()
            numbers = [healthy.frame().meta["frame"] for _ in range(5)]

    assert numbers == sorted(set(numbers))
