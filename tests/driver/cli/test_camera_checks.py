"""The contract's clauses as findings of `transientcam doctor --camera`."""

from types import SimpleNamespace

import pytest

from transientcam_driver.cli import camera_checks
from transientcam_driver.contract import ContractBroken, ContractSkipped


def test_what_was_not_tried_is_counted_apart(monkeypatch: pytest.MonkeyPatch) -> None:
    def skip(_: object) -> None:
        raise ContractSkipped("nobody can unplug it")

    def fail(_: object) -> None:
        raise ContractBroken("it was lit")

    runs = {"kept": lambda _: None, "unplugged": skip, "dark": fail, "kept too": lambda _: None}
    clauses = [SimpleNamespace(name=name, promise="It is.", run=run) for name, run in runs.items()]
    monkeypatch.setattr(camera_checks, "CLAUSES", clauses)
    monkeypatch.setattr(camera_checks, "_capabilities", lambda spec: iter(()))

    *_, first, second, third, fourth, badge = camera_checks.checks("sim:wall")

    assert first == ("ok", "kept", "It is.", None)
    assert fourth == ("ok", "kept too", "It is.", None)
    assert second == ("not tried", "unplugged", "nobody can unplug it", None)
    assert third[:3] == ("fault", "dark", "It is. But: it was lit")
    assert "2_passed,_1_failed,_1_not_tried-red" in badge[2]
