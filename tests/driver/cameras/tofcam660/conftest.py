"""An emulated TOFcam660 in front of a wall, without noise, which the tests of a file share."""

from collections.abc import Iterator
from dataclasses import dataclass

import pytest

from transientcam_driver import Simulation
from transientcam_driver.cameras.tofcam660 import CONTROL_PORT, DATA_PORT
from transientcam_driver.clock import RealClock
from transientcam_simulation.emulated import build_tofcam660, find_scene, without_noise
from transientcam_simulation.emulated._tofcam660 import EmulatedTofcam660

VENDOR_HOST = "127.0.66.60"
"""An address of its own: the vendor's client knows no other ports than the device's."""


@dataclass(frozen=True)
class Emulation:
    device: EmulatedTofcam660
    simulation: Simulation


def emulation(*, host: str = "127.0.0.1", fixed_ports: bool = False) -> Emulation:
    """Start an emulated camera; the caller closes its device."""
    ports = {"control_port": CONTROL_PORT, "data_port": DATA_PORT} if fixed_ports else {}
    device, simulation = build_tofcam660(
        without_noise(find_scene("wall")), seed=1, clock=RealClock(), host=host, **ports
    )
    return Emulation(device, simulation)


@pytest.fixture(scope="module")
def emulated() -> Iterator[Emulation]:
    made = emulation()
    yield made
    made.device.close()
