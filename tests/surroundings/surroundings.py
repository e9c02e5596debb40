"""What a program may find around it: a name, and how it is brought about in this process."""

import os
import pwd
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final
from unittest import mock

from tests.surroundings.verbs import SECRET

TEXTS: Final = {
    "blanks, quotes, brackets, per cent": "Größe 'a' \"b\" [/b] [link=y] [fe80::1] %20%zz",
    "controls, line ends, no UTF-8": "Größe\x1b[2J\x9b\u202e\nx\udcff",
    "an IPv6 address": "[::1]:1",
    "nothing": "",
}
"""What a user may give as a name, a path or an address."""


@contextmanager
def _environment(**variables: str | None) -> Iterator[None]:
    with mock.patch.dict(os.environ):
        for name, value in variables.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value
        yield


_HOMES: Final = dict.fromkeys(
    ("HOME", "XDG_CONFIG_HOME", "XDG_DATA_HOME", "XDG_CACHE_HOME", "STATE_DIRECTORY")
)


@contextmanager
def _nobody() -> Iterator[None]:
    """No password file knows the user, and no variable its home."""
    unknown = mock.Mock(side_effect=KeyError("uid not found"))
    with _environment(**_HOMES), mock.patch.multiple(pwd, getpwuid=unknown, getpwnam=unknown):
        yield


@contextmanager
def _gone() -> Iterator[None]:
    before = Path.cwd()
    with TemporaryDirectory() as folder:
        os.chdir(folder)
    try:
        yield
    finally:
        os.chdir(before)


@contextmanager
def _umask() -> Iterator[None]:
    before = os.umask(0o077)
    try:
        yield
    finally:
        os.umask(before)


@contextmanager
def _one_processor() -> Iterator[None]:
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {min(before)})
    try:
        yield
    finally:
        os.sched_setaffinity(0, before)


@contextmanager
def _settings(name: str, data: bytes) -> Iterator[None]:
    """The settings' file of the working directory holds these bytes."""
    file = Path(name)
    file.write_bytes(data)
    try:
        yield
    finally:
        file.unlink()


@dataclass(frozen=True)
class Surrounding:
    """A surrounding, how it is entered, and what stands on its streams."""

    name: str
    enter: Callable[[], AbstractContextManager[Any]]
    streams: dict[str, Any] = field(default_factory=dict)


NUMBERS: Final = ("nan", "inf", "-1", "1e308")
"""What a user may give as a number."""
_FULL: Final = Path("/dev/full").open("w", encoding="utf-8") if Path("/dev/full").exists() else None  # noqa: SIM115 - for as long as the process
_TOML: Final = 'camera = "sim:wall"  # Größe\n'
_CONFIG: Final = "transientcam.toml"
ALL: Final = (
    Surrounding("no HOME, unknown user", _nobody),
    Surrounding("HOME is not there", lambda: _environment(**_HOMES | {"HOME": "/nonexistent"})),
    Surrounding("HOME may not be written", lambda: _environment(**_HOMES | {"HOME": "/proc"})),
    Surrounding("HOME is relative", lambda: _environment(**_HOMES | {"HOME": "home"})),
    Surrounding("working directory deleted", _gone),
    Surrounding("umask 077", _umask),
    Surrounding("one processor", _one_processor),
    Surrounding("no TMPDIR", lambda: _environment(TMPDIR="/nonexistent")),
    Surrounding("PATH empty", lambda: _environment(PATH="")),
    Surrounding("TZ nonsense", lambda: _environment(TZ="Nowhere/Here")),
    Surrounding("token with LF", lambda: _environment(TRANSIENTCAM_TOKEN=f"{SECRET}\n")),
    Surrounding("token with CRLF", lambda: _environment(TRANSIENTCAM_TOKEN=f"{SECRET}\r\n")),
    Surrounding("token with a blank", lambda: _environment(TRANSIENTCAM_TOKEN=f" {SECRET} ")),
    Surrounding("token with an umlaut", lambda: _environment(TRANSIENTCAM_TOKEN=f"{SECRET}ü")),
    Surrounding("token empty", lambda: _environment(TRANSIENTCAM_TOKEN="")),
    Surrounding("standard output closed", _environment, {"instead": None}),
    Surrounding("standard output full", _environment, {"instead": _FULL}),
    Surrounding("ASCII streams", lambda: _environment(LANG="C"), {"encoding": "ascii"}),
    Surrounding("Latin-1 streams", lambda: _environment(LANG="de_DE"), {"encoding": "latin-1"}),
    Surrounding("terminal", lambda: _environment(TERM="xterm-256color"), {"terminal": True}),
    Surrounding("dumb terminal", lambda: _environment(TERM="dumb"), {"terminal": True}),
    Surrounding("20 columns", lambda: _environment(COLUMNS="20"), {"terminal": True}),
    Surrounding("COLUMNS=0", lambda: _environment(COLUMNS="0"), {"terminal": True}),
    Surrounding("COLUMNS nonsense", lambda: _environment(COLUMNS="x", LINES="-1")),
    Surrounding("NO_COLOR", lambda: _environment(NO_COLOR="1"), {"terminal": True}),
    Surrounding("FORCE_COLOR", lambda: _environment(FORCE_COLOR="1")),
    Surrounding("proxy without a scheme", lambda: _environment(HTTP_PROXY="lab", NO_PROXY="")),
    Surrounding("proxy of SOCKS", lambda: _environment(ALL_PROXY="socks5://h:1", NO_PROXY="")),
    Surrounding("proxy nonsense", lambda: _environment(HTTP_PROXY="foo://u:pw@[", NO_PROXY="")),
    Surrounding("NO_PROXY nonsense", lambda: _environment(NO_PROXY="[::1],::1/64,[")),
    Surrounding("no authorities", lambda: _environment(SSL_CERT_FILE="/nonexistent")),
    Surrounding("settings with a BOM", lambda: _settings(_CONFIG, _TOML.encode("utf-8-sig"))),
    Surrounding(
        "settings with CRLF", lambda: _settings(_CONFIG, _TOML.replace("\n", "\r\n").encode())
    ),
    Surrounding("settings in UTF-16", lambda: _settings(_CONFIG, _TOML.encode("utf-16"))),
    Surrounding("settings in Latin-1", lambda: _settings(_CONFIG, _TOML.encode("latin-1"))),
    Surrounding("settings empty", lambda: _settings(_CONFIG, b"")),
    Surrounding(
        "a service's links of Kubernetes",
        lambda: _environment(TRANSIENTCAM_PORT="tcp://10.0.0.1:8"),
    ),
)
