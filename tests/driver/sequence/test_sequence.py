import math
from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given, strategies as st

from transientcam_driver import ImageLabel, Sequence, SequenceError, SubPhases
from transientcam_driver.sequence import READ_ONLY_FIELDS

READOUT_S = 3.73e-3
STREAMING_READOUT_S = 3.98e-3


def naive_harmonic(sub_phases: SubPhases, k: int) -> complex:
    """G_k of Sec. 4.1, written out."""
    total = 0j
    for weight, phase_rad in zip(sub_phases.weights, sub_phases.phases_rad, strict=True):
        total += weight * complex(math.cos(k * phase_rad), -math.sin(k * phase_rad))
    return total


# Every capture rate the paper prints (Sec. 6): sequence, rate in Hz.
PAPER = [
    (Sequence(harmonics=3, zeroth="estimated", exposure_s=0.5e-3), 18.6),
    (Sequence(harmonics=3), 11.0),
    (Sequence(harmonics=4), 1 / 0.113),
    (Sequence(harmonics=4, takes=4), 2.2),
    (Sequence(harmonics=4, takes=20), 0.44),
    (Sequence(harmonics=4, takes=40), 0.22),
    (Sequence(base_frequency_hz=11.5e6, harmonics=8, takes=40), 0.12),
]


@pytest.mark.parametrize(("sequence", "rate_hz"), PAPER)
@pytest.mark.parametrize("readout_s", [READOUT_S, STREAMING_READOUT_S])
def test_capture_rates_of_the_paper_are_met_within_6_percent(
    sequence: Sequence, rate_hz: float, readout_s: float
) -> None:
    assert 1 / sequence.capture_s(readout_s) == pytest.approx(rate_hz, rel=0.06)


def test_the_single_capture_of_figure_1_takes_113_ms() -> None:
    assert Sequence(harmonics=4).capture_s(READOUT_S) == pytest.approx(0.113, abs=0.0005)


def test_transient_video_runs_at_18_6_hz() -> None:
    video = Sequence(harmonics=3, zeroth="estimated", exposure_s=0.5e-3)

    assert 1 / video.capture_s(STREAMING_READOUT_S) == pytest.approx(18.6, abs=0.05)


@pytest.mark.parametrize(
    ("zeroth", "images"), [("low-frequency", 16), ("on-off", 14), ("estimated", 12)]
)
def test_the_zeroth_moment_costs_four_two_or_no_images(zeroth: Any, images: int) -> None:
    sequence = Sequence(harmonics=3, zeroth=zeroth)

    assert sequence.images == len(sequence.labels) == images


def test_labels_run_over_takes_then_frequencies_then_phases() -> None:
    labels = Sequence(base_frequency_hz=10e6, harmonics=2, takes=2).labels

    assert [label.index for label in labels] == list(range(24))
    assert [label.take for label in labels] == [0] * 12 + [1] * 12
    assert [label.harmonic for label in labels[:12]] == [0] * 4 + [1] * 4 + [2] * 4
    assert [label.frequency_hz for label in labels[:12:4]] == [0.9e6, 10e6, 20e6]
    assert [label.phase_rad for label in labels[:4]] == [0, math.pi / 2, math.pi, 3 * math.pi / 2]


def test_interleaved_takes_follow_image_by_image() -> None:
    interleaved = Sequence(10e6, harmonics=2, zeroth="on-off", takes=3, take_order="interleaved")
    sequential = replace(interleaved, take_order="sequential")

    labels = interleaved.labels

    assert [label.index for label in labels] == list(range(30))
    assert [label.take for label in labels[:6]] == [0, 1, 2, 0, 1, 2]
    assert [label.illumination for label in labels[:6]] == [True] * 3 + [False] * 3
    assert [label.harmonic for label in labels[6::12]] == [1, 2]

    def shown(label: ImageLabel) -> tuple[int, int, float, bool]:
        return label.take, label.harmonic, label.phase_rad, label.illumination

    assert sorted(map(shown, labels)) == sorted(map(shown, sequential.labels))
    assert interleaved.capture_s(1e-3) == sequential.capture_s(1e-3)


def test_an_on_off_pair_is_unmodulated_and_differs_by_the_light() -> None:
    on, off, first, *_ = Sequence(zeroth="on-off").labels

    assert (on.frequency_hz, on.illumination) == (0.0, True)
    assert (off.frequency_hz, off.illumination) == (0.0, False)
    assert first.harmonic == 1


def test_arccos_sub_phases_follow_equation_3() -> None:
    phases_rad = SubPhases("arccos", 4).phases_rad

    expected = [math.acos(0.75), math.acos(0.25), math.acos(-0.25), math.acos(-0.75)]
    assert phases_rad == pytest.approx(expected)


def test_arccos_sampling_at_n_8_leaves_the_odd_harmonics_that_were_computed_elsewhere() -> None:
    sub_phases = SubPhases("arccos", 8)

    assert [abs(naive_harmonic(sub_phases, k)) for k in (3, 5, 7)] == pytest.approx(
        [0.0255, 0.0175, 0.0346], abs=5e-5
    )


