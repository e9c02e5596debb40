"""requirements/ is what pyproject.toml asks for, each with a version and hashes."""

import re
import tomllib
from typing import Any

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name
from packaging.version import Version

from tests.conftest import ROOT

PROJECT: dict[str, Any] = tomllib.loads((ROOT / "pyproject.toml").read_text())
OURS = {"transientcam", "transientcam-conformance", "transientcam-oak", "transientcam-opt8241"}


def wanted(*extras: str) -> list[Requirement]:
    """Return what the project and extras of it require, those of further extras included."""
    optional = PROJECT["project"]["optional-dependencies"]
    texts, left, seen = list(PROJECT["project"]["dependencies"]), list(extras), set()
    while left:
        extra = left.pop()
        if extra not in seen:
            seen.add(extra)
            for each in map(Requirement, optional[extra]):
                left += each.extras if each.name == "transientcam" else ()
                texts.append(str(each))
    return [each for each in map(Requirement, texts) if canonicalize_name(each.name) not in OURS]


def locked(name: str) -> dict[str, set[str]]:
    """Return the versions of a lock by the package; of one for several platforms there are more."""
    text = (ROOT / "requirements" / f"{name}.txt").read_text().replace("\\\n", " ")
    found: dict[str, set[str]] = {}
    for line in filter(None, text.splitlines()):
        match = re.fullmatch(
            r"([\w.-]+)==(\S+)( ; .*?)?((\s+--hash=sha256:[0-9a-f]{64})+)\s*", line
        )
        assert match, line
        found.setdefault(canonicalize_name(match[1]), set()).add(match[2])
    return found


@pytest.mark.parametrize(
    ("name", "extras"),
    [("test", ["test"]), ("service", ["server", "conformance", "opt8241", "cluster", "plot"])],
)
def test_a_lock_has_what_the_project_asks_for(name: str, extras: list[str]) -> None:
    versions = locked(name)
    for each in wanted(*extras):
        found = versions[canonicalize_name(each.name)]
        assert all(each.specifier.contains(Version(one), prereleases=True) for one in found), each
    assert not OURS & versions.keys()


@pytest.mark.parametrize("group", ["build", "dist", "release"])
def test_the_tools_of_a_build_and_of_a_release_are_locked(group: str) -> None:
    versions = locked(group)
    for each in map(Requirement, PROJECT["dependency-groups"][group]):
        (found,) = versions[canonicalize_name(each.name)]
        assert each.specifier.contains(found)
    # hatchling asks for editables by itself, where an install is editable.
    asked = {*PROJECT["build-system"]["requires"], "editables>=0.5"}
    assert asked == set(PROJECT["dependency-groups"]["build"])


def test_what_builds_here_and_in_the_image_is_the_same() -> None:
    everything = locked("test")
    for name in ("build", "dist", "service"):
        for package, versions in locked(name).items():
            assert versions == everything[package], package


def test_no_lock_names_a_place_where_packages_come_from() -> None:
    for path in (ROOT / "requirements").glob("*.txt"):
        assert "://" not in path.read_text()
        assert "--index-url" not in path.read_text()


def test_image_and_targets_install_what_is_locked_and_nothing_else() -> None:
    dockerfile = (ROOT / "docker" / "Dockerfile").read_text().replace("\\\n", " ")
    makefile = (ROOT / "Makefile").read_text()
    installs = re.findall(r"pip install (?!--upgrade)[^&\n]*", dockerfile)
    assert len(installs) == 3
    for each in installs:
        assert "--no-deps" in each
        assert "--require-hashes" in each or "--no-index" in each
    assert "LOCKED := -m pip install --quiet --require-hashes --no-deps" in makefile
    for target, installs_of in {"serve": 2, "test": 3}.items():
        rule = makefile[makefile.index(f".venv/{target}.stamp:") :].partition("\n\n")[0]
        assert rule.count("$(LOCKED)") == installs_of
