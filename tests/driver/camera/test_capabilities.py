from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given, strategies as st

from transientcam_driver import Capabilities, Sequence, SequenceError, SubPhases
from transientcam_simulation.emulated._open_usb.prototype import prototype

CAPABILITIES = prototype(serial="T", width=163, height=120, bits=12)


@pytest.mark.parametrize(
    ("sequence", "field", "limit"),
    [
        (Sequence(base_frequency_hz=1e5), "base_frequency_hz", "at least 500000 Hz"),
        (Sequence(base_frequency_hz=60e6), "base_frequency_hz", "at most 5e+07 Hz"),
        (Sequence(harmonics=32), "base_frequency_hz", "32 harmonics have to stay below"),
        (Sequence(exposure_s=1e-6), "exposure_s", "from 2e-05 to 0.05 s"),
        (Sequence(exposure_s=0.1), "exposure_s", "from 2e-05 to 0.05 s"),
        (Sequence(takes=129), "takes", "at most 128 with 16 images a take"),
        (Sequence(sub_phases=SubPhases("arccos", 33)), "sub_phases.n", "at most 32"),
    ],
)
def test_what_the_camera_cannot_do_is_refused_by_name(
    sequence: Sequence, field: str, limit: str
) -> None:
    with pytest.raises(SequenceError) as caught:
        CAPABILITIES.validate(sequence)

    assert caught.value.field == field
    assert limit in str(caught.value)


@pytest.mark.parametrize(
    ("without", "sequence", "field"),
    [
        ({"max_harmonics": 4}, Sequence(harmonics=5), "harmonics"),
        ({"zeroths": ("estimated",)}, Sequence(zeroth="on-off"), "zeroth"),
        ({"schemes": ("none",)}, Sequence(), "sub_phases.scheme"),
        ({"take_orders": ("sequential",)}, Sequence(take_order="interleaved"), "take_order"),
    ],
)
def test_a_lesser_camera_refuses_more(
    without: dict[str, Any], sequence: Sequence, field: str
) -> None:
    with pytest.raises(SequenceError) as caught:
        replace(CAPABILITIES, **without).validate(sequence)

    assert caught.value.field == field


@given(
    base_frequency_hz=st.floats(0.5e6, 4.5e6),
    exposure_s=st.floats(20e-6, 50e-3),
    harmonics=st.integers(1, 32),
)
def test_what_is_applied_lies_on_the_grid_and_near_what_was_requested(
    base_frequency_hz: float, exposure_s: float, harmonics: int
) -> None:
    requested = Sequence(base_frequency_hz, harmonics, exposure_s=exposure_s)

    applied = CAPABILITIES.apply(requested).sequence

    assert (applied.base_frequency_hz / 0.25).is_integer()
    assert abs(applied.base_frequency_hz - base_frequency_hz) <= 0.125
    assert abs(applied.exposure_s - exposure_s) <= 0.5e-9
    assert CAPABILITIES.apply(applied).sequence == applied


@given(base_frequency_hz=st.floats(0.5e6, 4.5e6))
def test_harmonics_are_exact_multiples_of_what_was_set(base_frequency_hz: float) -> None:
    applied = CAPABILITIES.apply(Sequence(base_frequency_hz, 32))

    words = {round(label.frequency_hz / 0.25) for label in applied.labels if label.harmonic}
    base = min(words)
    assert words == {j * base for j in range(1, 33)}


def test_the_usual_frequencies_are_on_the_grid() -> None:
    for frequency_hz in (23e6, 11.5e6, 0.9e6):
        assert CAPABILITIES.frequency_hz(CAPABILITIES.tuning_word(frequency_hz)) == frequency_hz


def test_an_applied_sequence_says_what_follows_from_it() -> None:
    video = Sequence(harmonics=3, zeroth="estimated", exposure_s=0.5e-3)

    document = CAPABILITIES.apply(video, epoch=7).to_document()

    image_bytes = 64 + 163 * 120 * 2
    assert document == video.to_document() | {
        "sequence_id": 7,
        "images": 12,
        "capture_s": pytest.approx(12 * 4.48e-3),
        "frame_rate_hz": pytest.approx(1 / (12 * 4.48e-3)),
        "unambiguous_range_m": pytest.approx(6.517, abs=1e-3),
        "data_rate_bytes_s": pytest.approx(image_bytes / 4.48e-3),
    }


lesser_cameras = st.builds(
    replace,
    st.just(CAPABILITIES),
    max_harmonics=st.integers(1, 32),
    max_frequency_hz=st.floats(35e6, 150e6),
    min_exposure_s=st.floats(1e-6, 5e-3),
    max_exposure_s=st.floats(5e-3, 1.0),
    max_takes=st.integers(1, 256),
    max_images=st.integers(132, 2048),
    max_sub_phases=st.integers(1, 32),
    schemes=st.sampled_from([("none",), ("arccos",), ("none", "harmonic-cancellation")]),
    zeroths=st.sampled_from([("estimated",), ("on-off",), ("low-frequency", "estimated")]),
    take_orders=st.sampled_from([("sequential",), ("sequential", "interleaved")]),
)


@given(
    camera=lesser_cameras,
    base_frequency_hz=st.floats(1e5, 1e9),
    harmonics=st.integers(1, 32),
    takes=st.integers(1, 300),
    take_order=st.sampled_from(["sequential", "interleaved"]),
)
def test_the_nearest_sequence_is_one_that_the_camera_can_do(
    camera: Capabilities, base_frequency_hz: float, harmonics: int, takes: int, take_order: Any
) -> None:
    requested = Sequence(base_frequency_hz, harmonics, takes=takes, take_order=take_order)

    nearest = camera.nearest(requested)

    camera.validate(nearest)
    assert camera.nearest(nearest) == nearest


def test_a_sequence_that_the_camera_can_do_is_its_own_nearest() -> None:
    assert CAPABILITIES.nearest(Sequence(takes=3)) == Sequence(takes=3)


def test_what_a_document_leaves_out_is_nearest_to_its_default() -> None:
    camera = replace(
        CAPABILITIES,
        schemes=("none",),
        zeroths=("estimated",),
        max_frequency_hz=28e6,
        max_exposure_s=1e-3,
    )

    sequence = camera.sequence_of({"harmonics": 4})

    assert (sequence.harmonics, sequence.zeroth) == (4, "estimated")
    assert (sequence.sub_phases, sequence.exposure_s) == (SubPhases("none"), 1e-3)
    assert sequence.base_frequency_hz == pytest.approx(7e6, abs=1.0)
    assert camera.sequence_of({"sub_phases": {"n": 3}}).sub_phases == SubPhases("none")
    assert camera.sequence_of({"sub_phases": {}}).sub_phases == SubPhases("none")


def test_what_a_document_says_is_not_bent() -> None:
    camera = replace(CAPABILITIES, schemes=("none",), zeroths=("estimated",))

    sequence = camera.sequence_of({"zeroth": "on-off", "sub_phases": {"scheme": "arccos"}})

    assert (sequence.zeroth, sequence.sub_phases.scheme) == ("on-off", "arccos")
    beyond = {"sub_phases": {"n": CAPABILITIES.max_sub_phases + 1}}
    assert CAPABILITIES.sequence_of(beyond).sub_phases.n == CAPABILITIES.max_sub_phases + 1
