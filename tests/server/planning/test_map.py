"""Maps of the predicted error: neighbours share their noise, and a target has its colour."""

import io

import numpy as np
import pytest
from PIL import Image

from transientcam_server.planning import map_files
from transientcam_server.planning._planner import error_map


def test_noise_is_shared_by_neighbours_and_light_and_bias_are_each_pixels_own() -> None:
    random = np.random.default_rng(1)
    noise = np.ones((40, 60))
    noise[:, 30:] = 4.0
    bias_m = np.zeros_like(noise)
    bias_m[:20] = 0.3
    drawn = 0.01 * np.exp(0.3 * random.standard_normal(noise.shape))
    drawn[5, 5] = np.inf
    bias_m[6, 7] = np.nan

    found_m = error_map(drawn, bias_m, noise)

    assert np.isnan(found_m[[5, 6], [5, 7]]).all()
    assert np.isfinite(found_m).sum() == noise.size - 2
    below = found_m[20:] / noise[20:]
    assert np.median(below) == pytest.approx(0.01, rel=0.03)
    assert np.std(np.log(below)) < 0.3 / 2
    np.testing.assert_allclose(np.nanmedian(found_m[:20]), 0.3, rtol=0.02)


def test_files_hold_the_values_or_their_colours() -> None:
    error_m = np.array([[0.0, 0.02, 0.5], [np.nan, 0.01, 0.04]], np.float32)

    np.testing.assert_array_equal(np.load(io.BytesIO(map_files(error_m, 0.02)["npy"])), error_m)
    picture = Image.open(io.BytesIO(map_files(error_m, 0.02)["png"]))
    assert np.asarray(picture).tolist() == [[1, 128, 255], [0, 64, 255]]
    # without a target the worst of twenty is brightest
    free = np.asarray(Image.open(io.BytesIO(map_files(error_m, None)["png"])))
    assert (free[0, 2], free[1, 0]) == (255, 0)
    dark = np.full((2, 2), np.nan, np.float32)
    assert not np.asarray(Image.open(io.BytesIO(map_files(dark, None)["png"]))).any()
