"""Scrub through light in a cell of a notebook."""

from typing import TYPE_CHECKING

from numpy.typing import ArrayLike

from transientcam.camera import Camera
from transientcam.errors import MissingExtra
from transientcam.frame import Frame
from transientcam.opening import Recording

if TYPE_CHECKING:
    from transientcam.player_widget import PlayerWidget


def player(
    source: Camera | Recording | Frame | ArrayLike,
    *,
    base_frequency_hz: float | None = None,
    rate_hz: float = 5.0,
    time_s: float = 0.0,
) -> "PlayerWidget":
    """Return light in flight as a widget for Jupyter, marimo and other hosts of anywidget.

    ::

        transientcam.player(camera)  # live
        transientcam.player(transientcam.open("corner.h5"))

    The density (Eq. 2) is evaluated in the browser, so that playing and scrubbing need no kernel.

    Parameters
    ----------
    source
        A camera, whose newest frame is shown again and again; an open recording, with a slider for
        its frames; a frame of the product ``coefficients``, an array of the same planes
        (2m + 1, H, W), or the coefficients that ``transientcam_moments.levinson`` returns.
    base_frequency_hz
        Of coefficients that are no frame.
    rate_hz
        No more frames a second than this are asked of a camera; 0 shows the newest one and stays.
    time_s
        Time of flight that is shown first; attribute `time_s` of the widget is where it is left.

    Raises
    ------
    MissingExtra
        If anywidget is not installed.
    ParameterError
        If the source is none of these, or another product, or has no frame.
    ServerUnreachable, ProblemError
        If a camera does not give a frame.
    """
    try:
        from transientcam.player_widget import PlayerWidget
    except ModuleNotFoundError as error:
        raise MissingExtra("transientcam.player", error.name or "a package", "notebook") from error
    return PlayerWidget(source, base_frequency_hz=base_frequency_hz, rate_hz=rate_hz, time_s=time_s)
