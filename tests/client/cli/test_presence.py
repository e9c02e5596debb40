"""What `transientcam devices --watch` says of daemons that come and go."""

from collections.abc import Iterator
from datetime import datetime

import pytest

from transientcam.cli.devices import MISSED, Presence, print_changes
from transientcam.discovery import FoundCamera

BENCH = FoundCamera("bench", "http://192.168.1.20:8000", "TC-0007", "1.0", "v1", tls=False)
ROOF = FoundCamera("roof", "http://192.168.1.21:8000", "", "", "v1", tls=False)


def test_a_daemon_is_here_once_and_gone_after_several_searches_without_it() -> None:
    presence = Presence()
    assert list(presence.update([ROOF, BENCH])) == [("here", BENCH), ("here", ROOF)]
    for _ in range(MISSED - 1):
        assert list(presence.update([ROOF])) == []
    assert list(presence.update([ROOF])) == [("gone", BENCH)]
    assert list(presence.update([BENCH, ROOF])) == [("here", BENCH)]


def test_one_answer_in_time_keeps_a_daemon() -> None:
    presence = Presence()
    changes = [list(presence.update(found)) for found in ([BENCH], [], [], [BENCH], [], [])]
    assert changes == [[("here", BENCH)], [], [], [], [], []]


@pytest.mark.parametrize("as_json", [False, True])
def test_each_change_is_a_line(capsys: pytest.CaptureFixture[str], as_json: bool) -> None:
    searches: Iterator[tuple[FoundCamera, ...]] = iter([(BENCH,)])

    def search() -> tuple[FoundCamera, ...]:
        try:
            return next(searches)
        except StopIteration:
            raise KeyboardInterrupt from None

    with pytest.raises(KeyboardInterrupt):
        print_changes(search, now=lambda: datetime(2026, 11, 22, 9, 14, 3), as_json=as_json)
    (line,) = capsys.readouterr().out.splitlines()
    if as_json:
        assert line.startswith('{"time": "2026-11-22 09:14:03", "change": "here", "name": "bench"')
    else:
        assert line == "2026-11-22 09:14:03  here  http://192.168.1.20:8000  TC-0007  bench"
