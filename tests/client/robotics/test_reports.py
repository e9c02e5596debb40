import pytest

from transientcam.robotics._reports import report_of
from transientcam.wire import Notice


@pytest.mark.parametrize(
    ("notice", "level", "about", "words"),
    [
        (Notice("dropped", {"channel": 0, "count": 2, "total": 9}), "warning", "dropped", "9 fra"),
        (Notice("lost-images", {"count": 3, "frame": 7}), "warning", "lost-images", "3 images"),
        (Notice("camera-lost", {"reason": "unplugged"}), "error", "camera", "unplugged"),
        (Notice("camera-back", {}), "info", "camera", "again"),
        (Notice("light-arming", {"in_s": 3.0}), "warning", "camera", "on in 3 s"),
        (Notice("light-off", {"reason": "stopped"}), "warning", "camera", "off: stopped"),
        (Notice("light-unconfirmed", {"reason": "may be on"}), "warning", "camera", "may be on"),
        (Notice("connection-lost", {"reason": "1006"}), "error", "connection", "1006"),
        (Notice("reconnected", {"attempts": 2}), "info", "connection", "again"),
        (Notice("product-failed", {"title": "no such gain"}), "error", "product", "no such gain"),
    ],
    ids=lambda value: value.kind if isinstance(value, Notice) else None,
)
def test_a_notice_about_losses_is_shown_to_viewers(
    notice: Notice, level: str, about: str, words: str
) -> None:
    report = report_of(notice)

    assert report is not None
    assert (report.level, report.about) == (level, about)
    assert words in report.text
    assert report.to_document()["type"] == "report"


def test_a_notice_about_something_else_is_not() -> None:
    assert report_of(Notice("recording-started", {"recording": "a"})) is None
    assert report_of(Notice("of-a-newer-daemon", {})) is None
