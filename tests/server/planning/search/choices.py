"""Choices of which a test states the errors and the time."""

import dataclasses
import math

import numpy as np

from transientcam_driver import Capabilities, Sequence
from transientcam_server.planning._prediction.measures import Figure
from transientcam_server.planning._prediction.prediction import Prediction
from transientcam_server.planning._search.search import Choice


def figure(median_m: float, margin: float = 1.25) -> Figure:
    return Figure(median_m, median_m / 2, 2 * median_m, 3 * median_m, margin * median_m)


def choice(
    capabilities: Capabilities,
    *,
    std_m: float = 3e-3,
    bias_m: float = 4e-3,
    harmonics: int = 3,
    takes: int = 1,
    capture_s: float | None = None,
    bias_known: bool = True,
    reconstruct_s: float | None = 0.01,
    bound_width: float | None = None,
    separation_share: float | None = None,
    within_m: float | None = None,
) -> Choice:
    """A choice of these errors; its capture takes what the camera needs, or what is stated."""
    sequence = Sequence(base_frequency_hz=20e6, harmonics=harmonics, exposure_s=1e-3, takes=takes)
    applied = capabilities.apply(sequence)
    if capture_s is not None:
        applied = dataclasses.replace(applied, capture_s=capture_s, frame_rate_hz=1 / capture_s)
    error_m = math.hypot(std_m, bias_m)
    predicted = Prediction(
        range_std=figure(std_m),
        range_error=figure(error_m),
        range_bias_m=bias_m,
        most_bias_m=2 * bias_m,
        bias_known=bias_known,
        off_m=tuple(np.linspace(0.0, 0.1, 201)),
        within=None if within_m is None else figure(within_m),
    )
    return Choice(
        applied,
        "likelihood",
        predicted,
        beyond_scene=False,
        timed=lambda: reconstruct_s,
        bound_width=bound_width,
        separation_share=separation_share,
        settling_s=0.5e-3,
        share=None if within_m is None else 0.75,
        target_m=0.08,
    )
