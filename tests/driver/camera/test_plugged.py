"""A name opens one camera and no other, whatever is plugged in and out."""

from dataclasses import replace

import pytest
from hypothesis import given, strategies as st

from transientcam_driver.camera import Plugged, SameDevice, listed
from transientcam_driver.errors import CameraError, CameraLost, CameraNotFound, PermissionDenied

PORTS = 4
DENIED = PermissionDenied("/dev/bus/usb/001/001", "rule")


class Bus:
    """Cameras with serial numbers, each at a port of its own; a look sees those plugged in."""

    def __init__(self, serials: list[str]) -> None:
        self.cameras = {
            f"@1-{port}": Plugged(f"@1-{port}", serial, f"/dev/{port}", port)
            for port, serial in enumerate(serials)
        }
        self.out: set[str] = set()
        self.closed: set[str] = set()

    def look(self) -> list[Plugged]:
        there = (each for place, each in self.cameras.items() if place not in self.out)
        return [
            replace(each, serial="", problem=DENIED) if each.place in self.closed else each
            for each in there
        ]

    def named(self, name: str | None) -> SameDevice[int]:
        return SameDevice("usb", name, self.look, lambda each, suffix: each.device)


SERIALS = st.lists(st.sampled_from(["0001", "0002", ""]), min_size=1, max_size=PORTS)
PLACES = st.integers(0, PORTS - 1).map(lambda port: f"@1-{port}")
STEPS = st.lists(st.tuples(st.sampled_from(["plug", "permit", "lose"]), PLACES), max_size=12)


@given(SERIALS, STEPS, st.data())
def test_a_name_never_opens_another_camera_than_before(
    serials: list[str], steps: list[tuple[str, str]], data: st.DataObject
) -> None:
    bus = Bus(serials)
    names = [each.spec.removeprefix("usb:") for each in listed("usb", bus.look())]
    assert len(set(names)) == len(names)
    name = data.draw(st.sampled_from(names))
    opened = bus.named(name)
    mine = opened()
    assert mine == names.index(name)

    for step, place in steps:
        if step == "lose":
            there = f"@1-{mine}" not in bus.out | bus.closed
            try:
                assert opened() == mine
                assert there
            except CameraError:
                assert not there
        else:
            (bus.out if step == "plug" else bus.closed).symmetric_difference_update({place})


def test_a_serial_number_of_several_is_no_name() -> None:
    bus = Bus(["0001", "0002", "0001"])

    with pytest.raises(CameraError, match="usb:@1-0 or usb:@1-2"):
        bus.named("0001")()


def test_one_that_may_not_be_opened_is_named_as_the_trouble_and_the_next_one_taken() -> None:
    bus = Bus(["0001", "0002"])
    bus.closed = {"@1-0"}

    assert bus.named(None)() == 1
    with pytest.raises(PermissionDenied):
        bus.named("0001")()
    with pytest.raises(PermissionDenied):
        bus.named("@1-0")()
    with pytest.raises(CameraNotFound):
        bus.named("@1-7")()


def test_one_that_is_unplugged_meanwhile_is_not_found() -> None:
    def gone(each: Plugged, suffix: str) -> int:
        raise CameraLost("it was unplugged")

    with pytest.raises(CameraNotFound):
        SameDevice("usb", None, Bus(["0001"]).look, gone)()


def test_what_tells_it_apart_stands_behind_its_number() -> None:
    seen = []
    bus = Bus(["0001", "0001", ""])
    for name in ("@1-1", "@1-2"):
        SameDevice("usb", name, bus.look, lambda each, suffix: seen.append(suffix))()

    assert seen == ["@1-1", "@1-2"]


def test_one_with_a_number_comes_back_elsewhere_but_a_twin_that_was_there_is_not_it() -> None:
    bus = Bus(["0001", "0001", "0001"])
    bus.out = {"@1-1", "@1-2"}
    opened = bus.named("0001")
    opened()
    bus.out = {"@1-0", "@1-2"}  # its twin, plugged in while it worked
    with pytest.raises(CameraNotFound):
        opened()

    bus.out = {"@1-0"}

    assert opened() == 2
