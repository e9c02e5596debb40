"""Progress of what is made of parts."""

import pytest

from transientcam_server.planning import Progress


def test_the_whole_is_where_its_part_is() -> None:
    reports: list[tuple[float, str]] = []
    whole = Progress(lambda share, step: reports.append((share, step)))

    whole.part(0.5, 1.0).part(0.0, 0.8).at(0.5, "searching")
    whole()

    assert [step for _, step in reports] == ["searching", "searching"]
    assert [share for share, _ in reports] == pytest.approx([0.7, 0.7])
