"""What each run of a verb would do anew, and takes two thirds of its time, is done once."""

import functools
import importlib.metadata
import os
import ssl
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest
from httpx._transports import default

import transientcam_moments as tm
from transientcam.cli import verbs


@functools.cache
def _context() -> ssl.SSLContext:
    return httpx.create_ssl_context()


def quick_context(*arguments: Any, **options: Any) -> ssl.SSLContext:
    """Return a context of TLS, made once where nothing of the environment changes it."""
    if "SSL_CERT_FILE" in os.environ:
        return httpx.create_ssl_context(*arguments, **options)
    return _context()


_NOT_FOR_DRIVERS = ("TRANSIENTCAM_", "TERM", "COLUMNS", "LINES", "NO_COLOR", "FORCE_COLOR", "SSL_")
_devices = tm.kernels.devices
_found: dict[Any, list[Any]] = {}


def quick_devices(check: int | None = None) -> list[Any]:
    """Return what another process finds, which is asked once in all that alters what it gets."""
    environment = {
        name: value
        for name, value in os.environ.items()
        if not name.startswith(_NOT_FOR_DRIVERS) and "PROXY" not in name
    }
    umask = os.umask(0)
    os.umask(umask)
    gets = (
        *(check, umask, Path("/proc/self/cwd").exists()),
        *(tuple(sorted(os.sched_getaffinity(0))), tuple(sorted(environment.items()))),
    )
    if gets not in _found:
        _found[gets] = _devices(check)
    return _found[gets]


quick_points = functools.cache(importlib.metadata.entry_points)


@pytest.fixture(scope="module", autouse=True)
def quick() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(default, "create_ssl_context", quick_context)
        patch.setattr(verbs, "entry_points", quick_points)
        patch.setattr(tm.kernels, "devices", quick_devices)
        yield
