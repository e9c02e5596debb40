"""What raw images show, and how they become moments, as columns that every file of them carries.

A moment is ``c_j = sum_i weight_ji image_i / gain_j`` (docs/recordings.md). The columns are enough
to compute it without this software.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

import transientcam_moments as tm
from transientcam_driver import AppliedSequence, ImageLabel
from transientcam_server.imaging._recipe.calibration import Gains, nominal_gains

KINDS: Final = ("off", "on", "modulated")
"""What the light does in an image, by the codes of the column ``kind``."""
_DTYPES: Final[dict[object, str]] = {int: "<i4", float: "<f8", bool: "|u1"}
_UNITS: Final = {"frequency_hz": "Hz", "phase_rad": "rad", "exposure_s": "s"}


@dataclass(frozen=True, slots=True)
class Column:
    """Values with the names of their axes, and attributes as CF conventions have them."""

    axes: tuple[str, ...]
    values: NDArray[Any]
    attributes: Mapping[str, Any] = field(default_factory=dict)


def image_columns(labels: Sequence[ImageLabel]) -> dict[str, Column]:
    """Return what each image shows: the labels, and what the light does in it."""
    columns = {
        each.name: Column(
            ("image",),
            np.asarray([getattr(label, each.name) for label in labels], _DTYPES[each.type]),
            {"units": _UNITS[each.name]} if each.name in _UNITS else {},
        )
        for each in fields(ImageLabel)
        if each.name != "index"  # that is the axis
    }
    kinds = np.asarray([KINDS.index(label.kind) for label in labels], np.uint8)
    codes = np.arange(len(KINDS), dtype=np.uint8)
    attributes = {"flag_values": codes, "flag_meanings": " ".join(KINDS)}
    return columns | {"kind": Column(("image",), kinds, attributes)}


def moment_columns(
    applied: AppliedSequence, labels: Sequence[ImageLabel], gains: Gains | None
) -> dict[str, Column]:
    """Return how the images become moments: weights, gains, and how an exposure is divided.

    ``gain`` is nominal, (moment), where no ``gains`` were measured, else theirs, (moment, y, x),
    and then ``bad`` (y, x) says which pixels to replace by the mean of their neighbours, and
    ``waveform`` (modulated, odd) which harmonics of the modulation are known. Complex columns have
    twins of real numbers, ``weight_re`` and ``weight_im`` for one: Octave reads others as 0.
    """
    sequence = applied.sequence
    how = moment_labels(labels)
    nominal = {"long_name": "nominal gain: what sub-phases and delay give an ideal modulation"}
    measured = {"long_name": "measured gain"}
    columns = {
        "moment": Column(("moment",), np.array((0, *sequence.multiples), dtype=np.int32)),
        "weight": Column(
            ("moment", "image"),
            how.weight,
            {"long_name": "c_j = sum_i weight_ji image_i / gain_j, the mean over all takes"},
        ),
        "modulus": Column(
            ("moment",),
            how.modulus.astype(np.uint8),
            {"long_name": "1 where the modulus of the sum is the moment: b_0 at a low frequency"},
        ),
        "gain": Column(("moment",), nominal_gains(sequence, delay_s=applied.delay_s), nominal)
        if gains is None
        else Column(("moment", "y", "x")[: gains.planes.ndim], gains.planes, measured),
        "sub_phase_rad": Column(
            ("sub_phase",),
            np.asarray(sequence.sub_phases.phases_rad),
            {"units": "rad", "long_name": "phases that each modulated exposure is divided between"},
        ),
        "sub_phase_share": Column(
            ("sub_phase",),
            np.asarray(sequence.sub_phases.weights),
            {"units": "1", "long_name": "share of the exposure at each of these phases"},
        ),
    }
    if gains is not None and gains.bad is not None:
        says = {"long_name": "1 where the mean of the neighbours stands for a pixel"}
        columns["bad"] = Column(("y", "x"), gains.bad.astype(np.uint8), says)
    if gains is not None and gains.waveform is not None:
        columns |= _waveform_columns(gains.waveform)
    parts = parts_of({name: column.values for name, column in columns.items()})
    return columns | {
        name: replace(columns[name[:-3]], values=values) for name, values in parts.items()
    }


def parts_of(arrays: Mapping[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
    """Return the parts of the complex ones among arrays, under their names with _re and _im."""
    return {
        name + suffix: part(values)
        for name, values in arrays.items()
        if np.iscomplexobj(values)
        for suffix, part in (("_re", np.real), ("_im", np.imag))
    }


def _waveform_columns(waveform: NDArray[Any]) -> dict[str, Column]:
    modulated, odd = (np.arange(1, size + 1, dtype=np.int32) for size in waveform.shape)
    says = {"long_name": "harmonics of the modulation over its fundamental, at each moment from 1"}
    return {
        "modulated": Column(("modulated",), modulated),
        "odd": Column(("odd",), 2 * odd + 1),
        "waveform": Column(("modulated", "odd"), waveform, says),
    }


def moment_labels(labels: Sequence[ImageLabel]) -> tm.Labels:
    """Return the labels of images as the arithmetic takes them."""
    return tm.Labels(
        np.asarray([label.harmonic for label in labels]),
        np.asarray([label.phase_rad for label in labels]),
        np.asarray([label.frequency_hz for label in labels]),
        np.asarray([label.illumination for label in labels]),
        np.asarray([label.take for label in labels]),
    )


def in_words(column: Column) -> NDArray[Any]:
    """Return the values of a column, codes as the words they stand for: where no attributes go."""
    meanings = column.attributes.get("flag_meanings")
    if meanings is None:
        return column.values
    words: NDArray[Any] = np.asarray(str(meanings).split())[column.values]
    return words
