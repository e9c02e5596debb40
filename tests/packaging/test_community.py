"""What users and journals look for beside the code: how to ask, report and cite; public CI."""

import re
import subprocess
import sys
import tomllib

import yaml

from tests.conftest import ROOT

_PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
_WORKFLOW = ROOT / ".github" / "workflows" / "ci.yml"


def test_the_same_authors_are_named_everywhere() -> None:
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text("utf-8"))
    paper = yaml.safe_load((ROOT / "joss" / "paper.md").read_text("utf-8").split("---")[1])

    names = [each["name"] for each in _PROJECT["authors"]]
    assert [each["name"] for each in citation["authors"]] == names
    assert [each["name"] for each in paper["authors"]] == names


def test_every_work_that_the_paper_cites_is_in_its_bibliography() -> None:
    text = (ROOT / "joss" / "paper.md").read_text("utf-8")
    known = re.findall(r"^@\w+\{(\w+),", (ROOT / "joss" / "paper.bib").read_text("utf-8"), re.M)

    assert set(re.findall(r"@(\w+)", text)) == set(known)
    assert {"Summary", "Statement of need", "References"} <= set(
        re.findall(r"^# (.+)$", text, re.M)
    )


def test_readme_leads_to_support_security_and_conduct() -> None:
    readme = (ROOT / "README.md").read_text("utf-8")

    for name in ("SUPPORT.md", "SECURITY.md", "CODE_OF_CONDUCT.md", "CITATION.cff"):
        assert f"]({name})" in readme
        assert (ROOT / name).is_file()


def test_public_ci_runs_what_ci_runs_on_every_python_that_is_named() -> None:
    command = ["check_jsonschema", "--builtin-schema", "vendor.github-workflows", str(_WORKFLOW)]
    checked = subprocess.run([sys.executable, "-m", *command], capture_output=True, text=True)
    assert checked.returncode == 0, checked.stdout

    (job,) = yaml.safe_load(_WORKFLOW.read_text("utf-8"))["jobs"].values()
    assert job["steps"][-1] == {"run": ".ci/run"}
    named = re.findall(r"Python :: (3\.\d+)", " ".join(_PROJECT["classifiers"]))
    assert named
    assert set(named) <= set(job["strategy"]["matrix"]["python"])
    assert job["strategy"]["matrix"]["python"] == ["3.11", "3.12", "3.13", "3.14"]


def test_what_the_tests_need_of_the_system_is_named_once() -> None:
    command = ["make", "--silent", "debian-package-names"]
    names = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout

    assert {"chromium", "umockdev"} <= set(names.split())
    assert "debian-package-names" in _WORKFLOW.read_text("utf-8")
