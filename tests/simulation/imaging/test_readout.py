"""Noise and quantisation in one compiled pass against the effects one by one: the same codes."""

from collections.abc import Iterator

import numpy as np
import pytest

from transientcam_driver.camera import Sensor
from transientcam_driver.sequence import Sequence
from transientcam_simulation.base import SparseResponses
from transientcam_simulation.compiled import IMAGE_KERNELS
from transientcam_simulation.compiled._image_kernels import ImageKernels
from transientcam_simulation.imaging import World
from transientcam_simulation.light import GivenScenery

SEQUENCE = Sequence(harmonics=1, zeroth="estimated", exposure_s=1e-3)
NO_NOISE = {"shot-noise": "off", "read-noise": "off"}


@pytest.fixture(autouse=True)
def no_kernels_afterwards() -> Iterator[None]:
    yield
    IMAGE_KERNELS.kernels.compiled.clear()
    IMAGE_KERNELS._ready = {}


def codes(effects: dict[str, str], seed: int) -> bytes:
    """Codes of images of pixels from none to more light than the converter has codes for."""
    weight = np.geomspace(1e-4, 1e2, 500 * 400).reshape(1, 500, 400)
    weight[0, :3] = 0
    scenery = GivenScenery(SparseResponses(np.full_like(weight, 5e-9), weight))
    world = World(scenery, Sensor(), electrons_per_s=3e6, effects=effects, seed=seed)
    world.configure(SEQUENCE, SEQUENCE.labels)
    labels = enumerate(SEQUENCE.labels)
    return np.array([world.image(each, number=n, device_time_s=0) for n, each in labels]).tobytes()


@pytest.mark.parametrize(
    "effects",
    [
        {},
        {"saturation": "on"},
        {"read-noise": "off"},
        {"shot-noise": "off"},
        NO_NOISE,
        {"modulation-harmonics": "on"},
        {"hot-pixels": "on", "jitter": "on"},
        {"blooming": "on"},
        {"noisy-pixels": "on"},
        {"non-linearity": "on"},
    ],
)
@pytest.mark.parametrize("seed", [1, 2])
def test_codes_are_those_of_the_effects_one_by_one(effects: dict[str, str], seed: int) -> None:
    expected = codes(effects, seed)

    IMAGE_KERNELS.compile_now()

    assert codes(effects, seed) == expected


@pytest.mark.parametrize(("effects", "expected"), [({}, 4 * 200_000), (NO_NOISE, 0)])
def test_pixels_whose_noise_numpy_draws_count_towards_kernels(
    effects: dict[str, str], expected: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    counted = []
    monkeypatch.setattr(
        ImageKernels, "want_for_images", lambda _self, pixels: counted.append(pixels)
    )

    codes(effects, 1)
    assert sum(counted) == expected

    IMAGE_KERNELS.compile_now()
    codes(effects, 1)
    assert sum(counted) == expected
