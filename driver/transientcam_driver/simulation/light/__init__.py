"""Light transport: from a scene to the impulse response of each pixel.

``paths`` follows rays and mirrors, ``moving`` what moves, ``radiosity`` diffuse interreflection,
``mixed_pixels`` the pixels at edges; ``measured`` reads responses from files. ``transport`` puts
together what is called for.
"""

from transientcam_driver.simulation.light.measured import load_responses
from transientcam_driver.simulation.light.transport import (
    GivenScenery,
    Scenery,
    SurfaceScenery,
    View,
    ViewAt,
)

__all__ = ["GivenScenery", "Scenery", "SurfaceScenery", "View", "ViewAt", "load_responses"]
