"""What a frame of the default estimator says of its noise, against the scatter of many frames."""

from dataclasses import dataclass

import numpy as np

from benchmarks.accuracy.capturing import SEED, captured, short
from benchmarks.accuracy.noise import NOISE
from transientcam_driver import open_camera
from transientcam_driver.clock import VirtualClock
from transientcam_experiments.tradeoff.measuring import spec_of
from transientcam_server.imaging import typical_deviation
from transientcam_server.imaging._errors_of_range.accuracy import range_accuracy
from transientcam_server.imaging._errors_of_range.noise import range_noise

SCENES = ("wall", "corner", "mirrors")
FRAMES = 40


@dataclass(frozen=True)
class Stated:
    """Deviations of the range in m, of the median pixel with a range in all frames.

    Attributes
    ----------
    product_m
        By the product ``range_std`` of one frame.
    metadata_m
        By ``predicted_range_std_m`` of its metadata.
    observed_m
        The typical difference of two frames, as a deviation.
    """

    scene: str
    sequence: str
    product_m: float
    metadata_m: float
    observed_m: float


def stated_and_observed() -> list[Stated]:
    """Compare them on scenes with one, with diffuse and with several returns."""
    stated = []
    for scene in SCENES:
        with open_camera(spec_of(scene, seed=SEED), clock=VirtualClock()) as camera:
            for sequence in NOISE:
                recipe, found = captured(camera, sequence, FRAMES)
                ranges = np.stack([np.asarray(each.range_m, dtype=float) for each in found])
                std_m = range_accuracy(recipe, found[0]).std_m
                known = np.isfinite(ranges).all(axis=0) & np.isfinite(std_m)
                predicted = range_noise(recipe, found[0])
                stated.append(
                    Stated(
                        scene,
                        short(sequence),
                        float(np.median(std_m[known])),
                        np.nan if predicted is None else predicted["median"],
                        float(np.median(typical_deviation(ranges[:, known]))),
                    )
                )
    return stated
