"""Capabilities of the simulated camera."""

from transientcam_driver.camera import IMAGE_HEADER_BYTES, Capabilities
from transientcam_driver.cameras.open_usb.protocol import VERSION


def prototype(*, serial: str, width: int, height: int, bits: int) -> Capabilities:
    """Describe a prototype like the paper's camera (Sec. 6), with more sequences to choose from."""
    return Capabilities(
        model="AMCW lidar (simulated)", serial=serial, firmware="1.0.0", protocol_version=VERSION,
        width=width, height=height, bits=bits, readout_s=3.73e-3, streaming_readout_s=3.98e-3,
        tuning_step_hz=0.25, min_frequency_hz=0.5e6, max_frequency_hz=150e6, low_frequency_hz=0.9e6,
        max_harmonics=32, min_exposure_s=20e-6, max_exposure_s=50e-3, max_takes=256,
        max_sub_phases=32, max_images=2048, schemes=("none", "arccos", "harmonic-cancellation"),
        zeroths=("on-off", "low-frequency", "estimated"), take_orders=("sequential", "interleaved"),
        fifo_bytes=32 * (IMAGE_HEADER_BYTES + width * height * 2), heartbeat_s=2.0,
        phase_offsets=True,
    )  # fmt: skip
