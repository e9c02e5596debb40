"""What takes give where the sequence of a camera leaves nothing else to choose."""

from collections.abc import Sequence as Several
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

import transientcam_moments as tm
from transientcam_driver import Camera, Capabilities, RawFrame
from transientcam_moments.likelihood import MODEL_ERROR
from transientcam_server.imaging import Recipe, factory_gains
from transientcam_server.settings import ReconstructionSettings

TAKES: Final = (1, 2, 4, 8, 16)
_PIXELS: Final = 1000


@dataclass(frozen=True, slots=True)
class TakesPrediction:
    """What so many takes cost, and what they leave of the noise.

    ``takes``, ``capture_s``, ``frame_rate_hz``: Of the sequence.
    ``range_std_m``: Predicted standard deviation of the range in the median pixel.
    """

    takes: int
    capture_s: float
    frame_rate_hz: float
    range_std_m: float


def predict_takes(
    camera: Camera, sensor: tm.noise.Sensor, *, takes: Several[int] = TAKES, read_s: float
) -> list[TakesPrediction]:
    """Capture a frame of one take, and predict what more of them give.

    The deviation is that between frames: what calibration and light of no model leave in their
    moments (`tm.likelihood`'s ``model_error``) is weighed, as in frames, and does not scatter.

    ``camera``: Its sequence is set to one take; it does not stream afterwards.
    ``takes``: Those that the camera cannot do are left out.
    ``read_s``: How long the frame may take.
    Raises CameraError: The camera gives no frame.
    """
    capabilities, settings = camera.capabilities, ReconstructionSettings(neighbours="none")
    applied = camera.configure(replace(camera.applied.sequence, takes=1))
    camera.start()
    try:
        frame = camera.read_frame(timeout_s=read_s)
    finally:
        camera.stop()
    full_scale = float((1 << capabilities.bits) - 1)
    recipe = Recipe(applied, settings, full_scale, factory_gains(camera.factory), sensor=sensor)
    return takes_of(frame, recipe, capabilities, takes=takes)


def takes_of(
    frame: RawFrame, recipe: Recipe, capabilities: Capabilities, *, takes: Several[int] = TAKES
) -> list[TakesPrediction]:
    """Predict what takes give by a frame, which may have any number of them itself.

    ``recipe``: Of the frame; its sensor has to be known.
    ``takes``: Those that the camera cannot do are left out.
    """
    settings = recipe.settings.model_copy(update={"neighbours": "none"})
    found = replace(recipe, settings=settings).reconstruct(frame)
    assert found.noise is not None  # noqa: S101 - the sensor is known
    sequence, sampling = recipe.applied.sequence, recipe.applied.sequence.sampling
    moments = np.asarray(found.smoothed)
    harmonics = tuple(range(len(moments)))
    if not sampling.consecutive:
        known = () if sequence.zeroth == "estimated" else (0,)
        harmonics = (*known, *sampling.multiples)
        moments = moments[-len(harmonics) :]
    flat = moments.reshape((len(moments), -1))
    step = max(1, flat.shape[1] // _PIXELS)
    b = flat[:, step // 2 :: step]
    variance = np.broadcast_to(found.noise.variance[-len(moments) :], moments.shape)
    of_one = sequence.takes * variance.reshape(flat.shape)[:, step // 2 :: step]
    images = recipe.applied.images // sequence.takes
    predicted = []
    for count in takes:
        if count <= min(capabilities.max_takes, capabilities.max_images // images):
            more = capabilities.apply(replace(sequence, takes=count))
            noise = tm.noise.MomentNoise(of_one / count)
            fitted = tm.two_returns(b, noise, harmonics=harmonics, model_error=MODEL_ERROR)
            std_rad = fitted.direct_phase_std_rad(settings.return_threshold)
            std_rad = std_rad * tm.noise.scatter(b, noise, harmonics, MODEL_ERROR)
            median_m = float(np.nanmedian(tm.range_m(std_rad, sequence.base_frequency_hz)))
            predicted.append(TakesPrediction(count, more.capture_s, more.frame_rate_hz, median_m))
    return predicted
