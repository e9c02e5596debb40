"""What fuzzing leaves out, so that it does not wait: nothing here changes what may be answered."""

from typing import Any

import schemathesis

_WAIT_S = "0.01"
# a recording is bytes for schemathesis, too
schemathesis.serializer.alias("application/x-hdf5", "application/octet-stream")


@schemathesis.hook
def map_query(context: Any, query: dict[str, Any] | None) -> dict[str, Any] | None:
    """Wait shortly for frames that will never come."""
    if query and _is_number(query.get("wait_s")):
        query["wait_s"] = _WAIT_S
    return query


@schemathesis.hook
def map_body(context: Any, body: Any) -> Any:
    """Take leases that end soon, or every change after one would be refused."""
    if isinstance(body, dict) and "holder" in body and _is_number(body.get("duration_s", 30.0)):
        body["duration_s"] = min(float(body.get("duration_s", 30.0)), 1.0)
    return body


def _is_number(value: object) -> bool:
    try:
        return float(value) > 0.0  # type: ignore[arg-type]  # what it takes is being found out
    except (TypeError, ValueError):
        return False
