import httpx
import pytest

from tests.serving import Served


@pytest.mark.parametrize(
    ("path", "limit"),
    [
        ("info?verbose=1", "left out: there are no parameters"),
        ("frames/latest/pixel?x=1&y=1&bin=8", "one of x, y, bins, wait_s, after"),
        ("jobs/none?wait=1", "one of wait_s"),
    ],
)
def test_a_read_with_a_parameter_that_there_is_not_is_refused(
    steady: httpx.Client, path: str, limit: str
) -> None:
    response = steady.get(f"/api/v1/{path}")

    name, _, value = path.rpartition("&" if "&" in path else "?")[2].partition("=")
    assert (response.status_code, response.json()["type"]) == (422, "/problems/invalid-request")
    assert {key: response.json()[key] for key in ("field", "value", "limit")} == {
        "field": name,
        "value": value,
        "limit": limit,
    }


def test_head_is_refused_as_get_is(steady: httpx.Client) -> None:
    assert steady.head("/api/v1/frames/latest/range?regoin=0,0,8,8").status_code == 422


def test_no_documented_parameter_is_one_that_there_is_not(
    steady: httpx.Client, steady_daemon: Served
) -> None:
    paths = steady_daemon.app.openapi()["paths"]
    for path, operations in paths.items():
        parameters = operations.get("get", {}).get("parameters", ())
        # nothing has the value of these, so that other refusals come for those that are known
        named = {each["name"]: "\0" for each in parameters if each["in"] == "query"}
        if named and not path.endswith(".mjpeg"):
            problem = steady.get(path.replace("{", "").replace("}", ""), params=named).json()
            assert "There is no query parameter" not in str(problem), path


def test_nothing_in_an_address_keeps_the_light_on(http: httpx.Client) -> None:
    assert http.post("/api/v1/acquisition/safe-off?now=please").status_code == 200
