"""Cameras that stream once they are started: what is the same whichever device it is."""

from transientcam_driver.cameras.streamed._camera import READ_S, SLOW_S, StreamedCamera, same
