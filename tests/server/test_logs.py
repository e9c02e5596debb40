import asyncio
import io
import json
import logging
from collections.abc import Iterator

import pytest
from websockets.exceptions import ConnectionClosedError, InvalidStatus
from websockets.sync.client import connect
from websockets.typing import Origin, Subprotocol

from tests.serving import serving
from transientcam import wire
from transientcam_server import logs


@pytest.fixture(autouse=True)
def root_as_it_was() -> Iterator[None]:
    root = logging.getLogger()
    handlers, level = list(root.handlers), root.level
    yield
    root.handlers[:] = handlers
    root.setLevel(level)


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def lines(stream: io.StringIO) -> list[str]:
    return stream.getvalue().splitlines()


def test_elsewhere_than_on_a_terminal_each_line_is_json() -> None:
    stream = io.StringIO()
    logs.configure(level="info", form="auto", stream=stream)

    logging.getLogger("a.b").info("%d frames\nlost", 3, extra={"camera": "x"})

    (line,) = lines(stream)
    document = json.loads(line)
    assert document["message"] == "3 frames\nlost"
    assert (document["level"], document["logger"], document["camera"]) == ("INFO", "a.b", "x")
    assert document["time"].endswith("+00:00")
    assert "request_id" not in document


def test_on_a_terminal_lines_are_for_eyes() -> None:
    stream = Terminal()
    logs.configure(level="info", form="auto", stream=stream)

    logging.getLogger("a").warning("look")

    assert lines(stream)[0].endswith("WARNING a: look")


@pytest.mark.parametrize("form", ["text", "json"])
def test_a_form_that_was_chosen_is_taken(form: logs.LogFormat) -> None:
    stream = Terminal() if form == "json" else io.StringIO()
    logs.configure(level="info", form=form, stream=stream)

    logging.getLogger("a").info("x")

    assert lines(stream)[0].startswith("{") == (form == "json")


def test_an_exception_is_one_line_too() -> None:
    stream = io.StringIO()
    logs.configure(level="info", form="json", stream=stream)

    try:
        _ = 1 / 0
    except ZeroDivisionError:
        logging.getLogger("a").exception("failed")

    (line,) = lines(stream)
    assert "ZeroDivisionError" in json.loads(line)["exception"]


def test_each_line_names_the_request_it_is_about() -> None:
    stream = io.StringIO()
    logs.configure(level="info", form="json", stream=stream)

    async def answer(identifier: str) -> None:
        logs.request_id.set(identifier)
        await asyncio.sleep(0)
        logging.getLogger("a").info(identifier)

    async def both() -> None:
        await asyncio.gather(answer("first"), answer("second"))

    asyncio.run(both())

    documents = [json.loads(line) for line in lines(stream)]
    assert [each["request_id"] for each in documents] == [each["message"] for each in documents]


def test_libraries_that_log_headers_stay_quiet_at_debug() -> None:
    stream = io.StringIO()
    logs.configure(level="debug", form="json", stream=stream)

    logging.getLogger("websockets.server").debug("< Authorization: Bearer secret")
    logging.getLogger("transientcam_server").debug("ours")

    assert "secret" not in stream.getvalue()
    assert "ours" in stream.getvalue()


def test_requests_of_a_relay_to_its_origin_are_logged_only_where_they_go_wrong() -> None:
    stream = io.StringIO()
    logs.configure(level="info", form="text", stream=stream)

    logging.getLogger("httpx").info("HTTP Request: GET http://lab:8000/api/v1/camera")
    logging.getLogger("httpx").warning("what is wrong")

    (line,) = lines(stream)
    assert line.endswith("what is wrong")


def test_what_clients_do_wrong_is_no_error_of_the_service() -> None:
    stream = io.StringIO()
    with serving("sim:wall?noise=off") as daemon:
        logs.configure(level="info", form="json", stream=stream)
        subprotocols = [Subprotocol(wire.SUBPROTOCOL)]
        with connect(daemon.stream_url, subprotocols=subprotocols) as client:
            client.send(b"\xff\xfe", text=True)
            with pytest.raises(ConnectionClosedError):
                client.recv()
        with (
            pytest.raises(InvalidStatus),
            connect(
                daemon.stream_url,
                subprotocols=subprotocols,
                origin=Origin("https://elsewhere.example"),
            ),
        ):
            pass

    documents = [json.loads(line) for line in lines(stream)]
    reported = [each for each in documents if each["message"] in logs._CLIENT_MISTAKES]
    assert [each["level"] for each in reported] == ["INFO", "INFO"]
    assert not any("exception" in each for each in documents)
    assert all(each["level"] in ("INFO", "WARNING") for each in documents)
