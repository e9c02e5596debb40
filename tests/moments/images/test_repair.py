"""Images that lost their synchronisation, against the same images without that loss."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import transientcam_moments as tm

HEIGHT, WIDTH = 36, 40
GAIN_E_PER_DN = 9.0
ZEROTHS = ("low-frequency", "on-off", "estimated")
FIRST = {"low-frequency": 0, "on-off": 2, "estimated": 0}
Images = NDArray[Any]


class Scene:
    """A tilted wall with a second return, as four-bucket images of a camera with shot noise."""

    def __init__(
        self,
        zeroth: str = "low-frequency",
        *,
        harmonics: int = 4,
        seed: int = 1,
        tilt_rad: float = 0.8,
        level_dn: float = 1500.0,
    ) -> None:
        self.zeroth, self.harmonics = zeroth, harmonics
        self.random = np.random.default_rng(seed)
        y, x = np.mgrid[:HEIGHT, :WIDTH] / HEIGHT
        self.near_rad = 0.9 + tilt_rad * x + 0.2 * y
        self.brightness = level_dn * (0.6 + 0.4 * np.cos(3 * x) * np.cos(2 * y))
        self.ambient = 100.0 + 60.0 * (0.5 + 0.5 * np.sin(5 * x + y))
        self.labels = [(j, step) for j in self._harmonics() for step in range(4)]
        if zeroth == "on-off":
            self.labels = [(0, -1), (0, -2), *self.labels]

    def _harmonics(self) -> list[int]:
        return list(range(0 if self.zeroth == "low-frequency" else 1, self.harmonics + 1))

    def phasor(self, j: int) -> Images:
        frequency = 0.04 if j == 0 else j
        returns = ((0.75, self.near_rad), (0.25, self.near_rad + 1.1))
        moment = sum(w * np.exp(1j * frequency * phase) for w, phase in returns)
        phasor: Images = self.brightness * moment
        return phasor

    def mean(self, image: int, factor: complex = 1.0) -> Any:
        j, step = self.labels[image]
        if step == -2:
            return self.ambient
        if step == -1:
            return self.ambient + self.brightness / 2
        phasor = factor * self.phasor(j) * (-1j) ** step
        return self.ambient + (self.brightness + phasor.real) / 2

    def noisy(self, mean: Images) -> Images:
        electrons = self.random.normal(mean * GAIN_E_PER_DN, np.sqrt(mean * GAIN_E_PER_DN + 900))
        return np.clip(np.rint(electrons / GAIN_E_PER_DN), 0, 4095).astype(np.uint16)

    def capture(self) -> Images:
        return np.stack([self.noisy(self.mean(k)) for k in range(len(self.labels))])

    def spoil(self, images: Images, *corrupt: int, factor: complex = 0.0) -> Images:
        """Replace images by ones whose light was out of phase during a part of the exposure."""
        out = images.copy()
        for image in corrupt:
            part, phase = self.random.uniform(0.3, 1.0), self.random.uniform(1.0, 5.0)
            f = factor or (1 - part) + part * np.exp(1j * phase)
            out[image] = self.noisy(self.mean(image, f))
        return out

    def repair(self, images: Images, **options: Any) -> tm.Repair:
        stack = images if images.ndim == 4 else images[None]
        calibration = np.ones(self.harmonics + 1)
        return tm.repair(stack, zeroth=self.zeroth, calibration=calibration, **options)


def opposite(image: int, first: int) -> int:
    return image + 2 if (image - first) % 4 < 2 else image - 2


def places(mask: Images) -> list[tuple[int, int]]:
    return [(int(take), int(image)) for take, image in np.argwhere(mask)]


@pytest.mark.parametrize("zeroth", ZEROTHS)
def test_each_corrupt_image_is_found_and_rebuilt(zeroth: str) -> None:
    scene = Scene(zeroth)
    for image in range(FIRST[zeroth], len(scene.labels)):
        clean = scene.capture()
        # at the low frequency all pixels have nearly one phase: a loss that matters to b_0
        factor = 0.1 + 0.7j if scene.labels[image][0] == 0 else 0.0
        found = scene.repair(scene.spoil(clean, image, factor=factor))

        assert places(found.repaired) == [(0, image)]
        assert not (found.unrepaired | found.filled | found.left_out).any()
        untouched = np.arange(len(clean)) != image
        np.testing.assert_array_equal(found.images[0, untouched], clean[untouched])
        # its own noise, and that of the opposite image and of the middle of five sums
        off = found.images[0, image].astype(float) - scene.mean(image)
        noise = [np.std(clean[k] - scene.mean(k)) for k in (image, opposite(image, FIRST[zeroth]))]
        assert np.std(off) < 1.4 * np.hypot(*noise)
        assert abs(np.mean(off)) < 2.0


@pytest.mark.parametrize("zeroth", ZEROTHS)
def test_several_corrupt_images_of_different_pairs_are_rebuilt(zeroth: str) -> None:
    scene = Scene(zeroth, seed=3)
    first = FIRST[zeroth]
    for a, b in ((0, 6), (1, 7), (5, 14), (8, 13)):
        found = scene.repair(scene.spoil(scene.capture(), first + a, first + b))

        assert places(found.repaired) == [(0, first + a), (0, first + b)]


def test_both_quadratures_of_a_frequency_may_be_corrupt() -> None:
    scene = Scene("on-off", seed=5)

    found = scene.repair(scene.spoil(scene.capture(), 8, 7, factor=0.2 - 0.3j))

    assert places(found.repaired) == [(0, 7), (0, 8)]


@pytest.mark.parametrize("zeroth", ZEROTHS)
@pytest.mark.parametrize("tilt_rad", [0.0, 0.05])
def test_the_wrong_image_is_never_rebuilt_where_all_pixels_have_one_phase(
    zeroth: str, tilt_rad: float
) -> None:
    scene = Scene(zeroth, seed=7, tilt_rad=tilt_rad)
    for image in range(FIRST[zeroth], len(scene.labels)):
        found = scene.repair(scene.spoil(scene.capture(), image))

        assert places(found.repaired) in ([(0, image)], [])


def with_ambient(scene: Scene, added: list[float]) -> Images:
    return np.stack(
        [
            scene.noisy(scene.mean(k) + share * scene.ambient)
            for k, share in enumerate(added[: len(scene.labels)])
        ]
    )


def lights(scene: Scene) -> Iterator[list[float]]:
    """Ambient light, as a share of the usual, added to each image: steps, flicker, a drift."""
    count = len(scene.labels)
    for start in range(1, count):
        yield [3.0 * (k >= start) for k in range(count)]
    yield [2.0 + 2.0 * np.sin(2.1 * k) for k in range(count)]
    yield [5.0 * k / count for k in range(count)]


@pytest.mark.parametrize("zeroth", ZEROTHS)
def test_changing_ambient_light_is_not_taken_for_a_loss_of_synchronisation(zeroth: str) -> None:
    scene = Scene(zeroth, seed=11)
    for added in lights(scene):
        images = with_ambient(scene, added)
        found = scene.repair(images)

        assert not (found.repaired | found.filled).any(), added
        np.testing.assert_array_equal(found.images[0], images)


def moving(
    scene: Scene,
    share: float,
    pixels_an_image: int,
    appears_at: int,
    factors: dict[int, complex] | None = None,
) -> Images:
    """An object nearer and brighter than the wall that comes in from the left."""
    images = []
    for k in range(len(scene.labels)):
        factor = (factors or {}).get(k, 1.0)
        there = np.zeros((HEIGHT, WIDTH), dtype=bool)
        begin = pixels_an_image * (k - appears_at)
        if k >= appears_at:
            there[: int(HEIGHT * share), max(begin, 0) : begin + WIDTH // 2] = True
        other = Scene(scene.zeroth, harmonics=scene.harmonics, tilt_rad=0.1, level_dn=2500.0)
        other.near_rad = other.near_rad - 0.5
        images.append(np.where(there, other.mean(k, factor), scene.mean(k, factor)))
    return np.stack([scene.noisy(each) for each in images])


@pytest.mark.parametrize("zeroth", ZEROTHS)
@pytest.mark.parametrize("share", [0.4, 1.0])
def test_motion_is_not_taken_for_a_loss_of_synchronisation(zeroth: str, share: float) -> None:
    scene = Scene(zeroth, seed=13)
    for pixels_an_image in (0, 1, 3):
        for appears_at in range(0, len(scene.labels), 3):
            images = moving(scene, share, pixels_an_image, appears_at)
            found = scene.repair(images)

            assert not (found.repaired | found.filled).any(), (pixels_an_image, appears_at)


def test_a_picture_that_pans_is_left_as_it_is() -> None:
    scene = Scene("estimated", seed=17)
    texture = 0.3 + scene.random.random((HEIGHT, WIDTH))
    images = []
    for k in range(len(scene.labels)):
        images.append(scene.noisy(scene.mean(k) * np.roll(texture, 2 * k, axis=1)))

    found = scene.repair(np.stack(images))

    assert not (found.repaired | found.unrepaired).any()


def test_a_good_frame_is_returned_itself() -> None:
    """Over many frames and amounts of light, down to a few digits."""
    for seed in range(60):
        zeroth = ZEROTHS[seed % 3]
        level_dn = float(np.geomspace(20, 3600, 60)[seed])  # the brightest saturate
        scene = Scene(zeroth, harmonics=2 + seed % 4, seed=seed, level_dn=level_dn)
        images = scene.capture()[None]

        assert scene.repair(images).images is images


def test_saturated_pixels_decide_nothing() -> None:
    scene = Scene("low-frequency", level_dn=6500.0)
    images = scene.capture()
    assert 0.1 < (images == 4095).any(axis=0).mean() < 0.8

    assert not scene.repair(images).unrepaired.any()
    assert places(scene.repair(scene.spoil(images, 9)).repaired) == [(0, 9)]


def test_an_object_in_the_way_does_not_hide_a_corrupt_image() -> None:
    scene = Scene("on-off", seed=19)
    found = scene.repair(moving(scene, 0.4, 1, 2, {6: 0.1 + 0.5j}))

    assert places(found.repaired) == [(0, 6)]


@pytest.mark.parametrize("zeroth", ["low-frequency", "on-off"])
def test_two_corrupt_images_of_a_pair_are_filled_from_the_frame_before(zeroth: str) -> None:
    scene = Scene(zeroth, seed=23)
    pair = [FIRST[zeroth] + 5, FIRST[zeroth] + 7]
    clean, before = scene.capture(), scene.capture()
    images = scene.spoil(scene.spoil(clean, pair[0], factor=-0.6 + 0.2j), pair[1], factor=0.2)

    alone = scene.repair(images)
    filled = scene.repair(images, previous=before[None])

    assert places(alone.unrepaired) == [(0, each) for each in pair]
    assert not alone.repaired.any()
    np.testing.assert_array_equal(alone.images[0], images)
    assert places(filled.filled) == [(0, each) for each in pair]
    np.testing.assert_array_equal(filled.images[0, pair], before[pair])
    assert not filled.unrepaired.any()


def test_nothing_is_filled_from_a_frame_that_is_corrupt_there_itself() -> None:
    scene = Scene("on-off", seed=29)
    images = scene.spoil(scene.spoil(scene.capture(), 7, factor=-0.6), 9, factor=0.3)
    before = scene.spoil(scene.capture(), 7)

    found = scene.repair(images, previous=before[None])

    assert not found.filled.any()
    assert places(found.unrepaired) == [(0, 7), (0, 9)]


def test_what_can_be_rebuilt_is_not_filled() -> None:
    scene = Scene("on-off", seed=31)

    found = scene.repair(scene.spoil(scene.capture(), 7), previous=scene.capture()[None])

    assert places(found.repaired) == [(0, 7)]
    assert not found.filled.any()


@pytest.mark.parametrize("takes", [2, 3])
def test_a_corrupt_image_is_left_out_where_another_take_has_it(takes: int) -> None:
    scene = Scene("low-frequency", seed=37)
    stack = np.stack([scene.capture() for _ in range(takes)])
    stack[1] = scene.spoil(stack[1], 6)

    found = scene.repair(stack)

    assert places(found.left_out) == [(1, 6)]
    assert not found.repaired.any()
    np.testing.assert_array_equal(found.images, stack)


def test_an_image_that_every_take_lost_is_rebuilt() -> None:
    scene = Scene("low-frequency", seed=41)
    stack = np.stack([scene.spoil(scene.capture(), 6) for _ in range(2)])

    found = scene.repair(stack)

    assert places(found.repaired) == [(0, 6), (1, 6)]
    assert not found.left_out.any()


@pytest.mark.parametrize(("zeroth", "harmonics"), [("on-off", 1), ("estimated", 1)])
def test_two_sums_do_not_say_which_is_wrong(zeroth: str, harmonics: int) -> None:
    scene = Scene(zeroth, harmonics=harmonics, seed=43)
    images = scene.spoil(scene.capture(), FIRST[zeroth])

    np.testing.assert_array_equal(scene.repair(images).images[0], images)


def test_types_and_odd_pixels_stay_what_they_are() -> None:
    scene = Scene("on-off", seed=47)
    images = scene.spoil(scene.capture(), 7)
    expected = scene.repair(images).images

    for dtype in (np.float32, np.float64, np.int32):
        found = scene.repair(images.astype(dtype))
        assert found.images.dtype == dtype
        np.testing.assert_allclose(found.images, expected, atol=0.5)
    odd = images.astype(np.float32)
    odd[:, 0, :4], odd[3, 1, :4], odd[9, 2, 2] = np.nan, np.inf, -np.inf
    repaired = scene.repair(odd)
    assert places(repaired.repaired) == [(0, 7)]
    np.testing.assert_allclose(repaired.images[0, :, 3:], expected[0, :, 3:], atol=0.5)


def test_too_few_pixels_are_left_as_they_are() -> None:
    scene = Scene("on-off", seed=53)
    images = scene.spoil(scene.capture(), 7)[:, :5, :5]

    assert not scene.repair(images).repaired.any()


def test_a_frame_before_of_another_shape_is_refused() -> None:
    scene = Scene("on-off")
    images = scene.capture()

    with pytest.raises(tm.ShapeError, match="previous"):
        scene.repair(images, previous=images[None, :-4])


# -- through the reconstruction -----------------------------------------------------------------


def settings(scene: Scene, spoilt_images: str, takes: int = 1) -> tm.Settings:
    return tm.Settings(
        23e6,
        zeroth=scene.zeroth,
        takes=takes,
        spoilt_images=spoilt_images,
        # neither needs the noise, which is measured in the images that were not repaired
        estimator="pisarenko",
        neighbours="gaussian",
    )


@pytest.mark.parametrize("zeroth", ZEROTHS)
def test_a_reconstruction_is_that_of_the_repaired_images_and_counts_them(zeroth: str) -> None:
    scene = Scene(zeroth, seed=59)
    images = scene.spoil(scene.capture(), 7)
    gains = np.ones(scene.harmonics + 1)
    mended = scene.repair(images).images[0]

    found = tm.reconstruct(images, settings(scene, "repair"), calibration=gains)
    expected = tm.reconstruct(mended, settings(scene, "keep"), calibration=gains)
    kept = tm.reconstruct(images, settings(scene, "keep"), calibration=gains)

    np.testing.assert_array_equal(found.range_m, expected.range_m)
    np.testing.assert_array_equal(found.measured, expected.measured)
    assert (found.repaired_images, found.unrepaired_images, found.filled_images) == (1, 0, ())
    assert (expected.repaired_images, kept.repaired_images) == (0, 0)
    assert not np.array_equal(kept.measured, found.measured)


def test_images_left_out_of_two_takes_count_as_rejected() -> None:
    scene = Scene("on-off", seed=61)
    good, corrupt = scene.capture(), scene.capture()
    images = np.concatenate([good, scene.spoil(corrupt, 7)])

    found = tm.reconstruct(
        images, settings(scene, "repair", 2), calibration=np.ones(scene.harmonics + 1)
    )

    average = (good.astype(np.float32) + corrupt) / 2
    average[7] = good[7]
    assert (found.rejected_images, found.repaired_images) == (1, 0)
    np.testing.assert_allclose(found.measured, tm.measure(average, zeroth="on-off"), rtol=1e-5)


def test_a_frame_is_filled_from_the_one_before_only_by_the_settings() -> None:
    scene = Scene("on-off", seed=67)
    images = scene.spoil(scene.spoil(scene.capture(), 7, factor=-0.6), 9, factor=0.3)
    before, gains = scene.capture(), np.ones(scene.harmonics + 1)

    filled = tm.reconstruct(images, settings(scene, "fill"), calibration=gains, previous=before)
    repaired = tm.reconstruct(images, settings(scene, "repair"), calibration=gains, previous=before)

    assert filled.filled_images == ((0, 7), (0, 9))
    assert (repaired.filled_images, repaired.unrepaired_images) == ((), 2)


@pytest.mark.parametrize("zeroth", ZEROTHS)
@pytest.mark.parametrize("share", [0.0, 1.0])
def test_whole_numbers_without_noise_are_not_corrupt_by_their_rounding(
    zeroth: str, share: float
) -> None:
    """All pixels alike: nothing but rounding makes their sums differ, and no fit is possible."""
    scene = Scene(zeroth)
    exact = np.stack([scene.mean(k, 1.0) for k in range(len(scene.labels))])
    alike = np.broadcast_to(exact.mean(axis=(1, 2), keepdims=True), exact.shape)
    images = np.rint(share * alike + 200.4).astype(np.uint16)[None]

    found = tm.repair(images, zeroth=zeroth, calibration=np.ones(scene.harmonics + 1))

    assert found.images is images


def test_another_treatment_of_corrupt_images_is_refused() -> None:
    with pytest.raises(tm.ParameterError, match="spoilt_images"):
        tm.Settings(spoilt_images="ignore")
