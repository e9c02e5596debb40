"""Noise and bias that a frame knows of its own range, held against captures and the truth."""

from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import transientcam_moments as tm
from transientcam_driver import RawFrame, Sequence, open_camera
from transientcam_driver.clock import VirtualClock
from transientcam_server.camera import sensor_of
from transientcam_server.imaging import Recipe
from transientcam_server.imaging._errors_of_range.accuracy import (
    RangeAccuracy,
    median_around,
    range_accuracy,
    spacing_px,
)
from transientcam_server.planning._prediction.measures import pixel_errors
from transientcam_server.settings import ReconstructionSettings, SensorSettings

CAPTURES = 8
PART = np.s_[..., 30:90, 50:110]
"""Of the picture, where all kinds of light are: what is computed of it is all that takes time."""
Array = NDArray[Any]


@dataclass(frozen=True)
class Captured:
    """Captures of a scene, and its truth."""

    recipe: Recipe
    frames: list[RawFrame]
    true_m: Array

    def by(self, estimator: str) -> tuple[Recipe, list[tm.Reconstruction]]:
        settings = ReconstructionSettings.model_validate({"estimator": estimator})
        recipe = Recipe(
            self.recipe.applied, settings, self.recipe.full_scale, sensor=self.recipe.sensor
        )
        return recipe, [recipe.reconstruct(raw) for raw in self.frames]


@cache
def captured(scene: str, harmonics: int, captures: int) -> Captured:
    with open_camera(f"sim:{scene}?seed=3", clock=VirtualClock()) as camera:
        assert camera.simulation is not None
        sequence = Sequence(harmonics=harmonics, zeroth="estimated", exposure_s=1.92e-3)
        applied = camera.configure(sequence)
        sensor = sensor_of(camera, SensorSettings())
        camera.start()
        frames = [camera.read_frame() for _ in range(captures)]
        parts = [replace(raw, images=raw.images[PART]) for raw in frames]
        recipe = Recipe(applied, ReconstructionSettings(), float(sensor.highest_dn), sensor=sensor)
        return Captured(recipe, parts, camera.simulation.truth().range_m[PART])


@pytest.mark.parametrize("estimator", ["pisarenko", "likelihood", "single-frequency"])
@pytest.mark.parametrize("name", ["wall", "mirrors", "translucent"])
def test_errors_of_one_frame_are_those_of_many_against_the_truth(name: str, estimator: str) -> None:
    scene = captured(name, 4, CAPTURES)
    recipe, found = scene.by(estimator)

    document = range_accuracy(recipe, found[0]).to_document()

    ranges_m = np.stack([np.asarray(each.range_m) for each in found]).astype(float)
    known = np.isfinite(scene.true_m) & np.isfinite(ranges_m).all(axis=0)
    errors = pixel_errors(ranges_m[:, known], scene.true_m[known])
    std_m, error_m = (float(np.median(each)) for each in (errors.std_m, errors.error_m))
    assert document["range_std_m"] is not None
    assert document["range_error_m"] is not None
    # noise is drawn around what is noisy already, which errs on the safe side
    assert 0.9 < document["range_std_m"] / std_m < 1.9
    assert 0.7 < document["range_error_m"] / error_m < 1.7
    if name != "translucent":  # whose few frequencies do not know how far some pixels are off
        assert document["outlier_share"] == pytest.approx(errors.outlier_share, abs=0.05)


def test_bias_that_more_captures_do_not_reduce_is_seen_pixel_by_pixel() -> None:
    """The phase of one frequency is off where a mirror sends light a second way."""
    scene = captured("mirrors", 4, CAPTURES)
    recipe, found = scene.by("single-frequency")

    accuracy = range_accuracy(recipe, found[0])

    off_m = np.abs(np.asarray(found[0].range_m) - scene.true_m)
    assert np.quantile(off_m, 0.9) > 3 * np.quantile(off_m, 0.1) > 0.3
    assert np.quantile(np.abs(accuracy.bias_m / off_m - 1), 0.8) < 0.15


@pytest.mark.parametrize("estimator", ["single-frequency", "automatic"])
def test_the_bias_of_one_frequency_is_not_known(estimator: str) -> None:
    scene = captured("wall", 1, 1)
    recipe, found = scene.by(estimator)

    accuracy = range_accuracy(recipe, found[0])

    assert np.isnan(accuracy.bias_m).all()
    assert np.isfinite(accuracy.std_m).any()
    document = accuracy.to_document()
    assert document["range_std_m"] is not None
    for name in ("range_bias_m", "range_error_m", "outlier_share"):
        assert document[name] is None


def test_one_pixel_in_sixteen_stands_for_those_around_it() -> None:
    scene = captured("mirrors", 4, CAPTURES)
    recipe, found = scene.by("pisarenko")
    whole = range_accuracy(recipe, found[0])

    sparse = range_accuracy(recipe, found[0], 4)

    np.testing.assert_array_equal(np.isnan(sparse.std_m), np.isnan(whole.std_m))
    blocks = sparse.error_m.reshape(15, 4, 15, 4)
    assert (blocks == blocks[:, :1, :, :1]).all()
    one, other = whole.to_document(), sparse.to_document()
    assert (one["every_px"], other["every_px"]) == (1, 4)
    for name in ("range_error_m", "range_std_m"):
        assert other[name] == pytest.approx(one[name], rel=0.25)
    # pixels further apart share no smoothed noise, whose rest their median takes for bias
    assert other["range_bias_m"] == pytest.approx(one["range_bias_m"], rel=0.5)


def test_all_pixels_are_predicted_as_soon_as_that_is_quick() -> None:
    scene = captured("mirrors", 4, CAPTURES)

    def spacing(estimator: str, *orders: int) -> tuple[int, list[int]]:
        asked: list[int] = []

        def ready(name: str, order: int) -> bool:
            assert name == "likelihood"
            asked.append(order)
            return order in orders

        return spacing_px(scene.by(estimator)[0], ready=ready), asked

    assert spacing("pisarenko") == (4, [4])
    assert spacing("pisarenko", 4) == (1, [4])
    assert spacing("likelihood", 4) == (4, [4, 3])
    assert spacing("likelihood", 4, 3) == (1, [4, 3])
    assert spacing("maximum-entropy", 4) == (4, [4])


def test_the_document_speaks_of_the_median_pixel_with_a_range() -> None:
    std_m = np.array([[3.0, 6.0, np.nan]])
    bias_m = np.array([[4.0, 8.0, np.nan]])

    accuracy = RangeAccuracy(std_m, bias_m, 0.25)

    np.testing.assert_allclose(accuracy.error_m, [[5.0, 10.0, np.nan]])
    assert accuracy.to_document() == {
        "range_error_m": 7.5,
        "range_std_m": 4.5,
        "range_bias_m": 6.0,
        "outlier_share": 0.25,
        "every_px": 1,
    }


def test_the_median_around_a_pixel_is_that_of_its_finite_neighbours() -> None:
    random = np.random.default_rng(1)
    plane = random.normal(size=(9, 11)).astype(np.float32)
    plane[random.random(plane.shape) < 0.4] = np.nan
    plane[:, 8:] = np.nan

    around = median_around(plane)

    for y in range(9):
        for x in range(11):
            window = plane[max(0, y - 2) : y + 3, max(0, x - 2) : x + 3]
            ranked = np.sort(window[np.isfinite(window)])
            expected = ranked[(ranked.size - 1) // 2] if ranked.size else 0.0
            assert around[y, x] == expected
