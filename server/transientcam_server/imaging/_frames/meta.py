"""What is known of a frame, as the wire contract has it."""

from dataclasses import asdict
from typing import Any

import transientcam_moments as tm
from transientcam_driver import RawFrame
from transientcam_server.imaging._errors_of_range.accuracy import RangeAccuracy
from transientcam_server.imaging._frames.stages import Computed
from transientcam_server.imaging._recipe.calibration import calibration_id
from transientcam_server.imaging._recipe.moment_frame import OF_IMAGES, MomentFrame
from transientcam_server.imaging._recipe.recipe import Recipe


def frame_meta(
    number: int,
    raw: RawFrame,
    recipe: Recipe,
    computed: Computed,
    reconstruct_s: float | None,
    accuracy: RangeAccuracy | None = None,
) -> dict[str, Any]:
    """Return the metadata of a frame, as far as it was computed; `FrameMeta` of the client."""
    sequence, found = recipe.applied.sequence, computed.reconstruction
    height, width = raw.images.shape[-2:]
    return {
        "frame": number,
        "sequence_id": raw.epoch,
        "calibration_id": calibration_id(recipe.gains),
        "reconstruction_id": recipe.settings_version,
        "estimator": recipe.technique,
        "device_time_s": raw.device_time_s,
        "host_time_s": raw.host_time_s,
        "capture_s": raw.capture_s,
        "reconstruct_s": reconstruct_s,
        "base_frequency_hz": sequence.base_frequency_hz,
        "harmonics": sequence.harmonics,
        "zeroth": sequence.zeroth,
        "exposure_s": sequence.exposure_s,
        "takes": sequence.takes,
        "width": width,
        "height": height,
        "temperature_c": raw.temperature_c,
        "lost_images": raw.lost_images,
        "hops": [asdict(hop) for hop in raw.hops],
        **_of_images(raw, found),
        "corrected_pixels": None if found is None else found.corrected_pixels,
        "pixels": computed.pixels,
        "ambient_dn": computed.ambient_dn,
        "predicted_range_std_m": computed.range_noise,
        "accuracy": None if accuracy is None else accuracy.to_document(),
    }


def _of_images(raw: RawFrame, found: tm.Reconstruction | None) -> dict[str, Any]:
    """Return what was done to the images before they became moments."""
    if isinstance(raw, MomentFrame):
        return dict(raw.treated)
    if found is None:
        return dict.fromkeys(OF_IMAGES)
    filled = [raw.index_of(take, place) for take, place in found.filled_images]
    counts = found.rejected_images, found.repaired_images, found.unrepaired_images, filled
    return dict(zip(OF_IMAGES, counts, strict=True))
