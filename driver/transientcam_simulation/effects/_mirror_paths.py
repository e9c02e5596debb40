"""Mirror paths: light that comes to a surface over mirrors."""

from transientcam_simulation.effects._conditions import Call, Conditions, weigh
from transientcam_simulation.effects._effect import LightEffect


class MirrorPaths(LightEffect):
    """Further returns, by image points; costs nothing once the scene is traced."""

    name = "mirror-paths"
    what = "light over mirrors"

    @classmethod
    def called_for(cls, conditions: Conditions) -> Call:
        """Where mirrors send light to what the camera sees."""
        changes = conditions.changes(cls.name)
        if not changes:
            return Call(False, "no light comes over mirrors", 0.0, 0.0)
        return weigh(conditions, changes, "{share} of the pixels see light over mirrors")
