"""From a scene to an emulated TOFcam660 in front of it."""

from typing import Final

from transientcam_driver.cameras.tofcam660 import COLUMNS, DATA_PORT, READOUT_S, ROWS, SATURATED
from transientcam_driver.clock import Clock
from transientcam_simulation.base import Lens
from transientcam_simulation.emulated._build import world_before
from transientcam_simulation.emulated._handle import SimulationHandle
from transientcam_simulation.emulated._tofcam660.firmware import EmulatedFirmware
from transientcam_simulation.emulated._tofcam660.network import EmulatedTofcam660
from transientcam_simulation.emulated._two_taps import DifferentialPixels, with_bits
from transientcam_simulation.scene import Scene

_BITS = 12
LENS: Final = Lens((-0.16, 0.03, 0.0, 0.0, 0.0))
"""Chosen: a wide lens, which draws the corners in."""


def build_tofcam660(
    scene: Scene,
    *,
    seed: int | None,
    clock: Clock,
    host: str = "127.0.0.1",
    control_port: int = 0,
    data_port: int = 0,
    udp_port: int = DATA_PORT,
) -> tuple[EmulatedTofcam660, SimulationHandle]:
    """Build an emulated camera, which listens from now on, and the handle on it.

    Raises SceneError where a file that the scene names cannot be read; CameraError where a port
    cannot be had.
    """
    scene = with_bits(scene, _BITS)
    world, prepare = world_before(
        scene, width=COLUMNS, height=ROWS, seed=seed, readout_s=READOUT_S, lens=LENS
    )

    def power_on() -> EmulatedFirmware:
        begin_s = clock.now_s()
        pixels = DifferentialPixels(world, saturated=SATURATED)
        firmware = EmulatedFirmware(pixels, lambda: clock.now_s() - begin_s)
        pixels.expose_for(firmware.integration_us[0] * 1e-6)
        return firmware

    device = EmulatedTofcam660(
        power_on, host=host, control_port=control_port, data_port=data_port, udp_port=udp_port
    )
    return device, SimulationHandle(scene, world, device, prepare=prepare, taps=2)
