"""What CONTRIBUTING says of products, formats and encodings: one entry, and all else follows."""

import ast
import subprocess
import sys
from collections.abc import Iterator

import httpx
import numpy as np
import pytest

from tests.server.extensions import DIRECT_SHARE, EIGHT_BITS
from transientcam import Camera, wire


@pytest.fixture(scope="module")
def url() -> Iterator[str]:
    """Address of a daemon with the extensions, in a process of its own."""
    command = [sys.executable, "-m", "tests.server.extended"]
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        address = process.stdout.readline().strip()
        assert address.startswith("http"), "the daemon ended before it served"
        yield address
        process.communicate()
    assert process.returncode == 0


@pytest.fixture(autouse=True)
def extended_client(monkeypatch: pytest.MonkeyPatch) -> None:
    """The client of this process has the entry of the encoding, too."""
    monkeypatch.setitem(wire.ENCODINGS, EIGHT_BITS.name, EIGHT_BITS)


def test_a_product_is_answered_over_rest_in_every_format_that_fits(url: str) -> None:
    with Camera(url) as camera:
        frame = camera.frame("direct_share", wait_s=10.0)
        number = frame.frame
    answer = httpx.get(f"{url}/api/v1/frames/{number}/direct_share.npy")

    assert (frame.unit, frame.axes, frame.array.dtype.str) == ("1", ("y", "x"), "<f4")
    assert 0.9 < np.nanmedian(frame.array) <= 1.0  # a wall has no second return
    assert answer.headers["transientcam-unit"] == "1"


def test_a_format_is_a_suffix_and_a_media_type(url: str) -> None:
    latest = f"{url}/api/v1/frames/latest/direct_share"
    by_suffix = httpx.get(f"{latest}.txt", params={"region": "0,0,2,1"})
    by_accept = httpx.get(latest, params={"region": "0,0,2,1"}, headers={"accept": "text/plain"})

    for answer in (by_suffix, by_accept):
        assert answer.headers["content-type"].startswith("text/plain")
        assert np.array(ast.literal_eval(answer.text)).shape == (1, 2)


def test_both_are_streamed_and_decoded(url: str) -> None:
    subscriptions = [
        wire.Subscription("direct_share"),
        wire.Subscription("direct_share", encoding="u8"),
    ]
    with Camera(url) as camera, camera.stream(*subscriptions) as stream:
        plain = stream.receive()
        coded = next(each for each in stream if each.channel != plain.channel)

    assert {plain.product, coded.product} == {"direct_share"}
    np.testing.assert_allclose(coded.array, plain.array, atol=2.0 / 255.0)


def test_info_and_both_descriptions_of_the_interface_list_them(url: str) -> None:
    info = httpx.get(f"{url}/api/v1/info").json()
    openapi = httpx.get(f"{url}/openapi.json").json()
    schemas = httpx.get(f"{url}/asyncapi.json").json()["components"]["schemas"]

    (listed,) = (each for each in info["products"] if each["name"] == "direct_share")
    assert listed["summary"] == DIRECT_SHARE.summary
    assert "txt" in listed["formats"]
    assert "u8" in info["stream"]["encodings"]
    operation = openapi["paths"]["/api/v1/frames/{frame}/{product}"]["get"]
    assert "text/plain" in operation["responses"]["200"]["content"]
    (product,) = (each for each in operation["parameters"] if each["name"] == "product")
    assert "`direct_share`" in product["description"]
    assert "`.txt`" in product["description"]
    subscription = schemas["subscription"]["properties"]
    assert "direct_share" in subscription["product"]["enum"]
    assert "u8" in subscription["encoding"]["oneOf"][0]["enum"]
    assert schemas["frame"]["properties"]["most"]["type"] == "number"
