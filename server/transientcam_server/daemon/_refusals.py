"""Problems as they travel where no application is there to answer with them."""

from http import HTTPStatus
from typing import Final

from transientcam_server.api import SECURITY_HEADERS, problem_response
from transientcam_server.errors import Problem, kinds

RETRY_AFTER_S: Final = 1
_BUSY = (kinds.TOO_MANY_CONNECTIONS, kinds.TOO_MANY_FROM_ONE_ADDRESS)


def refusal(problem: Problem) -> bytes:
    """Return the whole answer of a connection that ends with it (RFC 9112)."""
    response = problem_response(problem)
    headers = dict(response.headers) | SECURITY_HEADERS | {"Connection": "close"}
    if problem.kind in _BUSY:
        headers["Retry-After"] = str(RETRY_AFTER_S)
    status = HTTPStatus(response.status_code)
    lines = [f"HTTP/1.1 {status.value} {status.phrase}"]
    lines += [f"{name}: {value}" for name, value in headers.items()]
    return "\r\n".join([*lines, "", ""]).encode("latin-1") + bytes(response.body)
