"""How settings are read, and where each mistake in them was made.

Command line over environment over file over default. ``TRANSIENTCAM_PORT=8765`` sets ``port``,
``TRANSIENTCAM_STREAM__MAX_CLIENTS=8`` the value ``max_clients`` of the table ``[stream]``. The file
is the one given with ``--config``, else ``./transientcam.toml``, else
``/etc/transientcam/transientcam.toml``.
"""

import json
import ssl
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Any, Final

from pydantic import BaseModel, ValidationError
from pydantic_settings import (
    BaseSettings,
    EnvSettingsSource,
    InitSettingsSource,
    PydanticBaseSettingsSource,
    SettingsConfigDict,
)

from transientcam_server.api.auth import TokenFile
from transientcam_server.errors import SettingsError
from transientcam_server.errors.exceptions import SettingsMistake, TokenFileError
from transientcam_server.settings import Settings

ENVIRONMENT_PREFIX: Final = "TRANSIENTCAM_"
OTHER_VARIABLES: Final = frozenset(
    f"{ENVIRONMENT_PREFIX}{name}" for name in ("TOKEN", "URL", "KERNELS", "TEST_DATA")
)
"""Those that begin so, too, but are not for the daemon's settings."""
DEFAULT_FILES: Final = (Path("transientcam.toml"), Path("/etc/transientcam/transientcam.toml"))
_UNKNOWN: Final = "there is no such setting"


