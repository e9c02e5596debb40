"""The command itself: verbs, exit codes, sentences."""

import subprocess
import sys
import types
from collections.abc import Callable
from importlib.metadata import EntryPoint, entry_points

import pytest

import transientcam
from transientcam.cli import run, verbs
from transientcam.errors import CommandUnavailable
from transientcam_driver.errors import DriverError

_Install = Callable[..., None]


@pytest.fixture
def install(monkeypatch: pytest.MonkeyPatch) -> _Install:
    """Make a function, or a module that cannot be imported, the verb ``test``."""

    def make(function: Callable[..., object] | None = None, *, missing: str = "") -> None:
        module = types.ModuleType("verb_of_a_test")
        if function is not None:
            module.verb = function  # type: ignore[attr-defined]  # a module made here
            monkeypatch.setitem(sys.modules, "verb_of_a_test", module)
        value = f"{missing}:verb" if missing else "verb_of_a_test:verb"
        point = EntryPoint("test", value, verbs.GROUP)

        def points(**selected: str) -> list[EntryPoint]:
            return [point] if selected.get("name", "test") == "test" else []

        monkeypatch.setattr(verbs, "entry_points", points)

    return make


def test_help_lists_every_verb_with_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["--help"]) == 0

    printed = capsys.readouterr().out
    lines = [line.strip(" │").split(maxsplit=1) for line in printed.splitlines()]
    helps = {words[0]: words[1] for words in lines if len(words) == 2}
    for point in entry_points(group=verbs.GROUP):
        assert len(helps[point.name]) > 10
    assert "Exit codes: 0 done, 1 failed, 2 wrong usage" in printed


def test_every_verb_explains_its_options(capsys: pytest.CaptureFixture[str]) -> None:
    for point in entry_points(group=verbs.GROUP):
        assert run([point.name, "--help"]) == 0
        assert f"transientcam {point.name}" in capsys.readouterr().out


def test_the_version_is_the_package_s_and_loads_no_verb(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(EntryPoint, "load", lambda point: pytest.fail(f"{point.name} is loaded"))

    assert run(["--version"]) == 0
    assert capsys.readouterr().out == f"transientcam {transientcam.__version__}\n"


@pytest.mark.parametrize("arguments", [[], ["frobnicate"], ["capture"], ["watch", "--nonsense"]])
def test_wrong_usage_is_2(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert run(arguments) == 2
    assert "Usage:" in "".join(capsys.readouterr())


def test_a_verb_that_works_is_0(install: _Install, capsys: pytest.CaptureFixture[str]) -> None:
    install(lambda: print("done"))  # noqa: T201 - the verb's output

    assert run(["test"]) == 0
    assert capsys.readouterr().out == "done\n"


@pytest.mark.parametrize(
    ("error", "sentence"),
    [
        (
            transientcam.ServerUnreachable("http://h", "refused"),
            "No camera answers at http://h: refused",
        ),
        (type("DeviceGone", (DriverError,), {})("The lidar is gone"), "The lidar is gone"),
        (
            FileNotFoundError(2, "No such file or directory", "in.npz"),
            "No such file or directory: in.npz",
        ),
        (OSError("odd"), "odd"),
    ],
)
def test_an_error_of_ours_is_one_sentence_and_1(
    error: Exception, sentence: str, install: _Install, capsys: pytest.CaptureFixture[str]
) -> None:
    def fail() -> None:
        raise error

    install(fail)

    assert run(["test"]) == 1
    captured = capsys.readouterr()
    assert captured.err == f"transientcam: {sentence}\n"
    assert captured.out == ""


def test_a_mistake_in_a_program_is_not_hidden(install: _Install) -> None:
    def fail() -> None:
        raise ZeroDivisionError

    install(fail)

    with pytest.raises(ZeroDivisionError):
        run(["test"])


def test_an_interrupt_is_no_traceback(install: _Install) -> None:
    def fail() -> None:
        raise KeyboardInterrupt

    install(fail)

    assert run(["test"]) == 130


def test_a_verb_without_its_packages_says_what_to_install(
    install: _Install, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(verbs._EXTRA_OF_PACKAGE, "package_that_is_not_there", "server")
    install(missing="package_that_is_not_there.commands")

    assert run(["test", "--any", "argument"]) == 1
    assert capsys.readouterr().err == (
        "transientcam: 'transientcam test' needs package_that_is_not_there, which is not "
        "installed: pip install 'transientcam[server]'\n"
    )
    assert run(["--help"]) == 0
    assert "pip install 'transientcam[server]'" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("module", "remedy"),
    [("matplotlib.figure", ": pip install 'transientcam[plot]'"), ("unheard_of", "")],
)
def test_a_package_that_is_missing_only_later_is_reported_too(
    module: str, remedy: str, install: _Install, capsys: pytest.CaptureFixture[str]
) -> None:
    def fail() -> None:
        raise ModuleNotFoundError(f"No module named {module!r}", name=module)

    install(fail)

    assert run(["test"]) == 1
    assert capsys.readouterr().err == (
        f"transientcam: 'transientcam test' needs {module}, which is not installed{remedy}\n"
    )


def test_a_missing_module_of_our_own_is_a_mistake_and_not_hidden(install: _Install) -> None:
    def fail() -> None:
        raise ModuleNotFoundError("No module", name="transientcam_server.nowhere")

    install(fail)

    with pytest.raises(ModuleNotFoundError):
        run(["test"])


@pytest.mark.parametrize(
    ("verb", "extra"), [("serve", "server"), ("reconstruct", "server"), ("scenes", "driver")]
)
def test_each_verb_of_another_package_has_its_extra(verb: str, extra: str) -> None:
    assert verbs.extra_of("some_library", verb) == extra
    assert extra in str(CommandUnavailable(verb, "some_library", extra))


def test_the_clients_verbs_load_without_the_other_packages() -> None:
    program = (
        "import sys\n"
        "from transientcam.cli import run\n"
        "assert run(['watch', '--help']) == 0\n"
        "loaded = {name.partition('.')[0] for name in sys.modules}\n"
        "assert not loaded & {'transientcam_server', 'transientcam_driver', 'fastapi', 'usb'}\n"
    )

    subprocess.run([sys.executable, "-c", program], check=True, stdout=subprocess.DEVNULL)
