"""What is handed out: an sdist, the wheel of it, and a daemon from that wheel without Node."""

import hashlib
import io
import json
import os
import re
import subprocess
import sys
import tarfile
import tomllib
import venv
from collections.abc import Iterator
from importlib.metadata import Distribution, PathDistribution, distribution
from pathlib import Path
from zipfile import Path as ZipPath, ZipFile

import httpx
import numpy as np
import pytest
import yaml
from packaging.requirements import Requirement

from tests.conftest import ROOT

_PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
_TARGETS = _PROJECT["tool"]["hatch"]["build"]["targets"]
_EPOCH_S = "1795305600"
_TWO_MINUTES_S = 120.0


def build(source: Path, to: Path) -> tuple[Path, Path]:
    """Return the sdist of a directory and the wheel of that sdist, as ``make dist`` builds them."""
    command = [sys.executable, "-m", "build", "--no-isolation", "--outdir", str(to), str(source)]
    environment = os.environ | {"SOURCE_DATE_EPOCH": _EPOCH_S, "PATH": "/nowhere"}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
    (sdist,) = to.glob("*.tar.gz")
    (wheel,) = to.glob("*.whl")
    return sdist, wheel


def version_of(built: tuple[Path, Path]) -> str:
    return built[1].name.split("-")[1]


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    return build(ROOT, tmp_path_factory.mktemp("dist"))


