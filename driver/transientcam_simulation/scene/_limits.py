"""What a scene from elsewhere may cost: memory and time of its preparation stay bounded."""

from typing import Final

from transientcam_driver.errors import SceneError
from transientcam_simulation.scene._scene import Scene

MOST_SURFACES: Final = 32
MOST_MIRROR_PATHS: Final = 64
"""Chains of mirrors that light may take, each of which is followed."""
MOST_PATCHES: Final = 4096
"""Between scattering surfaces; the memory grows with the square of their number."""


def require_modest(scene: Scene) -> None:
    """Refuse a scene that would take much memory or time to prepare.

    Raises
    ------
    SceneError
        Naming the key, its value and the limit.
    """
    surfaces, transport = scene.surfaces, scene.transport
    if len(surfaces) > MOST_SURFACES:
        raise SceneError("the scene", "surface", len(surfaces), f"at most {MOST_SURFACES} tables")
    mirrors = sum(each.kind == "mirror" for each in surfaces)
    # no light goes from a plane mirror to itself
    paths = sum(
        mirrors * (mirrors - 1) ** (bounces - 1)
        for bounces in range(1, transport.mirror_bounces + 1)
    )
    if paths > MOST_MIRROR_PATHS:
        limit = f"fewer: {paths} chains of {mirrors} mirrors are more than {MOST_MIRROR_PATHS}"
        raise SceneError("the scene", "transport.mirror_bounces", transport.mirror_bounces, limit)
    scattering = sum(each.scatters for each in surfaces)
    if transport.diffuse_bounces != 0 and scattering * transport.patches**2 > MOST_PATCHES:
        most = int((MOST_PATCHES / scattering) ** 0.5)
        limit = f"at most {most} with {scattering} scattering surfaces, or diffuse_bounces = 0"
        raise SceneError("the scene", "transport.patches", transport.patches, limit)
