"""Completion of the command line in a shell."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from transientcam.cli import run, verbs

_COMMAND = Path(sys.executable).with_name("transientcam")


def offered(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], *words: str
) -> list[str]:
    """Return what bash is offered for the last of some words."""
    monkeypatch.setenv("_TRANSIENTCAM_COMPLETE", "complete_bash")
    monkeypatch.setenv("COMP_WORDS", " ".join(("transientcam", *words)))
    monkeypatch.setenv("COMP_CWORD", str(len(words)))
    run([])
    return capsys.readouterr().out.split()


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["re"], {"record", "recover", "reconstruct", "replay", "rerun"}),
        (["doc"], {"doctor"}),
        (["token", "re"], {"revoke"}),
        (["token", "create", "--role", ""], {"viewer", "operator", "admin"}),
        (["serve", "--log"], {"--log-level"}),
        (["serve", "--camera", "sim:wa"], {"sim:wall"}),
        (["watch", "127.0.0.1", "coeff"], {"coefficients"}),
        (["capture", "127.0.0.1", "uni"], {"uniform"}),
    ],
)
def test_verbs_options_and_values_are_offered(
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    words: list[str],
    expected: set[str],
) -> None:
    assert set(offered(monkeypatch, capsys, *words)) == expected


def test_only_the_verb_that_is_written_is_imported(monkeypatch: pytest.MonkeyPatch) -> None:
    for variables in (
        {"_TRANSIENTCAM_COMPLETE": "complete_bash", "COMP_WORDS": "transientcam watch --c"},
        {"_TRANSIENTCAM_COMPLETE": "x", "_TYPER_COMPLETE_ARGS": "transientcam watch --c"},
    ):
        assert verbs.words_to_complete(variables) == ["watch", "--c"]
    assert verbs.words_to_complete({"COMP_WORDS": "transientcam watch"}) == []
    program = (
        "import sys\n"
        "from transientcam.cli import run\n"
        "run([])\n"
        "loaded = {name.partition('.')[0] for name in sys.modules}\n"
        "assert not loaded & {'transientcam_server', 'transientcam_driver', 'fastapi'}, loaded\n"
    )
    environment = {
        "_TRANSIENTCAM_COMPLETE": "complete_bash",
        "COMP_WORDS": "transientcam watch --max",
        "COMP_CWORD": "2",
    }
    done = subprocess.run(
        [sys.executable, "-c", program], env=environment, capture_output=True, text=True, check=True
    )
    assert done.stdout.split() == ["--max-rate-hz"]


@pytest.mark.skipif(shutil.which("bash") is None, reason="bash is not installed")
def test_what_is_installed_into_bash_works_there() -> None:
    script = (
        f'eval "$({_COMMAND} --show-completion bash)"\n'
        "COMP_WORDS=(transientcam rec) COMP_CWORD=1\n"
        f"_transientcam_completion {_COMMAND}\n"
        'echo "${COMPREPLY[@]}"\n'
    )
    done = subprocess.run(
        ["bash", "--norc", "-c", script], capture_output=True, text=True, check=True
    )

    assert set(done.stdout.split()) == {"record", "recover", "reconstruct"}
