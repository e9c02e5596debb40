"""A Texas Instruments OPT8241-CDK: raw quads at any frequency, over USB 2 (docs/opt8241.md).

`registers` and `pll` say what is set, `link` which requests carry it, `usb_link` sends them, and
`device` is a `TriggeredDevice` over a link.
"""

from transientcam_driver.opt8241.device import Opt8241
from transientcam_driver.opt8241.link import Link, Request

__all__ = ["Link", "Opt8241", "Request"]
