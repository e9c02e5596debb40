"""Scenes without one effect of light, or without what moves."""

from dataclasses import replace

import numpy as np

from transientcam_simulation.scene import Scene

_AWAY = np.array([0.0, 0.0, -1e6])  # where surfaces that move are put while the rest is traced


def without_mirrors(scene: Scene) -> Scene:
    """Follow no light over mirrors, which then only cast shadows."""
    return replace(scene, transport=replace(scene.transport, mirror_bounces=0))


def without_glass(scene: Scene) -> Scene:
    """Take panes away."""
    return replace(scene, surfaces=tuple(each for each in scene.surfaces if not each.passes))


def without_gloss(scene: Scene) -> Scene:
    """Make all surfaces matt."""
    surfaces = tuple(replace(each, gloss=0.0) for each in scene.surfaces)
    return replace(scene, surfaces=surfaces)


def without_scattering(scene: Scene) -> Scene:
    """Let no light enter surfaces."""
    surfaces = tuple(replace(each, scatter=None) for each in scene.surfaces)
    return replace(scene, surfaces=surfaces)


def still_scene(scene: Scene) -> Scene:
    """Return the scene without what moves; surfaces keep their indices."""
    surfaces = tuple(
        replace(each, shape=each.primitive.moved(_AWAY), motions=()) if each.motions else each
        for each in scene.surfaces
    )
    return replace(scene, surfaces=surfaces)
