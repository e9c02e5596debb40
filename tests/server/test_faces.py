"""The faces of the rooms: the few names that the rest of the daemon imports from each."""

from types import ModuleType

import pytest

from transientcam_experiments import paper, tradeoff
from transientcam_server import camera, offline, planning, recording


@pytest.mark.parametrize(
    "room",
    [camera, offline, paper, planning, recording, tradeoff],
    ids=lambda room: room.__name__,
)
def test_a_room_shows_three_to_eight_names_that_exist_and_says_what_it_is(room: ModuleType) -> None:
    assert 3 <= len(room.__all__) <= 8
    assert all(hasattr(room, name) for name in room.__all__)
    assert len(room.__doc__ or "") > 80
