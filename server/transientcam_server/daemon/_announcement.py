"""Announces the service on the local network (mDNS, DNS-SD: RFC 6762, RFC 6763).

What is announced, and how it is read: `transientcam.discovery`.
"""

import asyncio
import contextlib
import ipaddress
import logging
import os
import socket
from collections.abc import AsyncIterator, Callable, Mapping
from pathlib import Path
from typing import Final

import ifaddr
from zeroconf import Error, InterfaceChoice, ServiceInfo
from zeroconf.asyncio import AsyncZeroconf

from transientcam.discovery import SERVICE_TYPE, WEB_TYPE
from transientcam_driver import Capabilities
from transientcam_server.api import own_names
from transientcam_server.settings import Settings

_log = logging.getLogger("transientcam_server.daemon.announcement")
_LABEL_BYTES: Final = 63  # RFC 1035, 2.3.4
_TEXT_BYTES: Final = 200
"""Of a value in the TXT record, whose strings have at most 255 bytes (RFC 6763, 6.1)."""
STATE_EVERY_S: Final = 2.0
"""How often the state is looked at: each change of it is a packet for the whole network."""
_EVERYWHERE: Final = ("0.0.0.0", "::")  # noqa: S104 - compared with, not bound to
_MARKS_OF_CONTAINERS: Final = (".dockerenv", "run/.containerenv")
_VARIABLES_OF_CONTAINERS: Final = ("container", "KUBERNETES_SERVICE_HOST")


def enabled(settings: Settings, *, in_container: bool) -> bool:
    """Return whether to announce: ``auto`` is where other machines can reach the service.

    A container's network is mostly one of its own, in which no client listens.
    """
    if settings.announce == "auto":
        return not settings.on_loopback and not in_container
    return settings.announce == "on"


def inside_container(
    environment: Mapping[str, str] = os.environ, *, root: Path = Path("/")
) -> bool:
    """Return whether this process runs in a container, as far as containers show it."""
    marked = any((root / mark).exists() for mark in _MARKS_OF_CONTAINERS)
    return marked or any(name in environment for name in _VARIABLES_OF_CONTAINERS)


@contextlib.asynccontextmanager
async def announced(
    settings: Settings, capabilities: Capabilities, *, port: int, state: Callable[[], str]
) -> AsyncIterator[None]:
    """Announce the service within the block, if settings say so; failures are logged.

    ``state`` is what the camera does, one of `transientcam.discovery.STATES`.
    """
    if not enabled(settings, in_container=inside_container()):
        yield
        return
    # checking that the names are free takes more than a second, so the service does not wait for it
    announcing = asyncio.create_task(_announce(settings, capabilities, port, state))
    try:
        yield
    finally:
        announcing.cancel()
        await asyncio.gather(announcing, return_exceptions=True)


async def _announce(
    settings: Settings, capabilities: Capabilities, port: int, state: Callable[[], str]
) -> None:
    everywhere = settings.host in _EVERYWHERE
    interfaces = InterfaceChoice.All if everywhere else [_address(settings.host)]
    try:
        network = AsyncZeroconf(interfaces=interfaces)
    except OSError as error:
        _log.warning("the service is not announced: %s", error.strerror or error)
        return
    try:
        now = state()
        services = _services(settings, capabilities, port, now)
        for service in services:
            broadcast = await network.async_register_service(service, allow_name_change=True)
            await broadcast
            _log.info("announced as %s", service.name)
        while True:
            await asyncio.sleep(STATE_EVERY_S)
            if now != (now := state()):
                services = [_in_state(service, now) for service in services]
                for service in services:
                    await network.async_update_service(service)
    except (Error, OSError) as error:
        _log.warning("the service is not announced: %s", error)
    finally:
        await network.async_unregister_all_services()
        await network.async_close()


def _services(
    settings: Settings, capabilities: Capabilities, port: int, state: str
) -> list[ServiceInfo]:
    instance = _instance(f"{capabilities.model} {capabilities.serial}")
    properties = {
        "path": "/",
        "api": "v1",
        "model": _cut(capabilities.model, _TEXT_BYTES),
        "sn": _cut(capabilities.serial, _TEXT_BYTES),
        "fw": str(capabilities.firmware),
        "state": state,
        "tls": "0" if settings.tls_certificate is None else "1",
    }
    return [
        ServiceInfo(
            kind,
            f"{instance}.{kind}",
            port=port,
            parsed_addresses=_addresses(settings.host),
            properties=properties,
            server=f"{own_names()[-1]}.",
        )
        for kind in (SERVICE_TYPE, WEB_TYPE)
    ]


def _in_state(service: ServiceInfo, state: str) -> ServiceInfo:
    """Return a service under the name that it was given, in another state."""
    return ServiceInfo(
        service.type,
        service.name,
        port=service.port,
        addresses=service.addresses,
        properties=service.decoded_properties | {"state": state},
        server=service.server,
    )


def _cut(text: str, size_bytes: int) -> str:
    return text.encode()[:size_bytes].decode(errors="ignore")


def _instance(name: str) -> str:
    """Return ``name`` as one label of a domain name."""
    return _cut(name.replace(".", "-"), _LABEL_BYTES)


def _addresses(host: str) -> list[str]:
    """Return where the service can be reached."""
    if host not in _EVERYWHERE:
        return [_address(host)]
    found = [str(ip.ip[0] if ip.is_IPv6 else ip.ip) for a in ifaddr.get_adapters() for ip in a.ips]
    return [each for each in found if _is_ours_alone(each)] or ["127.0.0.1"]


def _is_ours_alone(address: str) -> bool:
    """Return whether an address means this machine on every other machine, too."""
    ip = ipaddress.ip_address(address)
    return not ip.is_loopback and not (ip.version == 6 and ip.is_link_local)


def _address(host: str) -> str:
    """Return the address that a name stands for; addresses stand for themselves."""
    return str(socket.getaddrinfo(host, None, type=socket.SOCK_STREAM)[0][4][0])
