"""What can be set, and what limits there are, described by itself: for people who build panels.

Limits are those of validation. Where one depends on other values, as the number of takes on that
of frequencies, it is the limit while those stay as they are.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import replace
from functools import cache
from typing import Any, Final

from pydantic import BaseModel

from transientcam_driver import Capabilities, Sequence, SequenceError
from transientcam_server.api._documents.camera import AcquisitionRequest
from transientcam_server.api._documents.parameters import Access, ParameterDocument
from transientcam_server.api._documents.sequence import SequenceDocument, SubPhasesDocument
from transientcam_server.errors import Problem
from transientcam_server.imaging import require_estimator
from transientcam_server.settings import HistorySettings, ReconstructionSettings, RecordingSettings

_UNITS: Final = {"_hz": "Hz", "_s": "s", "seconds": "s", "_px": "px", "_dn": "DN", "bytes": "B"}


def of_sequence(
    sequence: Sequence, capabilities: Capabilities, *, least_harmonics: int, access: Access
) -> Iterator[ParameterDocument]:
    """Describe what a camera may be set to, one value at a time from the present sequence.

    ``least_harmonics`` are those that the reconstruction needs.
    """

    def accepts(changed: Callable[[], Sequence]) -> bool:
        try:
            capabilities.validate(changed())
        except SequenceError:
            return False
        return True

    def with_sub_phases(**changes: Any) -> Sequence:
        return replace(sequence, sub_phases=replace(sequence.sub_phases, **changes))

    most_harmonics = max(
        m
        for m in range(1, capabilities.max_harmonics + 1)
        if m == sequence.harmonics or accepts(lambda: replace(sequence, harmonics=m))  # noqa: B023 - called now
    )
    least_harmonics = len(capabilities.sampling.multiples) or least_harmonics
    word = capabilities.tuning_word(capabilities.max_frequency_hz) // sequence.multiples[-1]
    ranges: dict[str, tuple[float, float]] = {
        "base_frequency_hz": (capabilities.min_frequency_hz, capabilities.frequency_hz(word)),
        "harmonics": (least_harmonics, most_harmonics),
        "exposure_s": (capabilities.min_exposure_s, capabilities.max_exposure_s),
        "takes": (
            1,
            min(capabilities.max_takes, capabilities.max_images // sequence.images_per_take),
        ),
        "sub_phases.n": (
            1,
            1 if sequence.sub_phases.scheme == "none" else capabilities.max_sub_phases,
        ),
    }
    lists: dict[str, list[object]] = {
        "zeroth": [
            each
            for each in capabilities.zeroths
            if accepts(lambda: replace(sequence, zeroth=each))  # noqa: B023 - called now
        ],
        "take_order": list(capabilities.take_orders),
        "sub_phases.scheme": [
            each
            for each in capabilities.schemes
            if accepts(lambda: with_sub_phases(scheme=each))  # noqa: B023 - called now
        ],
    }
    described = {
        **_described(SequenceDocument, leave_out=("sub_phases", "sampling")),
        **{f"sub_phases.{key}": each for key, each in _described(SubPhasesDocument).items()},
    }
    document = sequence.to_document()
    values = {**document, **{f"sub_phases.{k}": v for k, v in document["sub_phases"].items()}}
    for name, schema in described.items():
        least, most = ranges.get(name, (None, None))
        yield ParameterDocument(
            name=f"sequence.{name}",
            resource="/api/v1/sequence",
            pointer="/" + name.replace(".", "/"),
            value=values[name],
            type=schema["type"],
            unit=_unit(name),
            min=least,
            max=most,
            allowed=lists.get(name),
            access="read-only" if name in ranges and least == most else access,
            description=schema["description"],
        )


def of_reconstruction(
    settings: ReconstructionSettings, sequence: Sequence
) -> Iterator[ParameterDocument]:
    """Describe the settings of the reconstruction, for the frequencies of a sequence."""
    described = _of_model(
        "reconstruction", "/api/v1/reconstruction", ReconstructionSettings, settings.model_dump()
    )
    for each in described:
        if each.name == "reconstruction.estimator" and each.allowed is not None:
            allowed = list(_estimators(settings, each.allowed, sequence))
            yield each.model_copy(update={"allowed": allowed})
        else:
            yield each


def _estimators(
    settings: ReconstructionSettings, names: Iterable[object], sequence: Sequence
) -> Iterator[object]:
    """Yield the estimators that go with a sequence."""
    for name in names:
        with suppress(Problem):
            changed = settings.model_copy(update={"estimator": name})
            require_estimator(changed, sequence, field="estimator")
            yield name


def of_acquisition(*, running: bool) -> Iterator[ParameterDocument]:
    """Describe whether frames are captured."""
    values = {"running": running}
    return _of_model("acquisition", "/api/v1/acquisition", AcquisitionRequest, values)


def of_history(settings: HistorySettings) -> Iterator[ParameterDocument]:
    """Describe how long frames can still be had."""
    return _of_model(
        "history",
        "/api/v1/frames",
        HistorySettings,
        settings.model_dump(),
        pointers={"seconds": "/limit_seconds", "max_bytes": "/limit_bytes"},
        access="read-only",
    )


def of_recordings(settings: RecordingSettings) -> Iterator[ParameterDocument]:
    """Describe when recordings end by themselves."""
    limits = ("max_duration_s", "max_bytes", "min_free_bytes", "max_upload_bytes")
    return _of_model(
        "recordings",
        "/api/v1/recordings",
        RecordingSettings,
        settings.model_dump(include=set(limits)),
        pointers={name: f"/limits/{name}" for name in limits},
        access="read-only",
    )


def _of_model(
    prefix: str,
    resource: str,
    model: type[BaseModel],
    values: Mapping[str, Any],
    *,
    pointers: Mapping[str, str] | None = None,
    access: Access = "read-write",
) -> Iterator[ParameterDocument]:
    """Describe the fields of a model, whose schema is what validates them."""
    for name, schema in _described(model).items():
        if name in values:
            yield ParameterDocument(
                name=f"{prefix}.{name}",
                resource=resource,
                pointer=(pointers or {}).get(name, f"/{name}"),
                value=values[name],
                type=schema["type"],
                unit=_unit(name),
                min=schema.get("minimum"),
                max=schema.get("maximum"),
                allowed=schema.get("enum"),
                access=access,
                description=schema["description"],
            )


def _described(model: type[BaseModel], *, leave_out: Iterable[str] = ()) -> dict[str, Any]:
    """Return the schema of each field of a model; of one that may be null that of its value."""
    fields = {}
    for name, schema in _properties(model).items():
        if name in leave_out:
            continue
        inner: dict[str, Any] = next(
            (each for each in schema.get("anyOf", ()) if each["type"] != "null"), {}
        )
        fields[name] = {"description": "", **schema, **inner}
    return fields


@cache
def _properties(model: type[BaseModel]) -> Mapping[str, Any]:
    """Return the schemas of a model's fields, which take a millisecond to make."""
    properties: dict[str, Any] = model.model_json_schema()["properties"]
    return properties


def _unit(name: str) -> str | None:
    return next((unit for suffix, unit in _UNITS.items() if name.endswith(suffix)), None)
