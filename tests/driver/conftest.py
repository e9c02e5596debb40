"""Cameras on a simulated bus, in a time that passes only in waits."""

from collections.abc import Callable, Iterator
from contextlib import ExitStack

import pytest

from transientcam_driver import Camera, Simulation, open_camera
from transientcam_driver.clock import VirtualClock

OpenCamera = Callable[..., Camera]


@pytest.fixture
def clock() -> VirtualClock:
    return VirtualClock(start_s=1000.0, unix_s=1.7e9)


@pytest.fixture
def open_virtual(clock: VirtualClock) -> Iterator[OpenCamera]:
    """Open cameras that live in virtual time; they are closed at the end of the test."""
    with ExitStack() as stack:

        def open_(spec: str = "sim:mirrors") -> Camera:
            return stack.enter_context(open_camera(spec, clock=clock))

        yield open_


@pytest.fixture
def camera(open_virtual: OpenCamera) -> Camera:
    return open_virtual()


@pytest.fixture
def simulation(camera: Camera) -> Simulation:
    assert camera.simulation is not None
    return camera.simulation
