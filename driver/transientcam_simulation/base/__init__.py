"""Values of the whole simulation: impulse responses, imperfections, normal numbers."""

from transientcam_simulation.base._giving_up import ask, giving_up_by
from transientcam_simulation.base._imperfections import (
    IDEAL,
    PINHOLE,
    PROFILES,
    STEADY,
    TYPICAL,
    TYPICAL_LENS,
    TYPICAL_OTHER_LIGHT,
    DarkCurrent,
    DeviceProfile,
    Drift,
    Lens,
    LensScatter,
    OtherLight,
    Outliers,
    Pattern,
    RollOff,
    Waveform,
)
from transientcam_simulation.base._normal import drawn_bins, drawn_tails, quantiles, standard_normal
from transientcam_simulation.base._responses import (
    BIN_S,
    Moments,
    Responses,
    Scatter,
    SparseResponses,
)
