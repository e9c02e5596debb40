"""Requests that change something."""

import json

from transientcam.requests import changes


def test_a_sequence_that_was_read_is_sent_as_it_is() -> None:
    applied = {"harmonics": 3, "sub_phases": {"scheme": "arccos", "n": 8}, "sequence_id": 4}

    request = changes.set_sequence(applied)

    assert (request.method, request.path) == ("PUT", "sequence")
    assert json.loads(request.body or b"") == applied


def test_an_unknown_field_of_a_sequence_is_left_to_the_server_to_refuse() -> None:
    request = changes.validate_sequence({"harmonix": 3})

    assert (request.method, request.path) == ("POST", "sequence/validate")
    assert request.body == b'{"harmonix": 3}'


def test_parts_of_the_simulation_that_are_none_are_left_out() -> None:
    assert changes.set_simulation("corner", None, None, None).body == b'{"scene": "corner"}'
    assert changes.set_simulation(None, None, None, False).body == b'{"diffusor": false}'
    assert (
        changes.set_simulation(None, None, {"blur": "on"}, None).body
        == b'{"effects": {"blur": "on"}}'
    )
