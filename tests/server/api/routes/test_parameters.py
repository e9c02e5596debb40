"""Parameters describe themselves, and what they say of their limits is what validation does."""

import math
from pathlib import Path
from typing import Any

import httpx
import pytest

from tests.serving import serving
from tests.waiting import wait_until

READ_WRITE = "read-write"


def parameters(http: httpx.Client) -> dict[str, dict[str, Any]]:
    found = http.get("/api/v1/parameters").json()["parameters"]
    return {each["name"]: each for each in found}


def at(document: Any, pointer: str) -> Any:
    for part in pointer.split("/")[1:]:
        document = document[part]
    return document


def changed(document: dict[str, Any], pointer: str, value: object) -> dict[str, Any]:
    first, _, rest = pointer[1:].partition("/")
    return {**document, first: changed(document[first], "/" + rest, value) if rest else value}


def answer(http: httpx.Client, parameter: dict[str, Any], value: object) -> httpx.Response:
    """What the service says of a value; of a sequence without setting it."""
    resource = parameter["resource"]
    document = changed(http.get(resource).json(), parameter["pointer"], value)
    if resource.endswith("/sequence"):
        return http.post(f"{resource}/validate", json=document)
    return http.put(resource, json=document)


def test_each_stands_where_it_says_with_the_value_it_says(steady: httpx.Client) -> None:
    found = parameters(steady)

    assert {name.partition(".")[0] for name in found} == {
        "sequence",
        "reconstruction",
        "acquisition",
        "history",
        "recordings",
    }
    for parameter in found.values():
        resource = steady.get(parameter["resource"]).json()
        assert at(resource, parameter["pointer"]) == parameter["value"], parameter["name"]
        assert parameter["description"]


def test_what_can_be_set_is_all_that_the_resources_take(steady: httpx.Client) -> None:
    found = parameters(steady)

    settings = steady.get("/api/v1/reconstruction").json()
    assert {f"reconstruction.{key}" for key in settings} - {"reconstruction.reconstruction_id"} == {
        name for name in found if name.startswith("reconstruction.")
    }
    assert {name for name in found if name.startswith("sequence.")} == {
        f"sequence.{name}"
        for name in (
            "base_frequency_hz",
            "harmonics",
            "zeroth",
            "exposure_s",
            "takes",
            "take_order",
            "sub_phases.scheme",
            "sub_phases.n",
        )
    }
    assert found["sequence.base_frequency_hz"]["unit"] == "Hz"
    assert found["reconstruction.smoothing_px"]["unit"] == "px"
    assert found["recordings.min_free_bytes"]["access"] == "read-only"


def test_limits_are_accepted_and_what_is_beyond_them_is_not(http: httpx.Client) -> None:
    for parameter in parameters(http).values():
        if parameter["access"] != READ_WRITE:
            continue
        for limit, outwards in (("min", -1), ("max", 1)):
            value = parameter[limit]
            if value is None:
                continue
            step = 1 if parameter["type"] == "integer" else 0.01 * abs(value) + 1e-9
            if parameter["type"] == "integer":
                value = int(value)
            inside = answer(http, parameter, value)
            assert inside.status_code == 200, (parameter, inside.text)
            outside = answer(http, parameter, value + outwards * step)
            assert outside.status_code == 422, (parameter, value + outwards * step)
            # too many harmonics are refused because their frequency would be too high
            field = parameter["name"].partition(".")[2]
            assert outside.json()["field"] in (field, "base_frequency_hz")
        for value in parameter["allowed"] or ():
            assert answer(http, parameter, value).status_code == 200, (parameter, value)
        if parameter["type"] == "string":
            assert answer(http, parameter, "something else").status_code == 422


@pytest.mark.parametrize(
    "sequence", [{"base_frequency_hz": 10e6, "harmonics": 8, "takes": 2}, {"zeroth": "on-off"}]
)
def test_limits_follow_the_sequence(http: httpx.Client, sequence: dict[str, Any]) -> None:
    before = parameters(http)
    http.put("/api/v1/sequence", json=sequence).raise_for_status()

    after = parameters(http)

    for name in ("sequence.takes", "sequence.base_frequency_hz", "sequence.harmonics"):
        parameter = after[name]
        top = math.floor(parameter["max"]) if parameter["type"] == "integer" else parameter["max"]
        assert answer(http, parameter, top).status_code == 200
        assert answer(http, parameter, top + 1e6).status_code == 422
    if "harmonics" in sequence:
        name = "sequence.base_frequency_hz"
        assert after[name]["max"] < before[name]["max"]


def test_estimators_and_harmonics_that_do_not_go_together_are_not_allowed(
    http: httpx.Client,
) -> None:
    http.put("/api/v1/sequence", json={"harmonics": 1}).raise_for_status()
    few = parameters(http)["reconstruction.estimator"]["allowed"]
    http.put("/api/v1/sequence", json={"harmonics": 4}).raise_for_status()
    many = parameters(http)["reconstruction.estimator"]["allowed"]
    only_many = next(each for each in many if each not in few)

    http.put("/api/v1/reconstruction", json={"estimator": only_many}).raise_for_status()

    least = parameters(http)["sequence.harmonics"]["min"]
    assert least > 1
    fewer = http.put("/api/v1/sequence", json={"harmonics": int(least) - 1})
    assert fewer.json()["type"] == "/problems/estimator-misfit"


def test_a_recording_has_a_sequence_that_can_only_be_read(tmp_path: Path) -> None:
    kept = {"directory": tmp_path, "min_free_bytes": 0}
    with serving(recordings=kept) as daemon, httpx.Client(base_url=daemon.url, timeout=60) as http:
        identity = http.post("/api/v1/recordings", json={"frames": 2}).json()["id"]
        wait_until(lambda: http.get(f"/api/v1/recordings/{identity}").json()["state"] == "complete")

    with (
        serving(f"recording:{tmp_path / identity}.h5?loop=on") as replayed,
        httpx.Client(base_url=replayed.url, timeout=60) as http,
    ):
        assert parameters(http)["sequence.harmonics"]["access"] == "read-only"
