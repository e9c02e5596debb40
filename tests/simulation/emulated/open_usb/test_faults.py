"""What happens to packets on a bad cable, byte by byte."""

import pytest

from transientcam_simulation.emulated._open_usb.faults import Fault, FaultyCable

PACKETS = [bytes([number]) * 200 for number in range(4)]


def transfers(*faults: Fault, images: int = 1) -> list[bytes | None]:
    """What arrives of four packets."""
    cable, arrived = FaultyCable(), []
    for fault in faults:
        cable.inject(fault, images)
    for packet in PACKETS:
        cable.carry(packet)
        while cable:
            arrived.append(cable.take())
    return arrived


def test_a_good_cable_changes_nothing() -> None:
    assert transfers() == PACKETS


@pytest.mark.parametrize(
    ("fault", "expected"),
    [
        (Fault.DROP, PACKETS[1:]),
        (Fault.SHORTEN, [PACKETS[0][:100], *PACKETS[1:]]),
        (Fault.DUPLICATE, [PACKETS[0], *PACKETS]),
        (Fault.SWAP, [PACKETS[1], PACKETS[0], *PACKETS[2:]]),
        (Fault.BABBLE, [None, *PACKETS[1:]]),
    ],
)
def test_a_fault_happens_to_the_next_packet(fault: Fault, expected: list[bytes | None]) -> None:
    assert transfers(fault) == expected


@pytest.mark.parametrize(
    ("fault", "places"), [(Fault.CORRUPT_HEADER, range(64)), (Fault.CORRUPT_PIXELS, range(64, 200))]
)
def test_a_corrupt_packet_differs_in_one_place(fault: Fault, places: range) -> None:
    damaged, *others = transfers(fault)

    assert damaged is not None
    different = [at for at in range(200) if damaged[at] != PACKETS[0][at]]
    assert len(different) == 1
    assert different[0] in places
    assert others == PACKETS[1:]


def test_faults_take_their_turns() -> None:
    assert transfers(Fault.DROP, Fault.DUPLICATE) == [PACKETS[1], *PACKETS[1:]]
    assert transfers(Fault.DROP, images=3) == PACKETS[3:]


def test_what_is_held_back_is_forgotten_with_the_stream() -> None:
    cable = FaultyCable()
    cable.inject(Fault.SWAP, 1)
    cable.carry(PACKETS[0])
    cable.clear()
    cable.carry(PACKETS[1])

    assert cable.take() == PACKETS[1]
    assert not cable
