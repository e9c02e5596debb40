"""What a request requires to be admitted: a role, and for changes the lease.

A route that reads needs a viewer, one that changes something an operator and the lease where
a client holds one. A route that differs declares it with `needs`.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Annotated, Any, Final, TypeVar

from fastapi import APIRouter, Depends, FastAPI, Request
from fastapi.routing import APIRoute

from transientcam.wire import LEASE_HEADER
from transientcam_server.api._auth.guard import Principal
from transientcam_server.api._auth.tokens import Role
from transientcam_server.api._dependencies import ServiceOf
from transientcam_server.api._problems import document_problems
from transientcam_server.errors import Problem, kinds
from transientcam_server.service import Service

_READS: Final = frozenset(("GET", "HEAD", "OPTIONS"))
_Endpoint = TypeVar("_Endpoint", bound=Callable[..., Any])


@dataclass(frozen=True, slots=True)
class Needs:
    """What a route requires: at least this role, perhaps the lease and the right to light."""

    role: Role
    lease: bool
    light: bool = False


_TO_READ: Final = Needs(Role.VIEWER, lease=False)
TO_CHANGE: Final = Needs(Role.OPERATOR, lease=True)
"""What a change of the camera or of what is kept requires."""
TO_LIGHT: Final = Needs(Role.OPERATOR, lease=True, light=True)
"""What switching the light on requires; switching it off never needs the right to light."""


def needs(role: Role, *, lease: bool, light: bool = False) -> Callable[[_Endpoint], _Endpoint]:
    """Declare what a route requires where its method does not imply it."""

    def mark(endpoint: _Endpoint) -> _Endpoint:
        setattr(endpoint, _MARK, Needs(role, lease, light))
        return endpoint

    return mark


def needed(endpoint: Callable[..., Any], method: str) -> Needs:
    """Return what is needed to call a route."""
    marked: Needs | None = getattr(endpoint, _MARK, None)
    return marked or (_TO_READ if method in _READS else TO_CHANGE)


_MARK: Final = "_transientcam_needs"


async def admit(request: Request, service: ServiceOf) -> None:
    """Admit a request of the interface, or refuse it with what it lacks."""
    require(request, service, needed(request.scope["endpoint"], request.method))


def require(request: Request, service: Service, wanted: Needs) -> None:
    """Refuse a request that lacks what it needs.

    Raises Problem ``role-too-low``, ``may-not-light``, or as `LeaseManager.check`.
    """
    principal: Principal = request.state.principal
    if principal.role < wanted.role:
        detail = f"{principal.name} is a {principal.role}, but this takes the role {wanted.role}."
        raise Problem(
            kinds.ROLE_TOO_LOW,
            detail,
            field="token",
            value=str(principal.role),
            limit=str(wanted.role),
        )
    if wanted.light and not principal.may_light:
        raise Problem(
            kinds.MAY_NOT_LIGHT,
            f"{principal.name} has not the right may_light, which whatever starts the light takes.",
            field="token",
            value=False,
            limit="may_light",
        )
    if wanted.lease:
        service.lease.check(request.headers.get(LEASE_HEADER))


async def _principal(request: Request) -> Principal:
    principal: Principal = request.state.principal
    return principal


PrincipalOf = Annotated[Principal, Depends(_principal)]
"""The client that sent a request."""


def describe(app: FastAPI, routers: Iterable[APIRouter], *, prefix: str) -> None:
    """Add to the OpenAPI document of ``app`` what each operation requires, and how it refuses.

    ``routers`` are those whose routes `admit` guards.
    """
    generate = app.openapi
    guarded = [
        (prefix + route.path_format, method.lower(), needed(route.endpoint, method))
        for router in routers
        for route in router.routes
        if isinstance(route, APIRoute) and route.include_in_schema
        for method in route.methods or ()
    ]

    def openapi() -> dict[str, Any]:
        if app.openapi_schema is None:
            document = generate()
            document["components"]["securitySchemes"] = _SCHEMES
            paths = document["paths"]
            for path, method, wanted in guarded:
                _describe(paths[path][method], wanted)
        return generate()

    app.openapi = openapi  # type: ignore[method-assign]  # as FastAPI's documentation extends it


def _describe(operation: dict[str, Any], wanted: Needs) -> None:
    operation["security"] = [{}, *({name: []} for name in _SCHEMES)]
    document_problems(operation, kinds.TOKEN_REQUIRED, kinds.TOKEN_REFUSED)
    if wanted.role > Role.VIEWER:
        document_problems(operation, kinds.ROLE_TOO_LOW)
    if wanted.light:
        document_problems(operation, kinds.MAY_NOT_LIGHT)
    if wanted.lease:
        document_problems(operation, kinds.LEASE_HELD, kinds.LEASE_LOST)
        operation.setdefault("parameters", []).append(_LEASE_PARAMETER)


_SCHEMES: Final[dict[str, Any]] = {
    "bearer": {
        "type": "http",
        "scheme": "bearer",
        "description": "A token made by `transientcam token create`. A service that only its own "
        "machine can reach requires none.",
    },
    "key": {"type": "apiKey", "in": "header", "name": "X-API-Key", "description": "The same."},
}
_LEASE_PARAMETER: Final[dict[str, Any]] = {
    "name": LEASE_HEADER,
    "in": "header",
    "required": False,
    "description": "`lease_id` of the lease this change is made under",
    "schema": {"type": "string"},
}
