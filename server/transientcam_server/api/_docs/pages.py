"""Pages for eyes: the dashboard, the problem kinds, the interface's documentation."""

from html import escape
from importlib.resources import files
from pathlib import Path
from typing import Annotated, Any, Final

from fastapi import APIRouter, FastAPI, Path as PathParameter, Request
from fastapi.middleware.gzip import GZipMiddleware
from fastapi.responses import FileResponse, HTMLResponse, JSONResponse, Response
from fastapi.staticfiles import StaticFiles

from transientcam_server.api._docs import asyncapi
from transientcam_server.errors import Problem, kinds

STATIC: Final = Path(__file__).parents[2] / "static"

DESCRIPTION: Final = """\
An amplitude modulated lidar on the network. Frames are captured continuously; every product of a
frame is computed when it is requested, once for all clients.

All quantities are in SI units, named in the name of each field; DN are digital numbers of the
sensor. Every error is a problem document (RFC 9457). The stream of frames is the WebSocket
`/api/v1/stream`, subprotocol `transientcam.v1.msgpack`; [asyncapi.json](asyncapi.json) describes
its messages.
"""

router = APIRouter(include_in_schema=False)


@router.get("/problems")
async def problem_kinds() -> HTMLResponse:
    """List every kind of problem."""
    items = "".join(
        f'<li><a href="{kind.type[1:]}">{escape(kind.title)}</a> ({kind.status})</li>'
        for kind in kinds.KINDS.values()
    )
    return _page("Problems", f"<ul>{items}</ul>")


@router.get("/problems/{slug}")
async def problem_kind(slug: Annotated[str, PathParameter()]) -> HTMLResponse:
    """Explain one kind of problem."""
    kind = kinds.KINDS.get(slug)
    if kind is None:
        raise Problem(kinds.NOT_FOUND, f"There is no kind of problem {slug[:64]!r}.")
    return _page(
        kind.title,
        f"<p>{escape(kind.meaning)}</p><p>HTTP status {kind.status}, type "
        f"<code>{kind.type}</code>.</p>",
    )


_SWAGGER: Final = {"swagger-ui-bundle.js": "text/javascript", "swagger-ui.css": "text/css"}
# in a file of its own, because the pages of this service run no inline script
_START_SWAGGER: Final = """\
window.addEventListener("load", () => SwaggerUIBundle({
  url: "openapi.json", dom_id: "#interface", deepLinking: true, validatorUrl: null,
}));
"""


_OWN: Final = Path(__file__).parent / "files"
_OWN_FILES: Final = {"cameras.js": "text/javascript", "pages.css": "text/css"}


@router.get("/cameras")
async def cameras() -> FileResponse:
    """Show the cameras on the local network; its script asks for them with the tab's token.

    Side by side it holds the pages of the others in frames.
    """
    return FileResponse(_OWN / "cameras.html", media_type="text/html")


@router.get("/cameras/{file}")
async def cameras_file(file: Annotated[str, PathParameter()]) -> FileResponse:
    """Serve one of the files of that page."""
    if file not in _OWN_FILES:
        raise Problem(kinds.NOT_FOUND, f"There is no {file[:64]!r}.")
    return FileResponse(_OWN / file, media_type=_OWN_FILES[file])


@router.get("/docs")
async def interface() -> HTMLResponse:
    """Show the interface, with everything it needs from here and no other host."""
    return HTMLResponse(
        "<!doctype html><html lang=en><meta charset=utf-8><title>transientcam interface</title>"
        '<link rel=icon href="data:,"><link rel=stylesheet href="docs/swagger-ui.css">'
        f'<p><a href="{asyncapi.PATH[1:]}">The stream, as AsyncAPI</a></p>'
        '<div id=interface></div><script src="docs/swagger-ui-bundle.js"></script>'
        '<script src="docs/start.js"></script></html>'
    )


@router.get(asyncapi.PATH)
async def stream_interface(request: Request) -> JSONResponse:
    """Describe the stream, which OpenAPI cannot."""
    url, app = request.url, request.app
    root_path = app.state.service.settings.root_path
    return JSONResponse(
        asyncapi.asyncapi(
            version=app.version, host=url.netloc, secure=url.scheme == "https", root_path=root_path
        )
    )


@router.get("/docs/start.js")
async def start_interface() -> Response:
    """Start the page's one script."""
    return Response(_START_SWAGGER, media_type="text/javascript")


@router.get("/docs/{file}")
async def interface_file(file: Annotated[str, PathParameter()]) -> FileResponse:
    """Serve one of the files of Swagger UI."""
    if file not in _SWAGGER:
        raise Problem(kinds.NOT_FOUND, f"There is no {file[:64]!r}.")
    path = Path(str(files("fastapi_offline") / "static" / file))
    return FileResponse(path, media_type=_SWAGGER[file])


def add_dashboard(app: FastAPI) -> None:
    """Serve the built dashboard at ``/``, or a page that says how to build it."""
    if (STATIC / "index.html").is_file():
        app.get("/favicon.ico", include_in_schema=False)(_icon)
        # frames are not compressed: they are noise, and what sends them has no time for it
        app.mount("/assets", GZipMiddleware(_Assets(directory=STATIC / "assets", check_dir=False)))
        # without a fallback page an unknown path stays an error, also under /api
        app.frontend("/", directory=STATIC, fallback=None)
        return

    @app.get("/", include_in_schema=False)
    async def without_dashboard() -> HTMLResponse:
        return _page(
            "transientcam",
            "<p>The camera is served, but its dashboard was not built. In a clone, install "
            "Node.js 20 or newer and run <code>make dashboard</code>; then start again.</p>"
            '<p><a href="docs">The interface</a> works without it.</p>',
        )


class _Assets(StaticFiles):
    """Files whose names change with their content, so that browsers keep them for good."""

    def file_response(self, *args: Any, **options: Any) -> Response:
        """Serve a file, or say that it is as the client has it."""
        response = super().file_response(*args, **options)
        response.headers["Cache-Control"] = "public, max-age=31536000, immutable"
        return response


async def _icon() -> FileResponse:
    """Serve the icon that browsers ask for where no page names one, as beside a lone image."""
    return FileResponse(STATIC / "icon.svg", media_type="image/svg+xml")


def _page(title: str, body: str) -> HTMLResponse:
    return HTMLResponse(
        "<!doctype html><html lang=en><meta charset=utf-8>"
        f"<title>{escape(title)}</title><h1>{escape(title)}</h1>{body}</html>"
    )
