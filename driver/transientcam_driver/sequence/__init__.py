"""What is captured: the sequence of frequencies and phases, and how the sensor samples it."""

from transientcam_driver.sequence._sampling import (
    FOUR_PHASES_RAD,
    MAX_HARMONICS,
    MAX_MULTIPLE,
    Sampling,
)
from transientcam_driver.sequence._sequence import (
    DERIVED_FIELDS,
    LOW_FREQUENCY_HZ,
    READ_ONLY_FIELDS,
    SPEED_OF_LIGHT_M_S,
    ImageLabel,
    Scheme,
    Sequence,
    SubPhases,
    TakeOrder,
    Zeroth,
)