@dataclass(frozen=True, slots=True)
class Configuration:
    """Settings, and where each of them was set."""

    settings: Settings
    places: "Places"


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

    Raises
    ------
    SettingsError
        Naming every value that cannot be used and where it was given.
    """
    loaded = _load(command_line, file=file, environment=environment)
    mistakes = [
        *_unsafe(loaded.settings, loaded.places),
        *_bad_certificate(loaded.settings, loaded.places),
    ]
    if mistakes:
        raise SettingsError(mistakes)
    return loaded


def tokens_file_of(file: Path | None, *, environment: Mapping[str, str]) -> Path:
    """Return where a service with these settings looks for its tokens.

    Raises
    ------
    SettingsError
        As `load_settings`, but it does not matter whether there are tokens yet.
    """
    return _load({}, file=file, environment=environment).settings.tokens_file


def _load(
    command_line: Mapping[str, Any], *, file: Path | None, environment: Mapping[str, str]
) -> Configuration:
    given = {name: value for name, value in command_line.items() if value is not None}
    path = file if file is not None else next((p for p in DEFAULT_FILES if p.is_file()), None)
    mistakes: list[SettingsMistake] = []
    from_file: dict[str, Any] = {}
    if path is not None:
        try:
            from_file = _read(path)
        except SettingsError as error:  # what stands elsewhere is looked at all the same
            mistakes += error.mistakes
    variables = _ours(environment)
    mistakes += _unusable_variables(variables)
    places = Places(given, variables, from_file, path)
    settings = None
    try:
        layers = _layers(given, variables, from_file)
        settings = Settings.model_validate(layers().model_dump())
    except ValidationError as error:
        mistakes += [_mistake(each, places) for each in error.errors()]
    if settings is None or mistakes:
        raise SettingsError(mistakes)
    return Configuration(settings, places)


def _read(path: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        reason = f"cannot be read: {error.strerror}"
        raise SettingsError([SettingsMistake(str(path), None, reason)]) from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise SettingsError([SettingsMistake(str(path), None, f"is no TOML: {error}")]) from error


# -- the environment ---------------------------------------------------------------------------


def _ours(environment: Mapping[str, str]) -> dict[str, str]:
    """Return the variables that are meant for these settings, by their names in capitals."""
    capitals = {name.upper(): value for name, value in environment.items()}
    return {
        name: value
        for name, value in capitals.items()
        if name.startswith(ENVIRONMENT_PREFIX) and name not in OTHER_VARIABLES
    }


def _unusable_variables(variables: dict[str, str]) -> list[SettingsMistake]:
    """Name the variables that no setting has, or that are no JSON where it is needed.

    They are taken out of ``variables``, so that what remains can be read.
    """
    mistakes = []
    for name in sorted(variables):
        field, _, rest = name.removeprefix(ENVIRONMENT_PREFIX).lower().partition("__")
        if field not in Settings.model_fields:
            known = [ENVIRONMENT_PREFIX + each.upper() for each in Settings.model_fields]
            reason = _UNKNOWN + _meant(name, known)
        elif not rest and _takes_json(field) and not _is_json(variables[name]):
            reason = 'must be JSON, as in ["a", "b"] for a list or {"a": 1} for a table'
        else:
            continue
        mistakes.append(SettingsMistake(name, variables.pop(name), reason))
    return mistakes


def _takes_json(field: str) -> bool:
    default = Settings.model_fields[field].get_default(call_default_factory=True)
    return isinstance(default, BaseModel | tuple)


def _is_json(text: str) -> bool:
    try:
        json.loads(text)
    except ValueError:
        return False
    return True


def _meant(name: str, known: list[str]) -> str:
    close = get_close_matches(name, known, n=1)
    return f"; did you mean {close[0]}?" if close else ""


def _layers(
    given: Mapping[str, Any], variables: Mapping[str, str], from_file: Mapping[str, Any]
) -> type[BaseSettings]:
    class Layers(Settings, BaseSettings):
        model_config = SettingsConfigDict(
            env_prefix=ENVIRONMENT_PREFIX, env_nested_delimiter="__", frozen=True, extra="forbid"
        )

        @classmethod
        def settings_customise_sources(
            cls, settings_cls: type[BaseSettings], *_: Any, **__: Any
        ) -> tuple[PydanticBaseSettingsSource, ...]:
            from_environment = EnvSettingsSource(settings_cls)
            # what was handed in, and not what this process happens to have
            from_environment.env_vars = {name.lower(): text for name, text in variables.items()}
            return (
                InitSettingsSource(settings_cls, init_kwargs=dict(given)),
                from_environment,
                InitSettingsSource(settings_cls, init_kwargs=dict(from_file)),
            )

    return Layers


# -- mistakes ----------------------------------------------------------------------------------


class Places:
    """Where a setting came from: the layer that wins, in the order they are asked."""

    def __init__(
        self,
        given: Mapping[str, Any],
        variables: Mapping[str, str],
        from_file: Mapping[str, Any],
        path: Path | None,
    ) -> None:
        self._given = given
        self._variables = variables
        self._from_file = from_file
        self._path = path

    def of(self, location: tuple[str, ...]) -> str:
        """Return where a setting was given, or is looked for where it was not given."""
        return self.given(location) or ".".join(location)

    def given(self, location: tuple[str, ...]) -> str | None:
        """Return where a setting was given; None where it has its default."""
        if location[0] in self._given:
            return f"--{location[0].replace('_', '-')}"
        for length in range(len(location), 0, -1):
            variable = ENVIRONMENT_PREFIX + "__".join(location[:length]).upper()
            if variable in self._variables:
                return variable
        stands: Any = self._from_file
        for part in location:
            if not isinstance(stands, dict) or part not in stands:
                return None
            stands = stands[part]
        return f"{self._path}: {'.'.join(location)}"


def _mistake(each: Any, places: Places) -> SettingsMistake:
    location = tuple(str(part) for part in each["loc"])
    # what is wrong with an item of a list is told of the list, of which the place is known
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
    """Find settings under which everybody or nobody would get in by mistake."""
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
            "whoever asks will need a token, and there is none: make one with "
            "`transientcam token create`; or listen on 127.0.0.1, or add --insecure to "
            "let anybody who reaches the port control the camera",
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
        context.load_cert_chain(settings.tls_certificate, settings.tls_key, password=_no_password)
    except OSError as error:  # what ssl raises is one, too
        reason = f"cannot be served: {error.strerror or error}"
        place = places.of(("tls_certificate",))
        yield SettingsMistake(place, str(settings.tls_certificate), reason)


def _no_password() -> str:
    """Keep ssl from asking a terminal that may not be there."""
    return ""