@pytest.fixture(scope="module")
def unpacked(built: tuple[Path, Path], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The files of the sdist, in another place and with other times than those of the tree."""
    directory = tmp_path_factory.mktemp("unpacked")
    with tarfile.open(built[0]) as archive:
        archive.extractall(directory, filter="data")
    (root,) = directory.iterdir()
    for path in root.rglob("*"):
        os.utime(path, (1e9, 1e9))
    return root


def needed(wheel: Path, extra: str) -> dict[str, Distribution]:
    """Return every distribution that an extra of the wheel declares, and those that these need."""
    (metadata,) = (each for each in ZipPath(wheel).iterdir() if each.name.endswith(".dist-info"))
    found: dict[str, Distribution] = {}
    left: list[tuple[Distribution, str]] = [(PathDistribution(metadata), extra)]
    seen: set[tuple[str, str]] = set()
    while left:
        one, its_extra = left.pop()
        for line in one.requires or ():
            requirement = Requirement(line)
            if requirement.marker and not requirement.marker.evaluate({"extra": its_extra}):
                continue
            for each in ("", *requirement.extras):
                key = (requirement.name.lower(), each)
                if key in seen:
                    continue
                seen.add(key)
                if key[0] == "transientcam":  # an extra that takes another one along
                    left.append((PathDistribution(metadata), each))
                else:
                    found[key[0]] = distribution(requirement.name)
                    left.append((found[key[0]], each))
    return found


def link_into(site: Path, one: Distribution) -> None:
    """Make a distribution that is installed here a part of another environment."""
    for path in one.files or ():
        first = path.parts[0]
        link = site / first
        if first != ".." and first != "__pycache__" and not link.exists():
            link.symlink_to(Path(str(one.locate_file(first))))


@pytest.fixture(scope="module")
def installed(built: tuple[Path, Path], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An environment with the wheel, and with nothing that the wheel doesn't declare."""
    directory = tmp_path_factory.mktemp("clean") / "venv"
    venv.create(directory, symlinks=True)
    python = directory / "bin" / "python"
    pip = [sys.executable, "-m", "pip", "--python", str(python), "--no-input"]
    options = ["--quiet", "--no-index", "--no-deps", "--no-compile"]
    subprocess.run([*pip, "install", *options, str(built[1])], check=True)
    (site,) = directory.glob("lib/python*/site-packages")
    for one in needed(built[1], "server").values():
        link_into(site, one)
    return directory


@pytest.fixture(scope="module")
def url(installed: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """Address of a daemon of the wheel, where neither Node nor the sources can be found."""
    home = tmp_path_factory.mktemp("home")
    environment = {
        "PATH": str(installed / "bin"),
        "HOME": str(home),
        "TRANSIENTCAM_KERNELS": "off",
        "TRANSIENTCAM_RECONSTRUCTION__NEIGHBOURS": "gaussian",
        "PYTHONUNBUFFERED": "1",
    }
    command = [str(installed / "bin" / "transientcam"), "serve", "--port", "0"]
    with subprocess.Popen(
        [*command, "--camera", "sim:wall?noise=off"],
        cwd=home,
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    ) as process:
        assert process.stdout is not None
        line = process.stdout.readline()
        found = re.search(r"http://\S+:\d+", line)
        try:
            assert found, line + process.stdout.read()
            yield found.group()
        finally:
            process.terminate()
            process.communicate()


def files_of_packages() -> set[str]:
    """Return what has to be in the wheel: every file of the packages, the built page with them."""
    found: set[str] = set()
    for package in map(Path, _TARGETS["wheel"]["packages"]):
        for path in (ROOT / package).rglob("*"):
            if path.is_file() and "__pycache__" not in path.parts:
                found.add(path.relative_to(ROOT / package.parent).as_posix())
    return found


def test_the_wheel_has_every_file_of_the_packages_and_nothing_else(
    built: tuple[Path, Path],
) -> None:
    names = ZipFile(built[1]).namelist()
    within = f"transientcam-{version_of(built)}.dist-info/"

    assert {name for name in names if not name.startswith(within)} == files_of_packages()
    assert {f"{within}licenses/LICENSE", f"{within}entry_points.txt"} <= set(names)


def test_the_sdist_has_tests_and_documentation_and_nothing_left_behind(unpacked: Path) -> None:
    for name in ("LICENSE", "CITATION.cff", "Makefile", "docs/conf.py", "examples", "benchmarks"):
        assert (unpacked / name).exists(), name
    parts = {part for path in unpacked.rglob("*") for part in path.parts}
    assert not parts & {"node_modules", "__pycache__", ".venv", ".mypy_cache", ".git"}


def test_the_same_sources_give_the_same_bytes_elsewhere_and_later(
    built: tuple[Path, Path], unpacked: Path, tmp_path: Path
) -> None:
    again = build(unpacked, tmp_path)

    digests = [
        [hashlib.sha256(each.read_bytes()).hexdigest() for each in x] for x in (built, again)
    ]
    assert digests[0] == digests[1]


def test_a_daemon_of_the_wheel_serves_frames_and_its_page(
    url: str, built: tuple[Path, Path]
) -> None:
    with httpx.Client(base_url=url, timeout=_TWO_MINUTES_S) as http:
        answer = http.get("/api/v1/frames/latest/range.npy", params={"wait_s": 10})
        page = http.get("/").text
        parts = re.findall(r'(?:src|href)="\.?(/[^"]+)"', page)
        assert http.get("/api/v1/info").json()["version"] == version_of(built)
        assert [http.get(each).status_code for each in parts] == [200] * len(parts)
        assert http.get("/docs").status_code == 200

    range_m = np.lib.format.read_array(_stream(answer))
    assert range_m.shape == (120, 163)
    assert np.isfinite(range_m).mean() > 0.9
    assert {Path(each).suffix for each in parts} == {".js", ".css"}


def _stream(answer: httpx.Response) -> io.BytesIO:
    answer.raise_for_status()
    return io.BytesIO(answer.content)


def test_what_is_not_declared_is_not_there(installed: Path) -> None:
    """What the others rest on: the environment has no more than the wheel asks for."""
    program = "import importlib.util as u; print(*[u.find_spec(n) is None for n in "
    program += "('pytest', 'jax', 'matplotlib', 'transientcam', 'benchmarks')])"
    done = subprocess.run(
        [installed / "bin" / "python", "-c", program],
        capture_output=True,
        text=True,
        check=True,
        env={},
        cwd="/",
    )

    assert done.stdout.split() == ["True", "True", "True", "False", "True"]


def test_the_wheel_lists_the_licences_of_all_that_it_carries(built: tuple[Path, Path]) -> None:
    within = f"transientcam-{version_of(built)}.dist-info"
    with ZipFile(built[1]) as archive:
        metadata = archive.read(f"{within}/METADATA").decode()
        listed = [
            json.loads(archive.read(f"{within}/licenses/{where}/static/licences.json"))
            for where in ("server/transientcam_server", "client/transientcam")
        ]
    dashboard = json.loads((ROOT / "client" / "dashboard" / "package.json").read_text("utf-8"))
    page, player = ({each["name"] for each in one} for one in listed)

    assert set(dashboard["dependencies"]) <= page
    assert "@preact/signals" in player
    # those that ask for no more than to be named with their text, as the lists do
    expression = re.findall(r"^License-Expression: (.*)$", metadata, re.MULTILINE)
    carried = {each["identifier"] for one in listed for each in one}
    assert expression == [" AND ".join(sorted({"BSD-3-Clause", *carried}))]
    assert carried <= {"0BSD", "Apache-2.0", "BSD-3-Clause", "ISC", "MIT", "OFL-1.1"}
    assert all(len(each["text"]) > 500 for one in listed for each in one)


def epoch_s(directory: Path) -> int:
    """Return the time that ``make dist`` takes for now."""
    command = ["make", "--silent", "--eval", "epoch:; @echo $(EPOCH_S)", "epoch"]
    done = subprocess.run(command, cwd=directory, capture_output=True, text=True, check=True)
    return int(done.stdout)


def test_an_unpacked_sdist_is_built_with_the_time_of_its_files(unpacked: Path) -> None:
    assert epoch_s(unpacked) == int(1e9)


@pytest.mark.skipif(not (ROOT / ".git").exists(), reason="this is no repository")
def test_a_commit_is_built_with_its_own_time() -> None:
    command = ["git", "log", "-1", "--format=%ct"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)

    assert epoch_s(ROOT) == int(done.stdout)


# -- what is said of it ------------------------------------------------------------------------


def test_the_version_is_the_same_wherever_it_stands() -> None:
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text("utf-8"))
    dashboard = json.loads((ROOT / "client" / "dashboard" / "package.json").read_text("utf-8"))
    changes = (ROOT / "CHANGELOG.md").read_text("utf-8")
    (version, date), *_ = re.findall(r"^## \[([\d.]+)\] - ([\d-]+)$", changes, re.MULTILINE)

    versions = _PROJECT["tool"]["hatch"]["version"]
    assert versions["fallback-version"] == version
    assert f"echo v{version}-" in versions["raw-options"]["git_describe_command"]
    assert citation["version"] == version
    assert str(citation["date-released"]) == date
    assert dashboard["version"] == version


@pytest.mark.skipif(not (ROOT / ".git").exists(), reason="this is no repository")
def test_a_version_tells_two_commits_apart_in_a_clone_without_tags(tmp_path: Path) -> None:
    def git(*words: str) -> str:
        who = ("-c", "user.name=a", "-c", "user.email=a@localhost")
        done = subprocess.run(
            ["git", "-C", tmp_path, *who, *words], capture_output=True, text=True, check=True
        )
        return done.stdout.strip()

    def version() -> str:
        command = [sys.executable, "-m", "hatchling", "version"]
        return subprocess.run(
            command, cwd=tmp_path, capture_output=True, text=True, check=True
        ).stdout.strip()

    git("init", "--quiet")
    (tmp_path / "pyproject.toml").write_text((ROOT / "pyproject.toml").read_text("utf-8"))
    git("add", "pyproject.toml")
    git("commit", "--quiet", "--message", "one")
    first = version()
    git("commit", "--quiet", "--allow-empty", "--message", "another")

    assert version() != first
    assert version().endswith(f"+g{git('rev-parse', '--short=8', 'HEAD')}")
