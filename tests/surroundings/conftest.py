"""What each run of a verb would do anew, and takes two thirds of its time, is done once."""

import functools
import importlib.metadata
import os
import ssl
from collections.abc import Iterator
from typing import Any

import httpx
import pytest
from httpx._transports import default

from transientcam.cli import verbs


@functools.cache
def _context() -> ssl.SSLContext:
    return httpx.create_ssl_context()


def quick_context(*arguments: Any, **options: Any) -> ssl.SSLContext:
    """Return a context of TLS, made once where nothing of the environment changes it."""
    if "SSL_CERT_FILE" in os.environ:
        return httpx.create_ssl_context(*arguments, **options)
    return _context()


quick_points = functools.cache(importlib.metadata.entry_points)


@pytest.fixture(scope="module", autouse=True)
def quick() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(default, "create_ssl_context", quick_context)
        patch.setattr(verbs, "entry_points", quick_points)
        yield
