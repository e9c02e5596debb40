"""Announcements of others are read with suspicion."""

import sys
from typing import Any

import pytest
import zeroconf
from zeroconf import ServiceInfo

from transientcam import ParameterError, ServerUnreachable, discover
from transientcam.discovery import SERVICE_TYPE, read_announcement


def announced(
    *addresses: str,
    name: str = "lidar A-17",
    port: int = 8000,
    server: str = "bench.local.",
    **txt: str,
) -> ServiceInfo:
    return ServiceInfo(
        SERVICE_TYPE,
        f"{name}.{SERVICE_TYPE}",
        port=port,
        parsed_addresses=list(addresses),
        properties={**txt},
        server=server,
    )


def test_an_announcement_says_where_and_what() -> None:
    found = read_announcement(
        announced("192.168.7.5", path="/", api="v1", sn="A-17", fw="1.2", tls="0")
    )

    assert found is not None
    assert (found.name, found.url) == ("lidar A-17", "http://192.168.7.5:8000")
    assert (found.serial, found.firmware, found.api, found.tls) == ("A-17", "1.2", "v1", False)


def test_behind_tls_the_address_has_the_name_that_the_certificate_may_have() -> None:
    found = read_announcement(announced("192.168.7.5", tls="1"))

    assert found is not None
    assert found.url == "https://bench.local:8000"


def test_a_path_is_kept() -> None:
    found = read_announcement(announced("192.168.7.5", path="/lidar/"))

    assert found is not None
    assert found.url == "http://192.168.7.5:8000/lidar"


def test_an_ipv6_address_stands_in_brackets_and_is_the_second_choice() -> None:
    both = read_announcement(announced("fd00::2", "192.168.7.5"))
    six = read_announcement(announced("fd00::2"))

    assert both is not None
    assert six is not None
    assert (both.url, six.url) == ("http://192.168.7.5:8000", "http://[fd00::2]:8000")


def test_nothing_is_found_without_an_address_or_a_port() -> None:
    assert read_announcement(announced()) is None
    assert read_announcement(announced("192.168.7.5", port=0)) is None


def test_what_would_write_on_a_terminal_is_left_out() -> None:
    found = read_announcement(announced("192.168.7.5", sn="A\x1b[2J-17\n", path="javascript:x"))

    assert found is not None
    assert found.serial == "A[2J-17"
    assert found.url == "http://192.168.7.5:8000"


def test_an_empty_txt_record_is_no_failure() -> None:
    found = read_announcement(announced("192.168.7.5"))

    assert found is not None
    assert (found.serial, found.firmware, found.api) == ("", "", "")


@pytest.mark.parametrize(
    "arguments", [{"timeout_s": 0.0}, {"timeout_s": float("nan")}, {"interfaces": ["eth0"]}]
)
def test_arguments_that_cannot_be_used_are_named(arguments: dict[str, Any]) -> None:
    with pytest.raises(ParameterError, match=next(iter(arguments))):
        discover(**arguments)


def test_a_network_that_cannot_be_asked_is_an_error_of_ours(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def fail(**_: object) -> None:
        raise OSError(101, "Network is unreachable")

    monkeypatch.setattr(zeroconf, "Zeroconf", fail)

    with pytest.raises(ServerUnreachable, match="Network is unreachable"):
        discover(timeout_s=0.1)


def test_without_zeroconf_the_error_names_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "zeroconf", None)

    with pytest.raises(ModuleNotFoundError, match="zeroconf"):
        discover(timeout_s=0.1)
