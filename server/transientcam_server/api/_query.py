"""Reads with a query parameter that a route does not have are refused: it may be a misspelt one."""

from fastapi import Request
from fastapi.dependencies.utils import get_flat_params
from fastapi.params import Query
from fastapi.routing import APIRoute

from transientcam_server.errors import Problem, kinds, shortened


async def require_known(request: Request) -> None:
    """Refuse a read whose query has a parameter that its route does not document.

    Changes have none: their values are in the body. They pass, `safe-off` above all.
    Raises Problem ``invalid-request``, with the first such parameter and those that there are.
    """
    if not request.query_params or request.method not in ("GET", "HEAD"):
        return
    route: APIRoute = request.scope["route"]
    parameters = get_flat_params(route.dependant)
    known = [each.alias for each in parameters if isinstance(each.field_info, Query)]
    for name, value in request.query_params.items():
        if name not in known:
            limit = f"one of {', '.join(known)}" if known else "left out: there are no parameters"
            raise Problem(
                kinds.INVALID_REQUEST,
                f"There is no query parameter {shortened(name)!r} here; must be {limit}.",
                field=shortened(name),
                value=shortened(value),
                limit=limit,
            )
