"""The faces of the rooms: the few names that the rest of the daemon imports from each."""

import ast
import inspect
from types import ModuleType

import pytest

from transientcam_experiments import paper, tradeoff
from transientcam_server import (
    api,
    broadcast,
    camera,
    cli,
    daemon,
    errors,
    imaging,
    offline,
    planning,
    recording,
    relay,
)


@pytest.mark.parametrize(
    "room",
    [broadcast, camera, errors, imaging, offline, paper, planning, recording, relay, tradeoff],
    ids=lambda room: room.__name__,
)
def test_a_room_shows_three_to_eight_names_that_exist_and_says_what_it_is(room: ModuleType) -> None:
    assert 3 <= len(room.__all__) <= 8
    assert all(hasattr(room, name) for name in room.__all__)
    assert len(room.__doc__ or "") > 80


@pytest.mark.parametrize("room", [api, cli, daemon], ids=lambda room: room.__name__)
def test_a_room_of_entry_points_imports_nothing_before_one_is_entered(room: ModuleType) -> None:
    """Decision 23: a verb loads what it runs, not what its neighbours do."""
    (statement,) = ast.parse(inspect.getsource(room)).body
    assert isinstance(statement, ast.Expr)
    assert len(room.__doc__ or "") > 80
