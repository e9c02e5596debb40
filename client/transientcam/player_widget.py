"""Light in flight as an anywidget; needs anywidget, and the built module of the dashboard."""

from collections.abc import Callable
from pathlib import Path
from typing import Any, Final, NamedTuple

import anywidget
import numpy as np
import traitlets
from numpy.typing import NDArray

from transientcam.camera import Camera
from transientcam.errors import ParameterError, TransientcamError
from transientcam.frame import Frame

MODULE: Final = Path(__file__).parent / "static" / "player.js"
"""Built with the dashboard, from the same sources: ``make dashboard``."""
_WAIT_S: Final = 10.0
_SOURCES: Final = "a Camera, an open recording, or coefficients with their base_frequency_hz"
_PRODUCT: Final = "coefficients"


class TransientPlanes(NamedTuple):
    """What is shown: planes float32 (2m + 1, H, W) as `density` takes them."""

    planes: NDArray[np.float32]
    base_frequency_hz: float
    frame: int


class PlayerWidget(anywidget.AnyWidget):
    """One frame of coefficients at a time, and what its page asks for; made by `player`.

    ``time_s``: time of flight that is shown, in s; setting it shows another one.
    ``index``: of the frame of a recording, from 0.
    ``problem``: why no newer frame came; empty where one did.
    """

    _esm = MODULE
    coefficients = traitlets.Bytes().tag(sync=True)
    shape = traitlets.Dict().tag(sync=True)
    count = traitlets.Int().tag(sync=True)
    index = traitlets.Int().tag(sync=True)
    rate_hz = traitlets.Float().tag(sync=True)
    time_s = traitlets.Float().tag(sync=True)
    problem = traitlets.Unicode().tag(sync=True)
    wanted = traitlets.Int().tag(sync=True)
    """Counted up by the page with each frame that it asks for."""
    answered = traitlets.Int().tag(sync=True)
    """The last one that was answered; set after all else."""

    def __init__(
        self, source: Any, *, base_frequency_hz: float | None, rate_hz: float, time_s: float
    ) -> None:
        if rate_hz < 0.0:
            raise ParameterError("rate_hz", rate_hz, "from 0")
        self._shown_at, count = _reader_of(source, base_frequency_hz)
        state = _state_of(self._shown_at(0))
        live = isinstance(source, Camera)
        super().__init__(**state, count=count, rate_hz=rate_hz if live else 0.0, time_s=time_s)
        self.observe(self._answer, "wanted")

    def _answer(self, _change: object) -> None:
        try:
            state = {**_state_of(self._shown_at(self.index)), "problem": ""}
        except TransientcamError as error:
            state = {"problem": str(error)}
        with self.hold_sync():  # one message
            for name, value in state.items():
                setattr(self, name, value)
            self.answered = self.wanted


def _reader_of(
    source: Any, base_frequency_hz: float | None
) -> tuple[Callable[[int], TransientPlanes], int]:
    """Return what gives a frame by its index, and how many can be chosen from."""
    if isinstance(source, Camera):
        return lambda index: _of_frame(source.frame(_PRODUCT, wait_s=_WAIT_S)), 0
    if isinstance(source, Frame):
        shown = _of_frame(source)
        return lambda index: shown, 0
    if hasattr(source, "to_xarray") and hasattr(source, "frames"):
        if not len(source):
            raise ParameterError("source", "a recording without frames", _SOURCES)
        return lambda index: _of_frame(source[index].product(_PRODUCT)), len(source)
    if base_frequency_hz is None:
        raise ParameterError("source", type(source).__name__, _SOURCES)
    planes = np.asarray(_planes_of(source), dtype="<f4")
    if planes.ndim != 3 or planes.shape[0] % 2 == 0:
        raise ParameterError("source", planes.shape, "of shape (2m + 1, H, W)")
    return lambda index: TransientPlanes(planes, base_frequency_hz, 0), 0


def _planes_of(coefficients: Any) -> Any:
    """Return real planes of coefficients, also of those that `transientcam_moments` has."""
    if not hasattr(coefficients, "polynomial"):
        return coefficients
    a = coefficients.polynomial[1:]
    pairs = np.stack([a.real, a.imag], axis=1).reshape(-1, *a.shape[1:])
    return np.concatenate([coefficients.error[np.newaxis], pairs])


def _of_frame(frame: Frame) -> TransientPlanes:
    if frame.product != _PRODUCT:
        raise ParameterError("product", frame.product, _PRODUCT)
    return TransientPlanes(frame.array, frame.meta["base_frequency_hz"], frame.frame)


def _state_of(shown: TransientPlanes) -> dict[str, Any]:
    planes, height, width = shown.planes.shape
    return {
        "coefficients": np.ascontiguousarray(shown.planes, dtype="<f4").tobytes(),
        "shape": {
            "frame": shown.frame,
            "harmonics": planes // 2,
            "width": width,
            "height": height,
            "base_frequency_hz": shown.base_frequency_hz,
        },
    }
