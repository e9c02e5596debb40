"""Frequencies and phases that a camera has no choice of."""

import json
import math
from dataclasses import replace
from typing import Any

import pytest

from transientcam_driver import Sampling, Sequence, SequenceError
from transientcam_simulation.emulated._open_usb.prototype import prototype

THIRDS = (0.0, 2 * math.pi / 3, 4 * math.pi / 3)
FIXED = Sampling((2, 10, 15), THIRDS)
PROTOTYPE = prototype(serial="T", width=163, height=120, bits=12)
CAMERA = replace(
    PROTOTYPE,
    sampling=FIXED,
    min_frequency_hz=8e6,
    max_frequency_hz=120e6,
    max_harmonics=3,
    tuning_step_hz=1.0,
    zeroths=("estimated", "low-frequency", "on-off"),
)


@pytest.mark.parametrize(
    ("zeroth", "images"), [("estimated", 9), ("on-off", 11), ("low-frequency", 12)]
)
def test_images_are_those_of_its_multiples_and_phases(zeroth: Any, images: int) -> None:
    sequence = Sequence(8e6, harmonics=3, zeroth=zeroth, sampling=FIXED)
    modulated = [label for label in sequence.labels if label.harmonic]

    assert sequence.images == len(sequence.labels) == images
    assert [label.frequency_hz for label in modulated[::3]] == [16e6, 80e6, 120e6]
    assert [label.phase_rad for label in modulated] == [*THIRDS] * 3
    assert sequence.unambiguous_range_m == pytest.approx(18.737, abs=1e-3)


@pytest.mark.parametrize(
    ("field", "wrong"),
    [
        ("multiples", (2, 10, 2)),
        ("multiples", (10, 2)),
        ("multiples", (2, 4)),
        ("multiples", (0, 1)),
        ("multiples", (1, 33)),
        ("multiples", (1.5, 2)),
        ("multiples", (True, 2)),
        ("multiples", 3),
        ("phases_rad", (0.0, 1.0)),
        ("phases_rad", (0.0, 1.0, 2 * math.pi)),
        ("phases_rad", (0.0, 1.0, math.inf)),
        ("phases_rad", (0.0, 1.0, math.nan)),
        ("phases_rad", (0.0, 1.0, 10**400)),
        ("multiples", (1, 10**400)),
        ("phases_rad", (0.0, 1.0, "2")),
        ("phases_rad", tuple(range(17))),
        ("phases_rad", None),
    ],
)
def test_what_is_no_sampling_is_refused_by_name(field: str, wrong: Any) -> None:
    with pytest.raises(SequenceError) as caught:
        Sampling(**{field: wrong})

    assert caught.value.field == f"sampling.{field}"


def test_a_camera_captures_every_sequence_with_its_own() -> None:
    applied = CAMERA.apply(Sequence(8e6, harmonics=3, zeroth="estimated"))

    assert applied.sequence.sampling == FIXED
    assert applied.images == len(applied.labels) == 9
    assert CAMERA.apply(applied.sequence) == applied
    assert CAMERA.nearest(Sequence()).multiples == (2, 10, 15)
    assert CAMERA.sequence_of({}).base_frequency_hz == 8e6


@pytest.mark.parametrize(
    ("sequence", "field"),
    [
        (Sequence(8e6, harmonics=2), "harmonics"),
        (Sequence(8.1e6, harmonics=3), "base_frequency_hz"),
        (Sequence(7.9e6, harmonics=3), "base_frequency_hz"),
        (Sequence(8e6, harmonics=3, sampling=Sampling((1, 2, 4))), "sampling"),
    ],
)
def test_any_other_is_refused(sequence: Sequence, field: str) -> None:
    with pytest.raises(SequenceError) as caught:
        CAMERA.apply(replace(sequence, zeroth="estimated"))

    assert caught.value.field == field


def test_a_camera_with_a_choice_takes_no_other_sampling() -> None:
    with pytest.raises(SequenceError, match="sampling = "):
        PROTOTYPE.apply(Sequence(8e6, harmonics=3, sampling=FIXED))


def test_a_document_has_it_only_where_it_is_unusual() -> None:
    fixed = Sequence(8e6, harmonics=3, sampling=FIXED)
    document = json.loads(json.dumps(fixed.to_document()))

    assert Sequence.from_document(document) == fixed
    assert "sampling" not in Sequence().to_document()
    assert Sequence.from_document(Sequence().to_document() | {"sampling": None}) == Sequence()
    with pytest.raises(SequenceError, match=r"sampling\.steps"):
        Sequence.from_document(document | {"sampling": {"steps": 3}})
