"""Light transport: from a scene to the impulse response of each pixel.

``paths`` follows rays and mirrors, ``still`` traces what stands still and the areas of its pixels,
``moving`` what moves, by ``bundle``s of lines and the ``coverage`` of pixels, as ``layers``;
``radiosity`` is diffuse interreflection, ``measured`` reads responses from files. ``facts`` leaves
effects out to see what they are worth; ``transport`` puts together what is called for, and
``shared`` keeps it for the next camera.
"""

from transientcam_simulation.light._bundle import Region, holds
from transientcam_simulation.light._compiler import load_compiled
from transientcam_simulation.light._measured import load_responses
from transientcam_simulation.light._shared import shared_scenery
from transientcam_simulation.light._transport import (
    GivenScenery,
    LightRequirements,
    Scenery,
    View,
    Views,
)
