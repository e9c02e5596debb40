"""The server's checks of ``transientcam doctor --camera``: which products a camera cannot give.

Findings are tuples ``(level, check, message, remedy)``, as that verb's entry points yield them.
"""

from collections.abc import Iterator

from transientcam.cli.findings import Reported, absent_in_words
from transientcam_driver import DriverError, open_camera
from transientcam_server.imaging import absent_products
from transientcam_server.relay import RelayCamera


def checks(spec: str) -> Iterator[Reported]:
    """Open a camera, without its light, and list the products that its frames would not have."""
    try:
        with open_camera(spec) as camera:
            capabilities, simulated = camera.capabilities, camera.simulation is not None
            images_known = not isinstance(camera, RelayCamera) or camera.has_images
    except DriverError as error:
        yield "fault", "products", f"what the camera can do cannot be read: {error}", None
        return
    # a sensor is stated, or images tell their noise
    absent = absent_products(
        capabilities, truth_known=simulated, noise_known=True, images_known=images_known
    )
    for message in absent_in_words(absent):
        yield "ok", "products", message, None
