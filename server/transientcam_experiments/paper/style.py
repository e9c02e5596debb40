"""The style of all pictures: one set of sizes, colours and labels."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from typing import Any, Final

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure, SubFigure
from numpy.typing import NDArray

_Array = NDArray[Any]
TRUTH: Final = "#0072B2"
"""Of the truth; colours are Okabe and Ito's, which colour-blind people can distinguish."""
OURS: Final = "#D55E00"
OTHER: Final = "#009E73"
FOURTH: Final = "#CC79A7"
NOISY: Final = "0.65"
LIGHT: Final = "inferno"
"""Of brightness."""
DEPTH: Final = "viridis"
"""Of ranges and times."""
SIGNED: Final = "PuOr"
"""Of what may be negative."""
_STYLE: Final = Path(__file__).with_name("paper.mplstyle")
_DPI = 110


@contextmanager
def new(width_in: float, height_in: float) -> Iterator[Figure]:
    """Give an empty picture that needs no display, and what is drawn inside its looks."""
    with rc_context(fname=_STYLE):
        picture = Figure(figsize=(width_in, height_in), layout="constrained")
        FigureCanvasAgg(picture)
        yield picture


def png(picture: Figure) -> bytes:
    """Return a picture as bytes; the same picture gives the same."""
    file = BytesIO()
    picture.savefig(file, format="png", dpi=_DPI, metadata={"Software": None})
    return file.getvalue()


def show(
    axes: Axes,
    image: _Array,
    title: str,
    *,
    colours: str = LIGHT,
    least: float | None = 0.0,
    most: float | None = None,
) -> None:
    """Draw an image without ticks; ``most`` is its 99th percentile when left out."""
    finite = image[np.isfinite(image)]
    if most is None:
        most = max(float(np.percentile(finite, 99)), 1e-30) if finite.size else 1.0
    axes.imshow(image, cmap=colours, vmin=least, vmax=most)
    axes.set_title(title)
    bare(axes)


def bare(axes: Axes) -> None:
    """Take ticks, grid and frame away."""
    axes.set(xticks=[], yticks=[])
    axes.grid(visible=False)
    for spine in axes.spines.values():
        spine.set_visible(False)


def scale(picture: Figure | SubFigure, axes: Axes | Sequence[Axes], label: str) -> None:
    """Put a colour bar beside panels: that of the image in the last one."""
    last = axes if isinstance(axes, Axes) else axes[-1]
    bar = picture.colorbar(last.images[0], ax=axes, shrink=0.85, pad=0.02)
    bar.set_label(label)
    bar.outline.set_visible(False)
