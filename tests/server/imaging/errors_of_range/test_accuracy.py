"""Noise and bias that a frame knows of its own range, held against captures and the truth."""

from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import transientcam_moments as tm
from transientcam.wire import Trust
from transientcam_driver import RawFrame, Sequence, open_camera
from transientcam_driver.clock import VirtualClock
from transientcam_server.camera import sensor_of
from transientcam_server.imaging import Recipe
from transientcam_server.imaging._errors_of_range.accuracy import (
    RangeAccuracy,
    range_accuracy,
    spacing_px,
)
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
def test_the_noise_of_one_frame_is_that_of_many_and_intervals_hold_the_truth(
    name: str, estimator: str
) -> None:
    scene = captured(name, 4, CAPTURES)
    recipe, found = scene.by(estimator)

    accuracy = range_accuracy(recipe, found[0])
    document = accuracy.to_document()

    ranges_m = np.stack([np.asarray(each.range_m) for each in found]).astype(float)
    known = np.isfinite(scene.true_m) & np.isfinite(ranges_m).all(axis=0)
    scatter_m = float(np.median(ranges_m[:, known].std(axis=0, ddof=1)))
    assert document["range_std_m"] is not None
    # noise is drawn around what is noisy already, which errs on the safe side
    assert 0.85 < document["range_std_m"] / scatter_m < 1.5
    off_m = np.abs(ranges_m[0] - scene.true_m)
    assert document["range_error_m"] is not None
    if name == "translucent":  # light that the material delays looks like that of a farther one
        assert (off_m <= accuracy.error_m)[known].mean() > 0.6
        return
    trusted = (accuracy.trust == Trust.TRUSTED) & known
    if trusted.any():
        assert (off_m <= accuracy.error_m)[trusted].mean() > 0.9
        # with what later light may hide in any frame
        assert np.median(accuracy.error_m[trusted]) < 6e-3 + 4 * np.median(off_m[trusted])
    wrong = known & (off_m > 3 * accuracy.error_m)
    assert wrong.mean() < 0.03  # of which Pisarenko throws some far off


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
    assert document["range_bias_m"] is document["range_error_m"] is document["within_m"] is None
    assert document["trusted_share"] == 0.0
    assert document["trust"]["later_light_unresolved"] > 0


def test_one_pixel_in_sixteen_stands_for_those_around_it() -> None:
    scene = captured("mirrors", 4, CAPTURES)
    recipe, found = scene.by("pisarenko")
    whole = range_accuracy(recipe, found[0])

    sparse = range_accuracy(recipe, found[0], 4)

    np.testing.assert_array_equal(np.isnan(sparse.std_m), np.isnan(whole.std_m))
    blocks = sparse.std_m.reshape(15, 4, 15, 4)
    assert (blocks == blocks[:, :1, :, :1]).all()
    one, other = whole.to_document(), sparse.to_document()
    assert (one["every_px"], other["every_px"]) == (1, 4)
    for name in ("range_error_m", "range_std_m"):
        assert other[name] == pytest.approx(one[name], rel=0.25)
    # pixels further apart share less averaged noise, whose rest their median takes for bias
    assert other["range_bias_m"] == pytest.approx(one["range_bias_m"], rel=0.6)


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


def test_the_document_states_shares_and_the_median_pixel_with_a_range() -> None:
    std_m = np.array([[3.0, 6.0, 1.0, np.nan]])
    bias_m = np.array([[4.0, 8.0, 2.0, np.nan]])
    error_m = np.array([[5.0, 10.0, 99.0, np.nan]])
    trust = np.array([[0, 0, Trust.EDGE, Trust.NO_RANGE]], dtype=np.uint8)

    document = RangeAccuracy(std_m, bias_m, error_m, trust).to_document()

    counts = document["trust"]
    assert {name: count for name, count in counts.items() if count} == {
        "trusted": 2,
        "edge": 1,
        "no_range": 1,
    }
    assert {name: value for name, value in document.items() if name != "trust"} == {
        "trusted_share": 0.5,
        "within_m": 9.5,
        "range_error_m": 10.0,
        "range_std_m": 3.0,
        "range_bias_m": 4.0,
        "every_px": 1,
        "not_judged": [],
    }
