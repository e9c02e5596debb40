"""Programs that import the transport by its former name find the module of today."""

import importlib

from transientcam_driver.cameras import open_usb


def test_the_former_name_is_the_same_module() -> None:
    former = importlib.import_module("transientcam_driver.usb")

    assert former is importlib.import_module(open_usb.open_transport.__module__)
    assert former.list_cameras is open_usb.list_cameras
