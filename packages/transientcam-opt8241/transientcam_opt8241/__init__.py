"""A Texas Instruments OPT8241-CDK: raw quads at any frequency, over USB 2 (docs/opt8241.md).

`registers` and `pll` say what is set, `link` which requests carry it, `usb_link` sends them, and
`device` is a `TriggeredDevice` over a link.
"""

from transientcam_opt8241 import _registers as registers
from transientcam_opt8241._device import (
    BITS,
    COLUMNS,
    DUTY_S,
    MOST_DUTY,
    PRODUCT,
    QUAD_S,
    QUADS,
    ROWS,
    Opt8241,
)
from transientcam_opt8241._link import Link, Request
from transientcam_opt8241._pll import CLOCK_HZ, PllSetting
from transientcam_opt8241._registers import REGISTER_BYTES, Field
from transientcam_opt8241._usb_link import SameCamera, list_cameras
