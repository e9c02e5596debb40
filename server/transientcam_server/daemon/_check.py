"""`transientcam serve --check`: what would be served, with which settings, from where."""

import json
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from pydantic import BaseModel

from transientcam_driver import DriverError
from transientcam_driver.camera import check_camera
from transientcam_server.camera import NO_CAMERA, load_given
from transientcam_server.daemon._configuration import Configuration
from transientcam_server.errors import ServerError, SettingsError, SettingsMistake


def require_usable(configuration: Configuration) -> None:
    """Read what the settings name, without opening a camera or listening.

    Raises SettingsError naming what cannot be read and where it was named.
    """
    settings = configuration.settings
    camera = None if settings.camera == NO_CAMERA else settings.camera
    mistakes = []
    named: list[tuple[str, Any, Callable[[Any], object]]] = [
        ("camera", camera, check_camera),
        ("calibration", settings.calibration, load_given),
    ]
    for name, value, read in named:
        if value is None:
            continue
        try:
            read(value)
        except (DriverError, ServerError, OSError) as error:
            place = configuration.places.of((name,))
            mistakes.append(SettingsMistake(place, str(value), str(error)))
    if mistakes:
        raise SettingsError(mistakes)


def to_document(configuration: Configuration) -> dict[str, Any]:
    """Return every setting with its value and where it was given (None: it has its default)."""
    values = configuration.settings.model_dump(mode="json")
    return {
        ".".join(location): {"value": value, "given": configuration.places.given(location)}
        for location, value in _leaves(values, configuration.settings)
    }


def to_toml(document: Mapping[str, Any]) -> Iterator[str]:
    """Return lines that would set the same in a file, each with where it was given."""
    for name, setting in document.items():
        given = setting["given"] or "default"
        if setting["value"] is None:  # TOML has no null
            yield f"# {name} is not set"
        else:
            # what JSON writes for these types is TOML, too
            yield f"{name} = {json.dumps(setting['value'], ensure_ascii=False)}  # {given}"


def mistakes_document(error: SettingsError) -> list[dict[str, Any]]:
    """Return what ``--json`` prints of settings that cannot be used."""
    return [
        {"place": each.place, "value": each.value, "reason": each.reason} for each in error.mistakes
    ]


def _leaves(
    values: Mapping[str, Any], model: BaseModel, above: tuple[str, ...] = ()
) -> Iterator[tuple[tuple[str, ...], Any]]:
    for name, value in values.items():
        below = getattr(model, name)
        if isinstance(below, BaseModel):
            yield from _leaves(value, below, (*above, name))
        else:
            yield (*above, name), value
