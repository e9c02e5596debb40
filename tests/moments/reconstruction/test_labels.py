"""What raw images show: order, weights, and what is refused."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import transientcam_moments as tm
from transientcam_driver import Sequence

F_HZ = 17e6
SHAPE = (3, 4)
Array = NDArray[Any]


def images_of(sequence: Sequence, b: Array) -> Array:
    """Images in DN of moments (m + 1, H, W), one for each label, by the formation of an image."""
    images = []
    for label in sequence.labels:
        plane = b[label.harmonic] if label.frequency_hz else b[0] * label.illumination
        turned = plane * np.exp(-1j * label.phase_rad)
        images.append(64.0 + (label.illumination * b[0].real + turned.real) / 2)
        if not label.frequency_hz:
            images[-1] = 64.0 + plane.real / 2
    return np.asarray(np.stack(images))


def labels_of(sequence: Sequence) -> dict[str, Any]:
    names = ("harmonic", "phase_rad", "frequency_hz", "illumination", "take")
    return {name: np.array([getattr(each, name) for each in sequence.labels]) for name in names}


def moments(m: int) -> Array:
    phase = np.linspace(0.5, 4.0, 12).reshape(SHAPE)
    b = 500 * np.exp(1j * np.arange(m + 1)[:, None, None] * phase)
    b[0] += 50
    return np.asarray(b)


SEQUENCES = [
    Sequence(F_HZ, harmonics=2, zeroth="low-frequency"),
    Sequence(F_HZ, harmonics=3, zeroth="on-off", takes=2),
    Sequence(F_HZ, harmonics=1, zeroth="estimated", takes=3, take_order="interleaved"),
    Sequence(F_HZ, harmonics=2, zeroth="on-off", takes=2, take_order="interleaved"),
]


@pytest.mark.parametrize("sequence", SEQUENCES)
def test_weights_and_modulus_make_moments_of_images(sequence: Sequence) -> None:
    b = moments(sequence.harmonics)
    labels = tm.Labels(**labels_of(sequence))

    found = np.tensordot(labels.weight, images_of(sequence, b), 1)
    found = np.where(labels.modulus[:, None, None], abs(found), found)

    if sequence.zeroth == "estimated":
        b[0] = 0
    elif sequence.zeroth == "low-frequency":
        b[0] = abs(b[0])
    np.testing.assert_allclose(found, b, atol=1e-9)
    np.testing.assert_allclose(labels.weight.sum(axis=1), 0, atol=1e-15)
    assert (labels.zeroth, labels.takes) == (sequence.zeroth, sequence.takes)
    assert labels.base_frequency_hz == F_HZ


@pytest.mark.parametrize("sequence", SEQUENCES)
@pytest.mark.parametrize("shuffled", [False, True])
def test_labelled_images_in_any_order_have_their_range(sequence: Sequence, shuffled: bool) -> None:
    images, labels = images_of(sequence, moments(sequence.harmonics)), labels_of(sequence)
    if shuffled:
        order = np.random.default_rng(0).permutation(len(images))
        images, labels = images[order], {name: each[order] for name, each in labels.items()}
    gain = np.ones(sequence.harmonics + 1)

    settings = tm.Settings(smoothing_sigma_px=0.0, estimator="pisarenko")
    found = tm.reconstruct(images, settings, **labels, calibration=gain)

    phase = np.linspace(0.5, 4.0, 12).reshape(SHAPE)
    np.testing.assert_allclose(found.range_m, tm.range_m(phase, F_HZ), atol=2e-3)
    assert found.settings.zeroth == sequence.zeroth


@pytest.mark.parametrize("turns", [0, 1, -3])
@pytest.mark.parametrize("off_rad", [-1e-7, -1e-12, 1e-12, 1e-7])
def test_phases_are_the_same_whole_turns_and_roundings_apart(turns: int, off_rad: float) -> None:
    labels = labels_of(SEQUENCES[1])
    exact = tm.Labels(**labels)
    again = labels["take"] == 1  # the second take is as far off

    labels["phase_rad"] = labels["phase_rad"] + again * (2 * np.pi * turns + off_rad)

    found = tm.Labels(**labels)
    np.testing.assert_allclose(found.phases_rad, exact.phases_rad, atol=1e-6)
    np.testing.assert_allclose(found.weight, exact.weight, atol=1e-6)


def test_what_is_missing_is_named_with_the_call() -> None:
    images = np.zeros((16, *SHAPE), np.uint16)
    with pytest.raises(tm.UnlabelledImages, match=r"reconstruct\(images, harmonic=") as caught:
        tm.reconstruct(images)
    assert caught.value.missing == ("harmonic", "phase_rad", "frequency_hz", "calibration")

    labels = labels_of(SEQUENCES[0])
    with pytest.raises(tm.UnlabelledImages) as caught:
        tm.reconstruct(images[:12], harmonic=labels["harmonic"], phase_rad=labels["phase_rad"])
    assert caught.value.missing == ("frequency_hz", "calibration")
    with pytest.raises(tm.UnlabelledImages) as caught:
        tm.reconstruct(images[:12], tm.Settings(F_HZ), calibration=np.ones(3))
    assert caught.value.missing == ("harmonic", "phase_rad")
    with pytest.raises(tm.UnlabelledImages) as caught:
        tm.Reconstructor(tm.Settings(F_HZ, "on-off"))(images)
    assert caught.value.missing == ("takes", "calibration")
    with pytest.raises(tm.UnlabelledImages) as caught:
        _ = tm.reconstruct(moments(2)).range_m
    assert caught.value.missing == ("base_frequency_hz",)


def test_settings_that_contradict_the_labels_are_refused() -> None:
    sequence = SEQUENCES[1]
    images, gain = images_of(sequence, moments(3)), np.ones(4)
    for field, value in (("base_frequency_hz", 23e6), ("zeroth", "estimated"), ("takes", 1)):
        with pytest.raises(tm.ParameterError) as caught:
            tm.reconstruct(
                images,
                tm.Settings(**{field: value}),  # type: ignore[arg-type]  # one field a time
                **labels_of(sequence),
                calibration=gain,
            )
        assert caught.value.field == field


@pytest.mark.parametrize(
    ("name", "index", "value"),
    [
        ("harmonic", 5, 7),
        ("harmonic", 0, -1),
        ("phase_rad", 3, 0.3),
        ("phase_rad", 3, 0.0),
        ("frequency_hz", 9, 3e6),
        ("illumination", 6, False),
        ("take", 2, 1),
    ],
)
def test_labels_of_no_capture_are_refused(name: str, index: int, value: float) -> None:
    labels = labels_of(SEQUENCES[0])
    labels[name][index] = value

    with pytest.raises(tm.ParameterError):
        tm.Labels(**labels)


def test_another_number_of_images_or_labels_is_refused() -> None:
    labels = labels_of(SEQUENCES[0])
    with pytest.raises(tm.ShapeError, match="images"):
        tm.reconstruct(np.zeros((13, 2, 2)), **labels, calibration=np.ones(3))
    with pytest.raises(tm.ShapeError, match="phase_rad"):
        tm.Labels(labels["harmonic"], labels["phase_rad"][:-1])


def test_texts_of_results_say_what_they_are() -> None:
    found = tm.reconstruct(moments(2), tm.Settings(F_HZ, smoothing_sigma_px=0.0))

    assert repr(found) == (
        "<Reconstruction m = 2 at 17 MHz, pixels 3 x 4, estimator likelihood; computed: nothing>"
    )
    assert repr(found.returns) == "<Returns m = 2, pixels 3 x 4; returns: 1 in 100.0%>"
    nearest_m, farthest_m = found.range_m.min(), found.range_m.max()
    assert f"range {nearest_m:.3f} to {farthest_m:.3f} m" in repr(found)
