"""What holds in every world, whatever goes wrong in it."""

import pytest

from tests.world.world import tried_all

SEEDS = 500
PARTS = 10


@pytest.mark.parametrize("part", range(PARTS))
def test_no_world_shows_a_violation(part: int) -> None:
    size = SEEDS // PARTS
    happened, violations = tried_all(range(part * size, (part + 1) * size))

    assert violations == []
    # the draws reach what they are about
    for each in (
        *("chunk", "disk", "safe-off", "relayed safe-off", "restart", "cut"),
        *("half open", "unplug", "unserved"),
    ):
        assert happened[each], each
