"""What the player of notebooks is given, and what it answers; tests/browser has its page."""

from collections.abc import Iterator
from typing import Any

import httpx
import numpy as np
import pytest

import transientcam_moments as tm
from tests.client.conftest import frame_meta
from transientcam import (
    Camera,
    Frame,
    MissingExtra,
    ParameterError,
    density as client_density,
    player,
)

MOMENTS = np.array([2.0, 1.0 + 0.5j, 0.3 - 0.2j]).reshape(3, 1, 1) * np.ones((1, 2, 3))


def a_frame(product: str = "coefficients", number: int = 7) -> Frame:
    array = np.full((5, 2, 3), number, dtype=np.float32)
    meta = frame_meta(frame=number, base_frequency_hz=23e6)
    return Frame(product, "DN,1", ("coefficient", "y", "x"), meta, array)


def planes(widget: Any) -> Any:
    shape = widget.shape
    flat = np.frombuffer(widget.coefficients, "<f4")
    return flat.reshape(2 * shape["harmonics"] + 1, shape["height"], shape["width"])


def test_a_frame_is_shown_as_it_is() -> None:
    widget = player(a_frame(), time_s=3e-9)

    assert widget.shape == {
        "frame": 7,
        "harmonics": 2,
        "width": 3,
        "height": 2,
        "base_frequency_hz": 23e6,
    }
    np.testing.assert_array_equal(planes(widget), 7.0)
    assert (widget.time_s, widget.rate_hz, widget.count) == (3e-9, 0.0, 0)
    assert widget._esm  # the module was built


def test_coefficients_of_moments_have_the_density_of_the_mathematics() -> None:
    coefficients = tm.levinson(MOMENTS)
    phases_rad = np.linspace(0.0, 6.0, 7)

    widget = player(coefficients, base_frequency_hz=20e6)

    wanted = tm.density(coefficients, phases_rad)
    np.testing.assert_allclose(client_density(planes(widget), phases_rad), wanted, rtol=1e-5)
    assert widget.shape["base_frequency_hz"] == 20e6
    again = player(planes(widget), base_frequency_hz=20e6)
    assert again.coefficients == widget.coefficients


class Tape:
    """A recording of three frames, as far as the player needs one."""

    def __init__(self, count: int = 3) -> None:
        self.frames = self
        self._count = count

    def __len__(self) -> int:
        return self._count

    def __getitem__(self, index: int) -> Any:
        class One:
            def product(self, name: str) -> Frame:
                return a_frame(name, index + 1)

        return One()

    def to_xarray(self) -> None: ...


def test_the_page_of_a_recording_chooses_frames() -> None:
    widget = player(Tape())  # type: ignore[arg-type]  # only what is needed of one
    assert (widget.count, widget.shape["frame"]) == (3, 1)

    widget.set_state({"index": 2, "wanted": 1})

    assert (widget.shape["frame"], widget.answered) == (3, 1)
    np.testing.assert_array_equal(planes(widget), 3.0)


@pytest.fixture
def failing() -> Iterator[tuple[Camera, list[httpx.Response]]]:
    """A camera that gives the answers of a list, one after the other."""
    answers: list[httpx.Response] = []
    transport = httpx.MockTransport(lambda request: answers.pop(0))
    with Camera("http://failing", transport=transport) as camera:
        yield camera, answers


def test_a_camera_that_refuses_leaves_the_picture_and_says_why(
    failing: tuple[Camera, list[httpx.Response]], monkeypatch: pytest.MonkeyPatch
) -> None:
    camera, answers = failing
    refused = {"type": "/problems/camera-lost", "title": "unplugged", "status": 503}
    monkeypatch.setattr(Camera, "frame", lambda *_, **__: a_frame())
    widget = player(camera, rate_hz=2.0)
    monkeypatch.undo()
    answers.append(
        httpx.Response(503, json=refused, headers={"Content-Type": "application/problem+json"})
    )

    widget.set_state({"wanted": 1})

    assert (widget.problem, widget.answered) == ("unplugged (503)", 1)
    np.testing.assert_array_equal(planes(widget), 7.0)


@pytest.mark.parametrize(
    ("source", "options", "message"),
    [
        (a_frame("range"), {}, "product is 'range'"),
        (Tape(0), {}, "without frames"),
        ("corner.h5", {}, "base_frequency_hz"),
        (np.zeros((4, 2, 2)), {"base_frequency_hz": 1e6}, "2m \\+ 1"),
        (a_frame(), {"rate_hz": -1.0}, "rate_hz is -1"),
    ],
)
def test_what_cannot_be_shown_is_named(source: Any, options: Any, message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        player(source, **options)


def test_without_anywidget_the_remedy_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "transientcam.player_widget", None)

    with pytest.raises(MissingExtra, match=r"transientcam\[notebook\]"):
        player(a_frame())
