import sys
from pathlib import Path

import pytest

from transientcam_compiled._spread import quota_of


def files(root: Path, texts: dict[str, str]) -> Path:
    for name, text in texts.items():
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_text(text)
    return root


@pytest.mark.parametrize(
    ("text", "cores"),
    [
        ("200000 100000\n", 2),
        ("150000 100000\n", 2),
        ("10000 100000\n", 1),
        ("max 100000\n", sys.maxsize),
        ("", sys.maxsize),
    ],
)
def test_the_quota_of_a_container_is_rounded_up(tmp_path: Path, text: str, cores: int) -> None:
    root = files(tmp_path, {"cpu.max": text, "proc": "0::/\n"})

    assert quota_of(root, root / "proc") == cores


@pytest.mark.parametrize(
    ("proc", "texts"),
    [
        ("0::/system.slice/t.service\n", {"system.slice/t.service/cpu.max": "300000 100000"}),
        ("0::/a.slice/t.service\n", {"a.slice/cpu.max": "3 1", "a.slice/t.service/cpu.max": "9 1"}),
        (
            "3:cpu,cpuacct:/docker/1\n1:name=systemd:/\n0::/\n",
            {"cpu/docker/1/cpu.cfs_quota_us": "250000", "cpu/docker/1/cpu.cfs_period_us": "100000"},
        ),
        (
            "3:cpu,cpuacct:/docker/not-shown-here\n",
            {"cpu/cpu.cfs_quota_us": "300000", "cpu/cpu.cfs_period_us": "100000"},
        ),
    ],
)
def test_a_service_and_a_group_of_version_1_have_quotas_too(
    tmp_path: Path, proc: str, texts: dict[str, str]
) -> None:
    root = files(tmp_path, texts | {"proc": proc})

    assert quota_of(root, root / "proc") == 3


@pytest.mark.parametrize("texts", [{}, {"cpu/cpu.cfs_quota_us": "-1", "proc": "1:cpu:/\n"}])
def test_without_a_quota_there_is_none(tmp_path: Path, texts: dict[str, str]) -> None:
    root = files(tmp_path, texts)

    assert quota_of(root, root / "proc") == sys.maxsize
