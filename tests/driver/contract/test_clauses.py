"""Each clause of the contract finds the camera that breaks it."""

from collections.abc import Callable
from typing import Any

import pytest

from tests.driver.cameras.triggered.scripted import Cable, ScriptedDevice
from transientcam_driver import AppliedSequence, RawFrame, Sequence, TriggeredCamera
from transientcam_driver.contract import CLAUSES, Bench, Clause, ContractBroken, ContractSkipped

BY_NAME = {each.name: each for each in CLAUSES}


class Honest(TriggeredCamera):
    """Breaks nothing; those below break one thing each."""


class OpensLit(Honest):
    def __init__(self, connect: Any, **named: Any) -> None:
        super().__init__(connect, **named)
        self._device.cable.lit = True  # type: ignore[attr-defined]


class LosesOrder(Honest):
    def read_frame(self, *, timeout_s: float = 10.0) -> RawFrame:
        frame = super().read_frame(timeout_s=timeout_s)
        self._number = 0
        return frame


class StaysLit(Honest):
    def stop(self) -> None:
        super().stop()
        self._device.cable.lit = True  # type: ignore[attr-defined]


class StopsSilently(Honest):
    def stop(self) -> None:
        pass


class FailsLate(Honest):
    def read_frame(self, *, timeout_s: float = 10.0) -> RawFrame:
        if timeout_s == 0.0 and self.state == "streaming":
            self.stop()
        return super().read_frame(timeout_s=timeout_s)


class DoesAnything(Honest):
    def validate(self, sequence: Sequence) -> AppliedSequence:
        return self.capabilities.apply(self.capabilities.nearest(sequence))


class KeepsEpoch(Honest):
    def configure(self, sequence: Sequence) -> AppliedSequence:
        self._epoch = 0
        return super().configure(sequence)


class HidesLosses(Honest):
    def _delivered(self, partial: Any) -> RawFrame:
        self._lost = 0
        return super()._delivered(partial)


class ForgetsToResume(Honest):
    def reconnect(self) -> None:
        self._resume = False
        super().reconnect()


class WorksOn(Honest):
    def close(self) -> None:
        self.stop()
        self._release.detach()


BROKEN = {
    "an-opened-camera-is-idle-and-dark": OpensLit,
    "frames-are-whole-labelled-and-in-order": LosesOrder,
    "stop-is-dark-and-start-goes-on": StaysLit,
    "stop-releases-a-waiting-reader": StopsSilently,
    "a-timeout-is-no-failure": FailsLate,
    "an-impossible-sequence-is-refused-by-name": DoesAnything,
    "a-new-sequence-has-a-new-epoch": KeepsEpoch,
    "lost-images-are-counted": HidesLosses,
    "an-unplugged-camera-is-lost-and-comes-back": ForgetsToResume,
    "a-closed-camera-is-dark-and-free": WorksOn,
}


def bench(kind: Callable[..., TriggeredCamera], *, read_s: float = 5.0) -> Bench:
    cable = Cable()

    def set_plugged(plugged: bool) -> None:
        cable.plugged = plugged

    def lose(camera: object) -> None:
        cable.groups_to_lose = 1

    return Bench(
        lambda: kind(lambda: ScriptedDevice(cable), clock=cable.clock),
        lit=lambda camera: cable.lit,
        unplug=lambda camera: set_plugged(False),
        replug=lambda camera: set_plugged(True),
        lose_image=lose,
        read_s=read_s,
    )


@pytest.mark.parametrize("clause", CLAUSES, ids=lambda each: each.name)
def test_an_honest_camera_keeps_every_clause(clause: Clause) -> None:
    assert clause.promise
    clause.run(bench(Honest))


@pytest.mark.parametrize("name", BROKEN)
def test_a_camera_that_breaks_a_clause_is_found(name: str) -> None:
    with pytest.raises(ContractBroken):
        BY_NAME[name].run(bench(BROKEN[name], read_s=0.2))


def test_every_clause_has_a_camera_that_breaks_it() -> None:
    assert BROKEN.keys() == BY_NAME.keys()


def test_what_cannot_happen_to_a_camera_is_skipped() -> None:
    alone = Bench(Cable().camera)
    for name in ("lost-images-are-counted", "an-unplugged-camera-is-lost-and-comes-back"):
        with pytest.raises(ContractSkipped):
            BY_NAME[name].run(alone)
