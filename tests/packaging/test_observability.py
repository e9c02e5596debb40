"""The Grafana dashboard and the Prometheus files ask for what the daemon really exposes."""

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest
import yaml
from prometheus_client.parser import text_string_to_metric_families

from tests.serving import serving

_PACKAGING = Path(__file__).resolve().parents[2] / "packaging"
_SELECTOR = re.compile(r"{[^}]*}")
_METRIC = re.compile(r"\b(?:transientcam|process|python)_\w+\b")
_LABEL = re.compile(r'(\w+)\s*(?:=~|!~|!=|=)\s*"')
_OF_PROMETHEUS = {"instance", "job", "le"}


@pytest.fixture(scope="module")
def exposed() -> Iterator[dict[str, set[str]]]:
    """Every sample's name and the labels it has, of a daemon that computes and records."""
    with serving("sim:wall?noise=off") as served, httpx.Client(base_url=served.url) as http:
        http.get("/api/v1/frames/latest/range.npy", params={"wait_s": 10}, timeout=60)
        http.post("/api/v1/recordings", json={"frames": 1}).raise_for_status()
        found: dict[str, set[str]] = {}
        for family in text_string_to_metric_families(http.get("/metrics").text):
            for sample in family.samples:
                found.setdefault(sample.name, set()).update(sample.labels)
        yield found


def document() -> dict[str, Any]:
    loaded: dict[str, Any] = json.loads((_PACKAGING / "grafana-dashboard.json").read_text())
    return loaded


def of_dashboard() -> list[str]:
    panels = [target["expr"] for panel in document()["panels"] for target in panel["targets"]]
    return [*panels, document()["templating"]["list"][1]["definition"]]


def of_rules() -> list[str]:
    groups = yaml.safe_load((_PACKAGING / "prometheus-rules.yml").read_text())["groups"]
    return [rule["expr"] for group in groups for rule in group["rules"]]


@pytest.mark.parametrize("expression", [*of_dashboard(), *of_rules()])
def test_every_metric_and_label_that_is_asked_for_is_exposed(
    exposed: dict[str, set[str]], expression: str
) -> None:
    names = set(_METRIC.findall(_SELECTOR.sub("", expression)))
    labels = {label for part in _SELECTOR.findall(expression) for label in _LABEL.findall(part)}

    assert names
    assert names <= set(exposed)
    assert labels - _OF_PROMETHEUS <= set().union(*(exposed[name] for name in names))


def test_a_panel_says_what_it_shows_and_overlaps_no_other() -> None:
    taken: set[tuple[int, int]] = set()
    for panel in document()["panels"]:
        assert panel["title"]
        assert panel["description"].endswith(".")
        at = panel["gridPos"]
        cells = {
            (x, y)
            for x in range(at["x"], at["x"] + at["w"])
            for y in range(at["y"], at["y"] + at["h"])
        }
        assert at["x"] + at["w"] <= 24
        assert not cells & taken
        taken |= cells


def test_the_scrape_finds_the_rules_beside_it() -> None:
    scrape = yaml.safe_load((_PACKAGING / "prometheus.yml").read_text())

    assert scrape["scrape_configs"][0]["static_configs"][0]["targets"] == ["127.0.0.1:8000"]
    assert all((_PACKAGING / name).is_file() for name in scrape["rule_files"])
