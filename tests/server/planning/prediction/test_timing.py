"""Computing time of sequences, and budgets of it."""

import dataclasses
from itertools import product

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
    assert seconds.once_compiled(sequence, "maximum-entropy") is not None
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
