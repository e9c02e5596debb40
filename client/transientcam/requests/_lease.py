"""Requests for the lease of a camera."""

from collections.abc import Mapping
from typing import Any

from transientcam.errors import ProtocolError
from transientcam.requests._request import Request, document


def take_lease(terms: Mapping[str, Any]) -> Request[dict[str, Any]]:
    """Build the request for the lease."""
    return document("lease", method="POST", body=terms)


def renew_lease() -> Request[dict[str, Any]]:
    """Build the request that extends the lease by its duration."""
    return document("lease", method="PUT", body={})


def give_lease_back() -> Request[dict[str, Any]]:
    """Build the request that ends the lease."""
    return document("lease", method="DELETE")


def lease_id(granted: Mapping[str, Any]) -> str:
    """Return the id that every change under a lease has to carry.

    Raises
    ------
    ProtocolError
        If there is none.
    """
    value = granted.get("lease_id")
    if not isinstance(value, str):
        raise ProtocolError("lease_id", value, "a string")
    return value
