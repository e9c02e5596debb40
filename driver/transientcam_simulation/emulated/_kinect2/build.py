"""From a scene to an emulated Kinect v2 in front of it."""

import math
from dataclasses import replace
from typing import Final

import numpy as np

from transientcam_driver.cameras.kinect2 import (
    BITS,
    EXPOSURE_S,
    HEIGHT,
    IMAGE_PERIOD_S,
    STREAM_MULTIPLES,
    WIDTH,
    ZERO_DN,
    DepthParameters,
    P0Tables,
)
from transientcam_driver.clock import Clock
from transientcam_simulation.base import Lens
from transientcam_simulation.emulated._build import field_deg_of, world_before
from transientcam_simulation.emulated._handle import SimulationHandle
from transientcam_simulation.emulated._kinect2.device import EmulatedKinect2
from transientcam_simulation.emulated._kinect2.firmware import EmulatedFirmware
from transientcam_simulation.emulated._kinect2.pixels import DifferencePixels
from transientcam_simulation.scene import Scene

GAIN_E_PER_DN: Final = 4.0
"""A full well is then within the largest code; an assumption, as all noise is."""
LENS: Final = Lens((0.09, -0.27, 0.0, 0.0, 0.09))
"""About that of the devices whose parameters are published."""
_LARGEST_P0: Final = 0xFFFF


def build_kinect2(
    scene: Scene, *, seed: int | None, clock: Clock
) -> tuple[EmulatedKinect2, SimulationHandle]:
    """Build an emulated camera, and the handle on it.

    Raises SceneError where a file that the scene names cannot be read.
    """
    sensor = replace(scene.sensor, bits=BITS, gain_e_per_dn=GAIN_E_PER_DN, dark_dn=float(ZERO_DN))
    scene = replace(scene, sensor=sensor)
    world, prepare = world_before(
        scene,
        width=WIDTH,
        height=HEIGHT,
        seed=seed,
        readout_s=IMAGE_PERIOD_S - EXPOSURE_S,
        lens=LENS,
    )
    serial = f"SIM-{scene.device.name}-{scene.device.seed}"[:32]
    parameters, tables = reported_lens(field_deg_of(scene)), p0_tables(scene.device.seed)
    answers = parameters.pack(), tables.pack()

    pixels = DifferencePixels(world, tables.gains(), seed=scene.seed if seed is None else seed)
    device = EmulatedKinect2(lambda: EmulatedFirmware(serial, *answers), pixels, clock=clock)
    return device, SimulationHandle(scene, world, device, prepare=prepare)


def reported_lens(field_deg: float) -> DepthParameters:
    """Return what the device says of its lens; pixel (0, 0) has its centre at (0.5, 0.5)."""
    focal_px = 0.5 * WIDTH / math.tan(math.radians(field_deg) / 2)
    return DepthParameters(focal_px, focal_px, WIDTH / 2, HEIGHT / 2, *LENS.distortion)


def p0_tables(seed: int) -> P0Tables:
    """Return invented tables: smooth, different for each frequency, with a pattern of pixels."""
    random = np.random.default_rng(seed)
    y, x = np.mgrid[-1 : 1 : HEIGHT * 1j, -1 : 1 : WIDTH * 1j]
    tables = []
    for multiple in STREAM_MULTIPLES:
        smooth = 0.2 + 0.03 * multiple + 0.05 * (x * x + y * y) + 0.02 * x
        pattern = random.normal(0.0, 0.005, (HEIGHT, WIDTH))
        tables.append(np.clip((smooth + pattern) * _LARGEST_P0, 0, _LARGEST_P0))
    return P0Tables(np.rint(tables).astype(np.uint16))
