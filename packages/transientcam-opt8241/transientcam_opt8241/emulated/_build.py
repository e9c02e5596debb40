"""From a scene to an emulated OPT8241-CDK in front of it."""

import math
from typing import Final

from transientcam_driver.clock import Clock
from transientcam_opt8241 import BITS, COLUMNS, DUTY_S, MOST_DUTY, QUAD_S, ROWS
from transientcam_opt8241.emulated._device import EmulatedOpt8241
from transientcam_simulation.base import Lens
from transientcam_simulation.emulated import (
    DifferentialPixels,
    SimulationHandle,
    with_bits,
    world_before,
)
from transientcam_simulation.scene import Scene

_SATURATED_DN = (1 << BITS) - 1
LENS: Final = Lens((-0.1, 0.05, 0.0, 0.0, -0.01))
"""Chosen: draws the corners in by a few pixels."""


def build_opt8241(
    scene: Scene, *, seed: int | None, clock: Clock, quads: int
) -> tuple[EmulatedOpt8241, SimulationHandle]:
    """Build an emulated camera, and the handle on it.

    Raises SceneError where a file that the scene names cannot be read.
    """
    scene = with_bits(scene, BITS)
    readout_s = QUAD_S - MOST_DUTY * DUTY_S
    world, prepare = world_before(
        scene, width=COLUMNS, height=ROWS, seed=seed, readout_s=readout_s, lens=LENS
    )
    phases_rad = tuple(2 * math.pi * k / quads for k in range(quads))
    pixels = DifferentialPixels(world, saturated=_SATURATED_DN, phases_rad=phases_rad)
    pixels.expose_for(MOST_DUTY * DUTY_S)
    serial = f"SIM-{scene.device.name}-{scene.device.seed}"[:32]
    device = EmulatedOpt8241(pixels, serial=serial, clock=clock)
    return device, SimulationHandle(scene, world, device, prepare=prepare, taps=2)
