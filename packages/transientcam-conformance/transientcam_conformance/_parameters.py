"""Parameters: each has limits, its value is within them, and no other value is accepted."""

from collections.abc import Iterator, Mapping
from typing import Any, Final

from transientcam.requests import problem
from transientcam.transport import answer_of
from transientcam_conformance._device import API, Device
from transientcam_conformance._expecting import equal, expect

_SEQUENCE: Final = f"{API}/sequence"
_CHANGEABLE: Final = "read-write"


def every_value_is_within_its_limits(device: Device) -> None:
    """For every parameter min <= value <= max, and its value is among those allowed."""
    for each in _parameters(device):
        name, value = each["name"], each["value"]
        least, most, allowed = (each.get(key) for key in ("min", "max", "allowed"))
        if value is None:
            continue
        expect(least is None or least <= value, f"{name} is {value}, below its min {least}")
        expect(most is None or value <= most, f"{name} is {value}, above its max {most}")
        expect(not allowed or value in allowed, f"{name} is {value!r}, which is not allowed")


def every_parameter_has_unit_and_meaning(device: Device) -> None:
    """Every parameter has a type, unit, access, meaning, resource and pointer."""
    for each in _parameters(device):
        for key in ("resource", "pointer", "type", "access", "description"):
            expect(each.get(key), f"{each['name']} has no `{key}`")
        expect("unit" in each, f"{each['name']} has no `unit`")


def parameters_are_what_their_resources_say(device: Device) -> None:
    """The value of a parameter is the one in its resource, at its pointer."""
    documents: dict[str, Any] = {}
    for each in _parameters(device):
        resource = each["resource"]
        if resource not in documents:
            documents[resource] = device.read(resource)
        found = _at(documents[resource], each["pointer"])
        equal(found, each["value"], f"{each['name']} in {resource}")


def a_sequence_out_of_range_is_refused_and_changes_nothing(device: Device) -> None:
    """A PUT out of range is answered with 422, naming field, value and limit; nothing changes."""
    with device.control():
        before = device.send("GET", _SEQUENCE)
        for change in _out_of_range(device.camera["capabilities"]):
            ((field, value),) = change.items()
            body = before.json() | change
            refused = device.refusal(
                device.send("PUT", _SEQUENCE, json=body), 422, "invalid-sequence", field=field
            )
            equal(refused.get("value"), value, f"`value` in the problem of {field}")
            after = device.send("GET", _SEQUENCE)
            equal(after.json(), before.json(), f"the sequence after a refused {field}")
            equal(after.headers.get("etag"), before.headers.get("etag"), "its ETag")


def a_parameter_out_of_range_is_refused_and_changes_nothing(device: Device) -> None:
    """Every parameter that can be written refuses what is beyond its min and max with 422."""
    with device.control():
        for each in _parameters(device):
            if each["access"] != _CHANGEABLE:
                continue
            before = device.read(each["resource"])
            for value in _beyond(each):
                body = _with(before, each["pointer"], value)
                response = device.send("PUT", each["resource"], json=body)
                expect(
                    response.status_code == 422,
                    f"{each['name']} = {value} beyond its limits gives {response.status_code}",
                )
                device.refusal(response, 422)
                after = device.read(each["resource"])
                equal(after, before, f"{each['resource']} after a refused {each['name']}")


def the_limits_of_a_sequence_are_taken(device: Device) -> None:
    """Values on a limit of the sequence are accepted: min and max belong to the range."""
    for each in _parameters(device):
        if each["resource"] != _SEQUENCE or each["access"] != _CHANGEABLE:
            continue
        for value in (each.get("min"), each.get("max")):
            if value is None:
                continue
            body = _with(device.sequence, each["pointer"], value)
            response = device.send("POST", f"{_SEQUENCE}/validate", json=body)
            refused = f"{each['name']} = {value}, its limit, is refused"
            expect(response.is_success, f"{refused}: {problem(answer_of(response))}")


def a_checked_sequence_is_not_set(device: Device) -> None:
    """Validating a sequence returns what would be set, and sets nothing."""
    before = device.sequence
    harmonics = device.fixed_harmonics or 1
    longest_s = device.camera["capabilities"]["max_exposure_s"]
    body = {"harmonics": harmonics, "exposure_s": longest_s}
    checked = device.document(device.send("POST", f"{_SEQUENCE}/validate", json=body))
    equal({key: checked[key] for key in body}, body, "what would be set")
    equal(device.sequence, before, "the sequence after a check")


def _parameters(device: Device) -> list[dict[str, Any]]:
    parameters: list[dict[str, Any]] = device.read(f"{API}/parameters")["parameters"]
    expect(parameters, "there are no parameters")
    return parameters


def _out_of_range(capabilities: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
    yield {"harmonics": capabilities["max_harmonics"] + 1}
    yield {"harmonics": 0}
    yield {"takes": capabilities["max_takes"] + 1}
    yield {"exposure_s": capabilities["max_exposure_s"] * 2.0}
    yield {"exposure_s": capabilities["min_exposure_s"] / 2.0}
    yield {"exposure_s": -1.0}
    yield {"base_frequency_hz": capabilities["max_frequency_hz"] * 2.0}
    yield {"base_frequency_hz": capabilities["min_frequency_hz"] / 2.0}
    yield {"zeroth": "no-such-way"}


def _beyond(parameter: Mapping[str, Any]) -> Iterator[float]:
    whole = parameter["type"] == "integer"
    least, most = parameter.get("min"), parameter.get("max")
    if least is not None:
        yield least - 1 if whole else least - abs(least) - 1.0
    if most is not None:
        yield most + 1 if whole else most + abs(most) + 1.0


def _steps(pointer: str) -> list[str]:
    return [each.replace("~1", "/").replace("~0", "~") for each in pointer.split("/")[1:]]


def _at(document: Any, pointer: str) -> Any:
    for step in _steps(pointer):
        expect(isinstance(document, dict) and step in document, f"there is nothing at {pointer}")
        document = document[step]
    return document


def _with(document: Mapping[str, Any], pointer: str, value: object) -> dict[str, Any]:
    first, *rest = _steps(pointer)
    changed = _with(document[first], "/" + "/".join(rest), value) if rest else value
    return {**document, first: changed}
