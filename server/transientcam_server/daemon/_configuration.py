"""How settings are read, and where each mistake in them was made.

Command line over environment over file over default. ``TRANSIENTCAM_PORT=8765`` sets ``port``,
``TRANSIENTCAM_STREAM__MAX_CLIENTS=8`` the value ``max_clients`` of the table ``[stream]``. The file
is the one given with ``--config``, else ``./transientcam.toml``, else
``/etc/transientcam/transientcam.toml``.
"""

import json
import ssl
import tomllib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from difflib import get_close_matches
from pathlib import Path
from typing import Any, Final

from pydantic import BaseModel, ValidationError

from transientcam_driver.texts import read_text
from transientcam_server.api import TokenFile
from transientcam_server.errors import SettingsError, SettingsMistake, TokenFileError
from transientcam_server.relay import uses_token
from transientcam_server.settings import NO_HOME, Settings

ENVIRONMENT_PREFIX: Final = "TRANSIENTCAM_"
OTHER_VARIABLES: Final = frozenset(
    f"{ENVIRONMENT_PREFIX}{name}"
    for name in ("TOKEN", "RELAY_TOKEN", "URL", "KERNELS", "TEST_DATA")
)
"""Those that begin so, too, but are not for the daemon's settings."""
_LINKS: Final = ("TRANSIENTCAM_SERVICE_", "TRANSIENTCAM_PORT_")
"""Kubernetes sets these, and ``TRANSIENTCAM_PORT=tcp://…``, for a service of the same name."""
DEFAULT_FILES: Final = (Path("transientcam.toml"), Path("/etc/transientcam/transientcam.toml"))
_UNKNOWN: Final = "there is no such setting"
_Location = tuple[str, ...]
"""Of a setting: the tables it is in, and its name."""


@dataclass(frozen=True, slots=True)
class Places:
    """Where each setting was given."""

    by_location: Mapping[_Location, str]

    def of(self, location: _Location) -> str:
        """Return where a setting was given, or its name where it was not given."""
        return self.given(location) or ".".join(location)

    def given(self, location: _Location) -> str | None:
        """Return where a setting was given; None where it has its default."""
        return self.by_location.get(location)


@dataclass(frozen=True, slots=True)
class Configuration:
    """Settings, and where each of them was set."""

    settings: Settings
    places: Places


def load_settings(
    command_line: Mapping[str, Any], *, file: Path | None = None, environment: Mapping[str, str]
) -> Settings:
    """Return the settings of this process; see `load`."""
    return load(command_line, file=file, environment=environment).settings


def load(
    command_line: Mapping[str, Any], *, file: Path | None = None, environment: Mapping[str, str]
) -> Configuration:
    """Return the settings of this process, and where each was set.

    ``command_line`` holds what was given there (None: not given), ``file`` the file named there.
    Raises SettingsError naming every value that cannot be used and where it was given.
    """
    loaded = _load(command_line, file=file, environment=environment)
    mistakes = [
        *_homeless(loaded.settings),
        *_unsafe(loaded.settings, loaded.places),
        *_lent(loaded.settings, loaded.places, environment),
        *_bad_certificate(loaded.settings, loaded.places),
    ]
    if mistakes:
        raise SettingsError(mistakes)
    return loaded


def tokens_file_of(file: Path | None, *, environment: Mapping[str, str]) -> Path:
    """Return where a service with these settings looks for its tokens.

    Raises SettingsError as `load_settings`, but it does not matter whether there are tokens yet.
    """
    settings = _load({}, file=file, environment=environment).settings
    mistakes = [each for each in _homeless(settings) if each.place == "tokens_file"]
    if mistakes:
        raise SettingsError(mistakes)
    return settings.tokens_file


def _load(
    command_line: Mapping[str, Any], *, file: Path | None, environment: Mapping[str, str]
) -> Configuration:
    given = _MergedSettings()
    given.read_file(file)
    given.read_environment(environment)
    given.read_command_line(command_line)
    places = Places(given.places)
    try:
        settings = Settings.model_validate(given.values)
    except ValidationError as error:
        raise SettingsError(
            [*given.mistakes, *(_mistake(each, places) for each in error.errors())]
        ) from error
    if given.mistakes:
        raise SettingsError(given.mistakes)
    return Configuration(settings, places)


