"""The former name of the module that finds and opens USB devices: the same module."""

import importlib
import sys

sys.modules[__name__] = importlib.import_module("transientcam_driver.cameras.open_usb._transport")
