"""What a capture costs, item by item."""

from typing import Any

from transientcam_driver import AppliedSequence


def price(applied: AppliedSequence, settling_s: float, computing_s: float | None) -> dict[str, Any]:
    """Return what a capture takes and leaves, item by item, as JSON."""
    light_s = applied.images * applied.sequence.exposure_s
    items = {
        "light_s": light_s,
        "readout_s": applied.capture_s - light_s - settling_s,
        "settling_s": settling_s,
        "transport_s": None,
        "computing_s": computing_s,
    }
    return items | {
        "sum_s": applied.capture_s + (computing_s or 0.0),
        "light_share": light_s / applied.capture_s,
        "data_bytes": round(applied.data_rate_bytes_s * applied.capture_s),
    }
