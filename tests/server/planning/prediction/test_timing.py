"""Computing time of sequences, and budgets of it."""

import dataclasses
from itertools import product
from typing import Any
from unittest.mock import MagicMock

import pytest

import transientcam_moments as tm
from tests.server.planning.looks import SETTINGS
from transientcam_driver import Capabilities, Sequence
from transientcam_server.planning import Goal, Planner, Progress, uniform_scene
from transientcam_server.planning._prediction.timing import ReconstructionTimer


def test_computing_time_is_measured_once_and_grows_with_takes(capabilities: Capabilities) -> None:
    ticks = iter(range(10_000))
    small = dataclasses.replace(capabilities, width=8, height=6)
    seconds = ReconstructionTimer(small, SETTINGS, clock=lambda: float(next(ticks)))

    first = seconds(Sequence(harmonics=3), "pisarenko")
    used = next(ticks)
    again = seconds(Sequence(harmonics=3), "pisarenko")

    assert first is not None
    assert first == again
    assert first > 0
    assert next(ticks) == used + 1
    several = seconds(Sequence(harmonics=3, takes=4), "pisarenko")
    assert several is not None
    assert several >= first


@pytest.mark.parametrize(
    ("durations_s", "expected_s", "used"),
    [
        ([0.049, 0.03, 0.04], 0.03, 3),
        ([0.01, 0.2, 0.3], 0.01, 3),
        ([0.05], 0.05, 1),
        ([2.0], 2.0, 1),
    ],
)
def test_what_is_quick_is_measured_three_times_and_the_quickest_counts(
    durations_s: list[float],
    expected_s: float,
    used: int,
    capabilities: Capabilities,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    times_s = [each for duration_s in durations_s for each in (0.0, duration_s)]
    ticks = iter([*times_s, *[99.0] * 8])
    done: list[object] = []

    def reconstruct(images: object, *_: object, **__: object) -> MagicMock:
        done.append(images)
        return MagicMock()

    monkeypatch.setattr(tm.kernels, "settled", lambda names, m: True)
    monkeypatch.setattr(tm, "reconstruct", reconstruct)
    small = dataclasses.replace(capabilities, width=8, height=6)
    seconds = ReconstructionTimer(small, SETTINGS, clock=lambda: next(ticks))

    assert seconds(Sequence(harmonics=3), "pisarenko") == pytest.approx(expected_s)
    assert len(done) == used


@pytest.mark.parametrize(("takes", "few"), [(1, 1), (2, 2), (3, 3), (20, 3)])
def test_averaging_takes_its_time_for_each_image(
    takes: int, few: int, capabilities: Capabilities, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By what it takes of few takes at one frequency: 2 averaged plainly, 3 searched."""
    image_s, once_s = 1e-3, 0.25
    now_s = [0.0]

    def reconstruct(images: Any, settings: tm.Settings, **_: object) -> MagicMock:
        each = settings.takes or 0
        harmonics = len(images) // (4 * each)
        averaged_s = 0.0 if each == 1 else image_s * each * len(images)
        now_s[0] += once_s * harmonics + averaged_s
        return MagicMock()

    monkeypatch.setattr(tm.kernels, "settled", lambda names, m: True)
    monkeypatch.setattr(tm, "reconstruct", reconstruct)
    small = dataclasses.replace(capabilities, width=8, height=6)
    seconds = ReconstructionTimer(small, SETTINGS, clock=lambda: now_s[0])

    found_s = seconds(Sequence(harmonics=5, takes=takes), "maximum-entropy")

    # in this model an image of `few` takes is averaged in `few` ms
    averaging_s = 0.0 if takes == 1 else few * image_s * 4 * 5 * takes
    assert found_s == pytest.approx(5 * once_s + averaging_s)


def test_averaging_that_is_not_slower_than_none_adds_nothing(
    capabilities: Capabilities, monkeypatch: pytest.MonkeyPatch
) -> None:
    now_s = [0.0]

    def reconstruct(images: Any, settings: tm.Settings, **_: object) -> MagicMock:
        now_s[0] += 0.25 if settings.takes == 1 else 0.2
        return MagicMock()

    monkeypatch.setattr(tm.kernels, "settled", lambda names, m: True)
    monkeypatch.setattr(tm, "reconstruct", reconstruct)
    small = dataclasses.replace(capabilities, width=8, height=6)
    seconds = ReconstructionTimer(small, SETTINGS, clock=lambda: now_s[0])

    assert seconds(Sequence(harmonics=5, takes=20), "maximum-entropy") == pytest.approx(0.25)


def test_no_computing_time_is_stated_before_the_kernels_of_a_frame_are_there(
    capabilities: Capabilities, monkeypatch: pytest.MonkeyPatch
) -> None:
    compiled: set[tuple[str, int]] = set()
    monkeypatch.setattr(
        tm.kernels, "settled", lambda names, m: all((name, m) in compiled for name in names)
    )
    monkeypatch.setattr(
        tm.kernels, "compile", lambda orders, _, names: compiled.update(product(names, orders))
    )
    small = dataclasses.replace(capabilities, width=8, height=6)
    seconds = ReconstructionTimer(small, SETTINGS)
    sequence = Sequence(harmonics=3)

    assert seconds(sequence, "maximum-entropy") is None
    steps: list[str] = []
    assert seconds(sequence, "maximum-entropy", steps.append) is not None
    assert steps == ["compiling kernels for m = 3"]
    assert ("peaks", 3) in compiled
    assert seconds(sequence, "maximum-entropy") is not None
    assert seconds(sequence, "likelihood") is None


def test_a_plan_within_a_budget_of_computing_time_says_that_it_compiles(
    capabilities: Capabilities, monkeypatch: pytest.MonkeyPatch
) -> None:
    orders: set[int] = set()
    monkeypatch.setattr(tm.kernels, "settled", lambda names, m: m in orders)
    monkeypatch.setattr(tm.kernels, "compile", lambda new, _, names: orders.update(new))
    small = dataclasses.replace(capabilities, width=8, height=6)
    planner = Planner(small, tm.noise.Sensor(), SETTINGS)
    goal = Goal(capture_s=0.05, computing_share=0.9, estimator="likelihood")
    steps: list[str] = []

    found = planner.plan(
        goal, uniform_scene(4e5, [(2.0, 1.0)]), Progress(lambda share, step: steps.append(step))
    )

    share = found.recommended.computing_share
    assert share is not None
    assert 0 < share <= 0.9
    said = {step for step in steps if step.startswith("compiling")}
    assert said == {f"compiling kernels for m = {m}" for m in orders}
    assert found.recommended.applied.sequence.harmonics in orders


def test_a_budget_of_computing_time_affords_nothing_that_is_unknown() -> None:
    goal = Goal(computing_share=0.5)

    assert goal.affords(0.1, lambda: 0.05)
    assert not goal.affords(0.1, lambda: 0.06)
    assert not goal.affords(0.1, lambda: None)
    assert Goal(capture_s=1.0).affords(0.1, lambda: None)
