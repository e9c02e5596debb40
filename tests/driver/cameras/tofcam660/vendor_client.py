"""Let the vendor's own client use a camera: ``python vendor_client.py HOST OUTPUT.npz``.

A process of its own, since that client changes logging for the whole process and registers what it
does at its end.
"""

import sys
from pathlib import Path
from typing import Any

import numpy as np
from epc import tofCam660  # type: ignore[import-not-found,unused-ignore]

FREE_MHZ = (7, 14, 21, 28, 3.5, 0.25)
PRESETS_MHZ = (24, 3)
INTEGRATION_US = 3000


def use(camera: Any) -> dict[str, Any]:
    """Do what a user does, and return what came of it."""
    found: dict[str, Any] = {}
    camera.initialize()
    found["chip"] = camera.device.get_chip_infos()
    found["firmware"] = camera.device.get_fw_version()
    found["temperature_c"] = camera.device.get_chip_temperature()
    camera.settings.set_integration_time(INTEGRATION_US)
    camera.settings.set_minimal_amplitude(1)
    found["integration_us"] = camera.settings.get_integration_time()["lowIntTime"]
    for megahertz in FREE_MHZ:
        camera.settings.set_flex_mod_freq(megahertz)
        distance_mm, amplitude = camera.get_distance_and_amplitude()
        found[f"free_{megahertz}_distance_mm"] = distance_mm
        found[f"free_{megahertz}_amplitude"] = amplitude
    found["dcs"] = camera.get_raw_dcs_images()
    for megahertz in PRESETS_MHZ:
        camera.settings.set_modulation(megahertz)
        found[f"preset_{megahertz}_distance_mm"] = camera.get_distance_image()
        found[f"preset_{megahertz}_amplitude"] = camera.get_amplitude_image()
    found["grayscale"] = camera.get_grayscale_image()
    camera.settings.set_roi((100, 90, 180, 150))
    found["region"] = camera.get_distance_image()
    camera.device.set_data_transfer_protocol("TCP")
    found["over"] = camera.device.get_data_transfer_protocol()
    found["region_over_tcp"] = camera.get_distance_image()
    camera.device.set_data_transfer_protocol("UDP")
    try:
        camera.settings.set_flex_mod_freq(40)
        found["refusal"] = ""
    except RuntimeError as error:
        found["refusal"] = str(error)
    return found


if __name__ == "__main__":
    opened: Any = tofCam660.TOFcam660(sys.argv[1])  # type: ignore[attr-defined,no-untyped-call,unused-ignore]
    np.savez(Path(sys.argv[2]), **use(opened))
