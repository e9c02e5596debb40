"""The description of a pixel: what it holds where moments give no density."""

import csv
import io
import math
from dataclasses import replace

import numpy as np
import pytest

from tests.driver.cameras.triggered.scripted import CAPABILITIES
from transientcam_driver import AppliedSequence, RawFrame, Sampling
from transientcam_server.imaging import Recipe, pixel_csv
from transientcam_server.imaging._products.pixel import describe_pixel
from transientcam_server.settings import ReconstructionSettings

THREE = tuple(2 * math.pi * k / 3 for k in range(3))
GAPPED = replace(
    CAPABILITIES, sampling=Sampling((2, 10, 15), THREE), max_frequency_hz=120e6, max_harmonics=3
)
RANGES_M = np.array([1.5, 2.7])
LIGHT = np.array([800.0, 400.0])


def frame_of(applied: AppliedSequence) -> RawFrame:
    """Return the images of two returns, the same in all pixels."""
    images = np.empty((len(applied.labels), GAPPED.height, GAPPED.width), np.uint16)
    for image, label in zip(images, applied.labels, strict=True):
        phase_rad = 4 * np.pi * label.frequency_hz * RANGES_M / 299_792_458.0
        dn = 2048 + (LIGHT / 2 * np.cos(phase_rad - label.phase_rad)).sum()
        image[:] = round(dn)
    return RawFrame(
        number=0,
        epoch=applied.epoch,
        images=images,
        labels=applied.labels,
        device_time_s=0.0,
        host_time_s=0.0,
        capture_s=0.1,
        temperature_c=25.0,
        lost_images=0,
    )


def test_a_pixel_of_frequencies_with_gaps_has_its_returns_and_no_density() -> None:
    applied = GAPPED.apply(GAPPED.sequence_of({"base_frequency_hz": 8e6}))
    recipe = Recipe(applied, ReconstructionSettings(estimator="two-returns"), 4095.0)
    image = recipe.reconstruct(frame_of(applied))

    found = describe_pixel(recipe, image, None, 2, 1, 64)

    assert found["range_m"] == pytest.approx(RANGES_M[0], abs=5e-3)
    assert found["direct"] / found["indirect"] == pytest.approx(2.0, rel=0.05)
    times_s = [each["time_s"] for each in found["returns"]]
    assert times_s == pytest.approx(2 * RANGES_M / 299_792_458.0, rel=5e-3)
    assert len(found["moments"]) == 4
    assert (found["validity"], found["flags"]) == (None, [])
    bounds = found["bounds"]
    curves = [found[name] for name in ("time_s", "density_per_s", "cumulative")]
    assert [*curves, bounds["lower_per_s"], bounds["upper_per_s"]] == [[]] * 5
    rows = list(csv.reader(io.StringIO(pixel_csv(recipe, image, {}, None, 2, 1, 64).decode())))
    assert rows == [["time_s", "density_per_s", "cumulative", "lower_per_s", "upper_per_s"]]
