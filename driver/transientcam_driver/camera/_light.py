"""Whether a camera has a light, and what is to be known of it."""

from transientcam_driver.camera._camera import Camera


def has_light(camera: Camera) -> bool:
    """Whether there is a real light at this machine."""
    return camera.simulation is None and camera.off_switch is not None


def light_warning(camera: Camera) -> str | None:
    """Return what is to be known of a light that the camera does not switch off by itself.

    None where it does, and where there is no light at this machine.
    """
    switch = camera.off_switch
    if switch is None or not has_light(camera):
        return None
    if camera.capabilities.heartbeat_s or switch.ends_s:
        return None
    if switch.steps:
        return (
            "The camera has no watchdog. A supervisor switches its light off when this service "
            "dies or hangs; when this machine does, the light stays on until the camera has no "
            "power."
        )
    return (
        "The camera has no watchdog, and no other process can switch its light off: when this "
        "service dies or hangs, the light stays on until the camera has no power."
    )
