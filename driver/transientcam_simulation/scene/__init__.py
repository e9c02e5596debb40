"""What is in front of the simulated camera: surfaces, light, motions, and the files of scenes."""

from transientcam_simulation.scene._file import (
    BUILT_IN,
    SceneInfo,
    list_scenes,
    load_scene,
    parse_scene,
)
from transientcam_simulation.scene._geometry import (
    Bilinear,
    Cells,
    Ellipsoid,
    Points,
    Primitive,
    Rectangle,
    blocked_by_mask,
    cells_of,
    evenly,
)
from transientcam_simulation.scene._limits import most_patches, patch_edges_m, patches_of
from transientcam_simulation.scene._mesh import Mesh
from transientcam_simulation.scene._motion import Motion, speed_m_s
from transientcam_simulation.scene._scene import (
    Background,
    Diffuser,
    Light,
    ResponseFile,
    Scene,
    Shape,
    Surface,
    TimeZero,
    Viewpoint,
)
