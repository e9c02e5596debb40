"""Cameras on a simulated bus, as the tests of the driver have them."""

from tests.driver.conftest import camera, clock, open_virtual, simulation

__all__ = ["camera", "clock", "open_virtual", "simulation"]
