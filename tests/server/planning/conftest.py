"""What tests of planning share."""

from collections.abc import Iterator

import pytest

from transientcam_driver import Capabilities, open_camera
from transientcam_driver.clock import VirtualClock


@pytest.fixture(scope="module")
def capabilities() -> Iterator[Capabilities]:
    with open_camera("sim:wall", clock=VirtualClock()) as opened:
        yield opened.capabilities
