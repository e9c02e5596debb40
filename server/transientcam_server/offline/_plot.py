"""A picture of a reconstruction; needs the extra ``plot``."""

from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from transientcam_server.errors import MissingExtra
from transientcam_server.offline._measurement import TransientCube

_FRAMES: Final = 6


def require(what: str) -> None:
    """Check that ``what`` can make pictures, before the hours that it may take.

    Raises MissingExtra if matplotlib is not installed.
    """
    try:
        import matplotlib  # noqa: F401 - only whether it is there
    except ModuleNotFoundError as error:
        raise MissingExtra(what, "matplotlib", "plot") from error


def save_picture(path: Path, cube: TransientCube) -> None:
    """Draw range, indirect light and the light in flight at six times; one pixel as curves."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(12.0, 7.0), layout="constrained")
    FigureCanvasAgg(figure)  # draws without a display
    if cube.range_m.size == 1:
        _draw_pixel(figure, cube)
    else:
        _draw_images(figure, cube)
    figure.savefig(path, dpi=120, format="png")


def _draw_pixel(figure: Any, cube: TransientCube) -> None:
    upper, lower = figure.subplots(2, 1, sharex=True)
    time_ns = cube.time_s * 1e9
    upper.plot(time_ns, cube.density[:, 0, 0])
    upper.set_ylabel("density per s")
    lower.plot(time_ns, cube.cumulative[:, 0, 0])
    lower.set_ylabel("cumulative")
    lower.set_xlabel("time of flight / ns")
    for axes in (upper, lower):
        axes.grid(alpha=0.3)


def _draw_images(figure: Any, cube: TransientCube) -> None:
    axes = figure.subplots(2, 1 + _FRAMES // 2)
    images = (("range / m", cube.range_m, "viridis"), ("indirect", cube.indirect, "magma"))
    for panel, (title, image, colours) in zip(axes[:, 0], images, strict=True):
        drawn = panel.imshow(image, cmap=colours)
        panel.set_title(title)
        figure.colorbar(drawn, ax=panel, shrink=0.7)
    for panel, index in zip(axes[:, 1:].flat, _moments_of_flight(cube), strict=True):
        frame = cube.density[index]
        # each frame by itself: light that just arrives outshines what lingers by far
        panel.imshow(frame, cmap="magma", vmin=0.0, vmax=max(np.nanpercentile(frame, 99), 1e-30))
        panel.set_title(f"{cube.time_s[index] * 1e9:.2f} ns")
    for panel in axes.flat:
        panel.set_xticks([])
        panel.set_yticks([])


def _moments_of_flight(cube: TransientCube) -> NDArray[np.intp]:
    """Return indices of times spread evenly over the light that arrives."""
    total = cube.density.sum(axis=0)
    with np.errstate(all="ignore"):  # pixels without light count for nothing
        # each pixel counts alike, so that a bright lamp does not decide
        arriving = np.nan_to_num(cube.density / total).sum(axis=(1, 2))
    share = np.cumsum(arriving) / max(float(arriving.sum()), 1e-30)
    return np.searchsorted(share, (np.arange(_FRAMES) + 0.5) / _FRAMES)
