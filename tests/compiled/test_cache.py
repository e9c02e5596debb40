"""Where compiled code is kept, and for which sources."""

import sys
from pathlib import Path

import pytest

from transientcam_compiled import Cache

SOURCE = "transientcam_compiled._spread"


def directory(environ: dict[str, str]) -> Path | None:
    """Return where code would be kept, without the name of the state of its sources."""
    cache = Cache(SOURCE, environ=environ)
    found = cache.directory()
    assert found is None or (found.is_dir() and found.name == cache.digest)
    return None if found is None else found.parent


def test_the_users_choice_of_a_cache_comes_first(tmp_path: Path) -> None:
    environ = {"NUMBA_CACHE_DIR": str(tmp_path / "chosen"), "XDG_CACHE_HOME": str(tmp_path / "xdg")}

    assert directory(environ) == tmp_path / "chosen"
    assert not (tmp_path / "xdg").exists()


def test_the_cache_is_below_the_users_cache_directory(tmp_path: Path) -> None:
    xdg, home = tmp_path / "xdg", tmp_path / "home"

    in_xdg = directory({"XDG_CACHE_HOME": str(xdg), "HOME": str(home)})
    at_home = directory({"HOME": str(home)})

    assert in_xdg == xdg / "transientcam" / "kernels"
    assert at_home == home / ".cache" / "transientcam" / "kernels"


def test_a_cache_that_cannot_be_written_is_passed_over(tmp_path: Path) -> None:
    environ = {"XDG_CACHE_HOME": "/dev/null", "HOME": str(tmp_path)}

    assert directory(environ) == tmp_path / ".cache" / "transientcam" / "kernels"
    assert directory({"NUMBA_CACHE_DIR": "/dev/null"}) is None
    assert directory({}) is None


def test_what_compiled_code_is_kept_for_changes_with_every_source_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    package = tmp_path / "kept_for"
    package.mkdir()
    files = [package / "__init__.py", package / "inside.py", tmp_path / "beside.py"]
    for file in files:
        file.write_text("")
    monkeypatch.setattr(sys, "path", [str(tmp_path), *sys.path])

    def digest() -> str:
        return Cache("kept_for", "beside").digest

    digests = [digest(), digest()]
    for file in files:
        file.write_text("# changed")
        digests.append(digest())

    assert digests[0] == digests[1]
    assert len(set(digests)) == 4


def test_sources_that_are_not_there_are_refused() -> None:
    with pytest.raises(ModuleNotFoundError, match="no_such_module"):
        Cache("no_such_module").directory()
