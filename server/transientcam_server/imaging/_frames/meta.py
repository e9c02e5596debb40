"""What is known of a frame, as the wire contract has it."""

from typing import cast

import transientcam_moments as tm
from transientcam.documents import FrameDocument, Neighbours
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
) -> FrameDocument:
    """Return the metadata of a frame, as far as it was computed."""
    sequence, found = recipe.applied.sequence, computed.reconstruction
    height, width = raw.images.shape[-2:]
    rejected, repaired, unrepaired, filled = _of_images(raw, found)
    return {
        "frame": number,
        "sequence_id": raw.epoch,
        "calibration_id": calibration_id(recipe.gains),
        "reconstruction_id": recipe.settings_version,
        "estimator": recipe.technique,
        "neighbours": None if found is None else cast("Neighbours", found.settings.neighbours),
        "device_time_s": raw.device_time_s,
        "host_time_s": raw.host_time_s,
        "captured_unix_s": raw.captured_unix_s,
        "capture_s": raw.capture_s,
        "reconstruct_s": reconstruct_s,
        "base_frequency_hz": sequence.base_frequency_hz,
        "harmonics": sequence.harmonics,
        "zeroth": sequence.zeroth,
        "exposure_s": sequence.exposure_s,
        "takes": sequence.takes,
        "width": width,
        "height": height,
        "extrinsics": None if recipe.intrinsics is None else recipe.intrinsics.extrinsics,
        "temperature_c": raw.temperature_c,
        "lost_images": raw.lost_images,
        "hops": [
            {
                "service_id": hop.service_id,
                "latency_s": hop.latency_s,
                "missed_frames": hop.missed_frames,
            }
            for hop in raw.hops
        ],
        "rejected_images": rejected,
        "repaired_images": repaired,
        "unrepaired_images": unrepaired,
        "filled_images": filled,
        "corrected_pixels": None if found is None else found.corrected_pixels,
        "pixels": computed.pixels,
        "ambient_dn": computed.ambient_dn,
        "frames_averaged": computed.frames_averaged,
        "predicted_range_std_m": computed.range_noise,
        "accuracy": None if accuracy is None else accuracy.to_document(),
    }


def _of_images(
    raw: RawFrame, found: tm.Reconstruction | None
) -> tuple[int | None, int | None, int | None, list[int] | None]:
    """Return what was done to the images before they became moments, as `OF_IMAGES` has it."""
    if isinstance(raw, MomentFrame):
        rejected, repaired, unrepaired, filled = (raw.treated[name] for name in OF_IMAGES)
        return rejected, repaired, unrepaired, filled
    if found is None:
        return None, None, None, None
    places = [raw.index_of(take, place) for take, place in found.filled_images]
    return found.rejected_images, found.repaired_images, found.unrepaired_images, places
