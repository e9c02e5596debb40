"""The paper's figures, made by this software and checked against the paper's sentences.

One file a figure, each a `PaperFigure`: it captures on a `Bench` (the simulated camera), and
returns a picture, `Statement` by `Statement` what holds, and tables. `FIGURES` lists them.
"""

from typing import Final

from transientcam_experiments.paper import (
    figure02,
    figure03,
    figure05,
    figure06,
    figure07,
    figure08,
    figure09,
    figure10,
    figure11,
    figure12,
    figure13,
    figure14,
    figure15,
)
from transientcam_experiments.paper.bench import Bench
from transientcam_experiments.paper.figure import FigureResult, PaperFigure, Statement, Table

_TO_10: Final = (figure02, figure03, figure05, figure06, figure07, figure08, figure09, figure10)
_MODULES: Final = (*_TO_10, figure11, figure12, figure13, figure14, figure15)
FIGURES: Final[dict[int, PaperFigure]] = {each.FIGURE.number: each.FIGURE for each in _MODULES}
"""Every figure by its number."""
