"""Time-of-flight cameras of Luxonis, whose raw images the library depthai hands over."""

from transientcam_oak._device import FREQUENCIES_HZ, HEIGHT, MEASURED, WIDTH, Oak
