"""Scenes without one effect of light."""

from dataclasses import replace

from transientcam_simulation.scene import Scene


def without_mirrors(scene: Scene) -> Scene:
    """Follow no light over mirrors, which then only cast shadows."""
    return replace(scene, transport=replace(scene.transport, mirror_bounces=0))


def without_gloss(scene: Scene) -> Scene:
    """Make all surfaces matt."""
    surfaces = tuple(replace(each, gloss=0.0) for each in scene.surfaces)
    return replace(scene, surfaces=surfaces)


def without_scattering(scene: Scene) -> Scene:
    """Let no light enter surfaces."""
    surfaces = tuple(replace(each, scatter=None) for each in scene.surfaces)
    return replace(scene, surfaces=surfaces)
