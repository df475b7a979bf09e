"""The web server: one page, a STOP that works without the page, and access control."""

from __future__ import annotations

import socket
import warnings
import webbrowser
from collections.abc import Callable
from contextlib import closing
from importlib.resources import files

import uvicorn
from fastapi import FastAPI, Request
from fastapi.responses import JSONResponse
from nicegui import run, ui

from xy_sysid.errors import BadInput
from xy_sysid.page.access import Access, rules
from xy_sysid.page.address import view_of_query
from xy_sysid.page.beside import beside
from xy_sysid.page.guard import Guard
from xy_sysid.page.layout import build
from xy_sysid.page.session import Session

CONFIRMS = 2.0  # s to wait for the machine's confirmation of STOP; after that the request reports that there was none
GRACE = 1  # s for open pages to close when the server ends
PATIENCE = 60.0  # s for a page to be built, with the recordings in its address
PORTS = 20  # ports to try after the requested one if it is in use


def serve(session: Session, host: str, port: int, token: str, browse: bool, say: Callable[[str], None]) -> None:
    """Serve until Ctrl-C. say: receives the address once it can be opened. Raises BadInput if the address is not available."""
    access = rules(host, token)
    app = application(session, access)
    with closing(listen(host, port)) as place:
        address = url(host, place.getsockname()[1], access)
        say(address)
        if browse:
            webbrowser.open(address)
        config = uvicorn.Config(
            app,
            log_level="warning",
            access_log=False,
            timeout_graceful_shutdown=GRACE,
            server_header=False,
            ws="websockets",  # it closes a connection with invalid UTF-8; its successor prints a traceback
            ws_max_size=1 << 22,
            lifespan="on",
        )
        warnings.filterwarnings("ignore", message="The `websockets` implementation is deprecated")  # not relevant to a user of the page
        uvicorn.Server(config).run(sockets=[place])


def application(session: Session, access: Access) -> FastAPI:
    """The application, with the guard in front of it."""
    run.process_pool_start_method = "spawn"  # a fork of this process, with the threads of ROS in it, may hang
    app = FastAPI(docs_url=None, redoc_url=None, openapi_url=None)

    @app.post("/stop")
    def stop() -> JSONResponse:
        """Command zero volts; the answer says whether the machine has confirmed it."""
        stopped, words = session.stop(CONFIRMS)
        return JSONResponse({"asked": session.link is not None, "stopped": stopped, "words": words})

    @app.get("/alive")
    def alive() -> JSONResponse:
        """Answer a health check of the process that starts the server."""
        return JSONResponse({"page": "xy_sysid"})

    assets = files("xy_sysid.page")
    style = (assets / "page.css").read_text(encoding="utf-8")
    script = (assets / "page.js").read_text(encoding="utf-8")

    @ui.page("/", title="xy_sysid", dark=None, response_timeout=PATIENCE)
    async def page(request: Request) -> None:
        ui.add_css(style)
        ui.add_body_html(f"<script>{script}</script><div id=gone role=alert></div>")
        view = view_of_query(request.url.query)
        if any(source.name for source in view.sources):
            await beside(session, lambda: run.io_bound(session.open_view, view))
        build(session, view)

    ui.run_with(app, title="xy_sysid", language="en-US", dark=None, tailwind=False, reconnect_timeout=10.0, show_welcome_message=False)
    app.add_middleware(Guard, access=access)
    return app


def listen(host: str, port: int) -> socket.socket:
    """A socket on the requested port, or on one of the next if it is in use; port 0 is any."""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    problem = ""
    for number in range(port, port + (PORTS if port else 1)):
        try:
            return socket.create_server((host, number), family=family)
        except OSError as error:
            problem = error.strerror or str(error)
    raise BadInput("--host and --port", f"{host}, {port} ({problem})", "an address of this machine and a port that is free", "Give another one.")


def url(host: str, port: int, access: Access) -> str:
    """The address to open, with the token if there is one."""
    name = socket.gethostname() if host in ("0.0.0.0", "::") else f"[{host}]" if ":" in host else host
    return f"http://{name}:{port}/" + (f"?token={access.token}" if access.token else "")
