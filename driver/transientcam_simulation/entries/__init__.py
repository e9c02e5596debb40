"""The plug-ins of this package; each module is an entry of the group ``transientcam.cameras``."""
