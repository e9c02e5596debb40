"""Announcements of others are read with suspicion."""

import sys
from contextlib import closing
from typing import Any

import pytest
import zeroconf
from zeroconf import ServiceInfo, Zeroconf

from transientcam import ParameterError, ServerUnreachable, discover, discovery
from transientcam.discovery import SERVICE_TYPE, read_announcement, search

LOOPBACK = ["127.0.0.1"]


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


def test_what_is_announced_is_bounded_and_cannot_change_the_address() -> None:
    found = read_announcement(
        announced(
            "192.168.7.5",
            server="evil.example/?.",
            tls="1",
            path='/a b"><script>',
            sn="x" * 240,
            state="on fire",
        )
    )

    assert found is not None
    assert found.url == "https://192.168.7.5:8000/a%20b%22%3E%3Cscript%3E"
    assert len(found.serial) == 64
    assert found.state == ""


def test_names_that_never_answer_do_not_hide_those_that_do() -> None:
    silent = [announced(name=f"silent {each}", server=f"none-{each}.local.") for each in range(8)]
    with closing(Zeroconf(interfaces=LOOPBACK)) as network:
        for each in (*silent, announced("192.168.7.5", name="talking", state="streaming")):
            network.registry.async_add(each)  # as registering does, after it has asked around
        while True:  # a laden machine answers late
            found = {each.name: each for each in discover(timeout_s=0.5, interfaces=LOOPBACK)}
            if "talking" in found:
                break

    assert found["talking"].state == "streaming"
    assert not [name for name in found if name.startswith("silent")]


def test_names_beyond_the_limit_are_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(discovery, "MAX_CAMERAS", 3)
    several = [announced("192.168.7.6", name=f"camera {each}") for each in range(5)]
    with closing(Zeroconf(interfaces=LOOPBACK)) as network:
        for each in several:
            network.registry.async_add(each)  # as registering does, after it has asked around
        while (found := search(timeout_s=0.5, interfaces=LOOPBACK)).left_out < 2:
            pass  # a laden machine answers late

    assert len(found.cameras) <= 3
