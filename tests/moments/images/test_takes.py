"""Averaging takes."""

import numpy as np
import pytest

import transientcam_moments as tm


def takes(count: int = 10, *, noise: float = 2.0) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(0)
    scene = 100 + 50 * rng.random((4, 8, 9))
    return scene + noise * rng.normal(size=(count, 4, 8, 9)), scene


def test_the_mean_of_good_takes_is_the_mean() -> None:
    images, _ = takes()

    average = tm.average_takes(images)

    assert average.kept.all()
    assert np.allclose(average.images, images.mean(axis=0))


def test_images_out_of_step_are_left_out() -> None:
    images, scene = takes()
    images[3, 1] = scene[1][::-1]  # another phase: a different picture
    images[7, 2] *= 0.5
    good = np.ones((10, 4), bool)
    good[3, 1] = good[7, 2] = False

    average = tm.average_takes(images)

    assert np.array_equal(average.kept, good)
    assert np.allclose(average.images[1], np.delete(images[:, 1], 3, axis=0).mean(axis=0))
    assert np.allclose(average.images[0], images[:, 0].mean(axis=0))


def test_a_tenth_of_outliers_is_found_as_the_paper_meets_them() -> None:
    rng = np.random.default_rng(5)
    images, scene = takes(40)
    wrong = rng.random((40, 4)) < 0.1
    images[wrong] += np.where(rng.random((int(wrong.sum()), 1, 1)) < 0.5, -40, 40)

    average = tm.average_takes(images)

    assert np.array_equal(average.kept, ~wrong)
    assert np.abs(average.images - scene).max() < 5 * 2 / np.sqrt(30)


def test_two_takes_do_not_show_which_one_is_wrong() -> None:
    images, _ = takes(2)
    images[1] += 1000

    assert tm.average_takes(images).kept.all()


def test_equal_takes_are_all_kept() -> None:
    images = np.broadcast_to(np.array([[1.0, 2e-7], [3.0, 4.0]]), (5, 2, 2))

    average = tm.average_takes(images)

    assert average.kept.all()
    assert np.allclose(average.images, images[0], rtol=1e-15)


@pytest.mark.parametrize("level", [1.0, 1e6])
def test_takes_that_differ_by_rounding_alone_are_all_kept(level: float) -> None:
    last_places = np.array([0, 1, 2, 2, 6]).reshape(5, 1, 1)

    average = tm.average_takes(level + last_places * np.spacing(level))

    assert average.kept.all()


@pytest.mark.parametrize("bad", [np.nan, np.inf, 1e30])
def test_one_wild_pixel_does_not_throw_its_image_away(bad: float) -> None:
    images, _ = takes()
    clean = tm.average_takes(images)
    images[4, 2, 3, 3] = bad

    average = tm.average_takes(images)

    assert average.kept.all()
    others = np.ones((8, 9), bool)
    others[3, 3] = False
    assert np.array_equal(average.images[:, others], clean.images[:, others])


def test_integers_are_averaged_as_reals() -> None:
    images = np.array([[[65535]], [[65534]]], dtype=np.uint16)

    assert tm.average_takes(images).images[0, 0] == 65534.5


def test_a_single_take_is_itself() -> None:
    images, _ = takes(1)

    assert np.array_equal(tm.average_takes(images).images, images[0])


def test_wrong_arguments_are_refused() -> None:
    with pytest.raises(tm.ShapeError, match="takes, N"):
        tm.average_takes(np.ones(3))
    for factor in (1.0, float("nan")):
        with pytest.raises(tm.ParameterError, match="outlier_factor"):
            tm.average_takes(np.ones((3, 2)), outlier_factor=factor)