@dataclass
class _MergedSettings:
    """What was given, each source over those read before it, and where."""

    values: dict[str, Any] = field(default_factory=dict)
    places: dict[_Location, str] = field(default_factory=dict)
    mistakes: list[SettingsMistake] = field(default_factory=list)

    def read_file(self, path: Path | None) -> None:
        path = path or next((each for each in DEFAULT_FILES if each.is_file()), None)
        if path is None:
            return
        try:
            values = tomllib.loads(read_text(path))
        except OSError as error:
            self._refuse(str(path), None, f"cannot be read: {error.strerror}")
        except tomllib.TOMLDecodeError as error:
            self._refuse(str(path), None, f"is no TOML: {error}")
        except ValueError as error:
            self._refuse(str(path), None, str(error))
        else:
            self._merge(values, lambda location: f"{path}: {'.'.join(location)}")

    def read_environment(self, environment: Mapping[str, str]) -> None:
        variables = {name.upper(): text for name, text in environment.items()}
        for name, text in sorted(variables.items()):  # a table before its values
            other = name in OTHER_VARIABLES or name.startswith(_LINKS) or text.startswith("tcp://")
            if name.startswith(ENVIRONMENT_PREFIX) and not other:
                self._read_variable(name, text)

    def _read_variable(self, name: str, text: str) -> None:
        location = name.removeprefix(ENVIRONMENT_PREFIX).lower().split("__")
        if location[0] not in Settings.model_fields:
            known = [ENVIRONMENT_PREFIX + each.upper() for each in Settings.model_fields]
            self._refuse(name, text, _UNKNOWN + _meant(name, known))
            return
        try:
            value: Any = json.loads(text) if _takes_json(location) else text
        except ValueError:
            reason = 'must be JSON, as in ["a", "b"] for a list or {"a": 1} for a table'
            self._refuse(name, text, reason)
            return
        for part in reversed(location):
            value = {part: value}
        self._merge(value, lambda _: name)

    def read_command_line(self, options: Mapping[str, Any]) -> None:
        values = {name: value for name, value in options.items() if value is not None}
        self._merge(values, lambda location: f"--{location[0].replace('_', '-')}")

    def _merge(self, values: Mapping[str, Any], place_of: Callable[[_Location], str]) -> None:
        self.values = self._merged(self.values, values, (), place_of)

    def _merged(
        self,
        former: Any,
        values: Mapping[str, Any],
        above: _Location,
        place_of: Callable[[_Location], str],
    ) -> dict[str, Any]:
        merged = dict(former) if isinstance(former, dict) else {}
        for name, value in values.items():
            location = (*above, name)
            self.places[location] = place_of(location)
            if isinstance(value, dict):
                value = self._merged(merged.get(name), value, location, place_of)
            merged[name] = value
        return merged

    def _refuse(self, place: str, value: object, reason: str) -> None:
        self.mistakes.append(SettingsMistake(place, value, reason))


def _takes_json(location: list[str]) -> bool:
    """Return whether a setting is a list or a table, which a variable gives as JSON."""
    default: Any = Settings()
    for name in location:
        default = getattr(default, name, None)
    return isinstance(default, BaseModel | tuple)


def _homeless(settings: Settings) -> Iterator[SettingsMistake]:
    """Name directories that nobody set, where there is no home directory for their defaults."""
    variables = "set it, STATE_DIRECTORY or HOME"
    for place, path, remedy in (
        ("tokens_file", settings.tokens_file, "set it, XDG_CONFIG_HOME or HOME"),
        ("recordings.directory", settings.recordings.directory, variables),
        ("calibrations.directory", settings.calibrations.directory, variables),
        ("light.directory", settings.light.directory, variables),
    ):
        if NO_HOME in path.parents:
            yield SettingsMistake(place, None, f"this user has no home directory: {remedy}")


def _meant(name: str, known: list[str]) -> str:
    close = get_close_matches(name, known, n=1)
    return f"; did you mean {close[0]}?" if close else ""


# -- mistakes ----------------------------------------------------------------------------------


def _mistake(each: Any, places: Places) -> SettingsMistake:
    location = tuple(str(part) for part in each["loc"])
    # an item of a list has the place of the list
    known = tuple(part for part in location if not part.isdigit()) or ("settings",)
    reason = str(each["msg"])
    if each["type"] == "extra_forbidden":
        reason = _UNKNOWN + _meant(location[-1], _names_beside(location))
    return SettingsMistake(places.of(known), each["input"], reason)


def _names_beside(location: tuple[str, ...]) -> list[str]:
    """Return what may stand where something unknown stands."""
    model: type[BaseModel] = Settings
    for part in location[:-1]:
        annotation = model.model_fields[part].annotation if part in model.model_fields else None
        if not (isinstance(annotation, type) and issubclass(annotation, BaseModel)):
            return []
        model = annotation
    return list(model.model_fields)


def _unsafe(settings: Settings, places: Places) -> Iterator[SettingsMistake]:
    """Find settings that would admit every client, or none, unintentionally."""
    if settings.insecure and settings.require_token:
        yield SettingsMistake(places.of(("insecure",)), True, "contradicts require_token")
        return
    try:
        locked_out = settings.needs_token and not TokenFile(settings.tokens_file)
    except TokenFileError as error:
        place = places.of(("tokens_file",))
        yield SettingsMistake(place, str(settings.tokens_file), error.reason)
        return
    if locked_out:
        place, value = ("require_token", True) if settings.on_loopback else ("host", settings.host)
        yield SettingsMistake(
            places.of((place,)),
            value,
            "clients will need a token, and there is none: make one with "
            "`transientcam token create`; or listen on 127.0.0.1, or add --insecure to "
            "let every client that reaches the port control the camera",
        )


def _lent(
    settings: Settings, places: Places, environment: Mapping[str, str]
) -> Iterator[SettingsMistake]:
    """Find a relay that would show everybody what its own token shows it."""
    if settings.needs_token or settings.insecure or not uses_token(settings.camera, environment):
        return
    yield SettingsMistake(
        places.of(("camera",)),
        settings.camera,
        "the origin asks for a token, so ask clients for one, too: require_token (and "
        "`transientcam token create`); or add --insecure to lend the relay's to every user of "
        "this machine",
    )


def _bad_certificate(settings: Settings, places: Places) -> Iterator[SettingsMistake]:
    """Find a certificate that cannot be served."""
    if settings.tls_certificate is None:
        if settings.tls_key is not None:
            place = places.of(("tls_key",))
            yield SettingsMistake(place, str(settings.tls_key), "needs a certificate beside it")
        return
    try:
        context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
        # with a password ssl does not prompt for one, on a terminal that may not exist
        context.load_cert_chain(settings.tls_certificate, settings.tls_key, password="")
    except OSError as error:  # what ssl raises is one, too
        reason = f"cannot be served: {error.strerror or error}"
        place = places.of(("tls_certificate",))
        yield SettingsMistake(place, str(settings.tls_certificate), reason)
