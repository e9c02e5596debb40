"""What recordings and downloads are called."""

from datetime import UTC, datetime

import pytest

from transientcam_server.recording._listing import default_name, download_name


def test_a_recording_without_a_name_is_called_by_the_moment_it_began() -> None:
    name = default_name(datetime(2026, 11, 5, 8, 5, 7, tzinfo=UTC))

    assert name == "Recording of 2026-11-05 08:05:07 UTC"
    assert download_name(name, "20261105T080507Z-3f9c2a") == (
        "recording-20261105T080507Z-3f9c2a.h5"
    )


@pytest.mark.parametrize(
    ("name", "plain"),
    [
        ("wall 3.5 m_b", "wall-3.5-m_b-"),
        ("Möbius / strip", "Mobius-strip-"),
        ("../../etc/passwd", "etc-passwd-"),
        ("--a--", "a-"),
        ("x" * 80, "x" * 80 + "-"),
        ("x" * 81, "x" * 80 + "-"),
        ("x" * 79 + " y", "x" * 79 + "-"),
        ("壁", ""),
        ("", ""),
    ],
)
def test_a_download_is_called_by_what_ascii_has_of_a_name(name: str, plain: str) -> None:
    assert download_name(name, "id") == f"{plain}id.h5"