def test_the_fundamental_of_arccos_sampling_tends_to_a_quarter_of_pi() -> None:
    assert abs(naive_harmonic(SubPhases("arccos", 255), 1)) == pytest.approx(math.pi / 4, rel=1e-3)


@given(n=st.integers(2, 40))
def test_harmonic_cancellation_removes_odd_harmonics_up_to_2n_minus_1(n: int) -> None:
    sub_phases = SubPhases("harmonic-cancellation", n)

    for k in range(3, 2 * n, 2):
        assert abs(naive_harmonic(sub_phases, k)) < 1e-12
    assert abs(naive_harmonic(sub_phases, 2 * n + 1)) > 1e-3


@given(scheme=st.sampled_from(["arccos", "harmonic-cancellation", "none"]), n=st.integers(1, 255))
def test_weights_sum_to_one_and_are_as_many_as_phases(scheme: Any, n: int) -> None:
    sub_phases = SubPhases(scheme, n)

    assert math.fsum(sub_phases.weights) == pytest.approx(1)
    assert len(sub_phases.phases_rad) == len(sub_phases.weights) == sub_phases.n


def test_without_sub_phases_there_is_one_part() -> None:
    assert SubPhases("none") == SubPhases("none", 1)


@pytest.mark.parametrize(
    ("fields", "field"),
    [
        ({"base_frequency_hz": 0}, "base_frequency_hz"),
        ({"base_frequency_hz": -1.0}, "base_frequency_hz"),
        ({"base_frequency_hz": math.nan}, "base_frequency_hz"),
        ({"base_frequency_hz": math.inf}, "base_frequency_hz"),
        ({"base_frequency_hz": "23e6"}, "base_frequency_hz"),
        ({"base_frequency_hz": True}, "base_frequency_hz"),
        ({"base_frequency_hz": None}, "base_frequency_hz"),
        ({"harmonics": 0}, "harmonics"),
        ({"harmonics": 33}, "harmonics"),
        ({"harmonics": 3.0}, "harmonics"),
        ({"zeroth": "guessed"}, "zeroth"),
        ({"zeroth": ["on-off"]}, "zeroth"),
        ({"exposure_s": 0.0}, "exposure_s"),
        ({"takes": 0}, "takes"),
        ({"take_order": "random"}, "take_order"),
        ({"takes": 10**400}, None),
        ({"sub_phases": {"scheme": "sawtooth"}}, "sub_phases.scheme"),
        ({"sub_phases": {"n": 0}}, "sub_phases.n"),
        ({"sub_phases": {"m": 3}}, "sub_phases.m"),
        ({"sub_phases": 8}, "sub_phases"),
        ({"exposure": 1}, "exposure"),
    ],
)
def test_an_error_names_field_value_and_limit(fields: dict[str, Any], field: str | None) -> None:
    if field is None:
        assert Sequence.from_document(fields).takes == fields["takes"]  # the camera has the limit
        return
    with pytest.raises(SequenceError) as caught:
        Sequence.from_document(fields)

    assert caught.value.field == field
    assert field in str(caught.value)
    assert caught.value.limit in str(caught.value)
    assert repr(caught.value.value) in str(caught.value)


@pytest.mark.parametrize("document", [None, 3, [], "harmonics"])
def test_a_document_that_is_no_object_is_refused(document: Any) -> None:
    with pytest.raises(SequenceError, match="an object"):
        Sequence.from_document(document)


sequences = st.builds(
    Sequence,
    base_frequency_hz=st.floats(1e5, 1e9),
    harmonics=st.integers(1, 32),
    zeroth=st.sampled_from(["low-frequency", "on-off", "estimated"]),
    exposure_s=st.floats(1e-6, 1.0),
    takes=st.integers(1, 3),
    sub_phases=st.builds(
        SubPhases, st.sampled_from(["arccos", "harmonic-cancellation", "none"]), st.integers(1, 9)
    ),
    take_order=st.sampled_from(["sequential", "interleaved"]),
)


@given(sequence=sequences)
def test_a_document_read_back_is_the_same_sequence(sequence: Sequence) -> None:
    assert Sequence.from_document(sequence.to_document()) == sequence


@given(sequence=sequences)
def test_what_an_applied_sequence_adds_is_ignored_when_it_is_sent_back(sequence: Sequence) -> None:
    document = sequence.to_document() | dict.fromkeys(READ_ONLY_FIELDS, 1)

    assert Sequence.from_document(document) == sequence


def test_integers_are_taken_for_frequencies_and_become_floats() -> None:
    assert isinstance(
        Sequence.from_document({"base_frequency_hz": 23_000_000}).base_frequency_hz, float
    )


def test_the_unambiguous_range_at_23_mhz_is_6_52_m() -> None:
    assert Sequence().unambiguous_range_m == pytest.approx(6.517, abs=1e-3)
