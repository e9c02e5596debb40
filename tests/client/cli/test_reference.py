"""The reference pages say what there is."""

import pytest

from tools import reference
from tools.reference import DOCS
from transientcam import cli

_REMEDY = "run: python tools/documents.py --write"


@pytest.mark.parametrize("name", ["command-line.md", "settings.md"])
def test_a_reference_page_is_what_would_be_generated_now(name: str) -> None:
    path = DOCS / name
    written = path.read_text("utf-8").splitlines()
    wanted = reference.pages()[path].splitlines()

    differing = [line for line in wanted if line not in written]
    assert written == wanted, f"{_REMEDY}\n" + "\n".join(differing[:5])


@pytest.mark.parametrize("verb", reference.verbs())
def test_every_verb_prints_json_where_it_is_asked_to(verb: str) -> None:
    options = [name for each in reference.verbs()[verb].params for name in each.opts]

    assert "--json" in options


def test_every_exit_code_is_documented() -> None:
    page = (DOCS / "command-line.md").read_text("utf-8")

    for code in (0, cli.FAILED, 2, cli.INTERRUPTED):
        assert f"\n| {code} | " in page


@pytest.mark.parametrize(
    ("setting", "variable"),
    [("port", "TRANSIENTCAM_PORT"), ("stream.max_clients", "TRANSIENTCAM_STREAM__MAX_CLIENTS")],
)
def test_the_page_names_variables_as_they_are_read(setting: str, variable: str) -> None:
    assert reference.variable(setting) == variable
    assert variable in (DOCS / "settings.md").read_text("utf-8")
