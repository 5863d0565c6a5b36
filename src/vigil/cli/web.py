"""`vigil view`, `vigil play` and `vigil review`: the pages on loopback."""

import threading
import webbrowser
from pathlib import Path
from typing import Annotated

import typer
import uvicorn
from fastapi import FastAPI

from vigil.web.drawing import Drawer
from vigil.web.library import Library
from vigil.web.site import Address
from vigil.web.view import make_view

Host = Annotated[str, typer.Option(help="Address to serve on; another than loopback needs --token.")]
Port = Annotated[int, typer.Option(min=0, max=65535, help="Port to serve on.")]
Token = Annotated[str, typer.Option(envvar="VIGIL_TOKEN", help="Ask visitors for this token.", show_default=False)]
Open = Annotated[bool, typer.Option("--open/--no-open", help="Open a browser.")]
RUNS = Path("runs")


def view(
    runs: Annotated[list[Path] | None, typer.Argument(help="Runs, or folders with runs.", show_default="runs")] = None,
    pack: Annotated[list[str] | None, typer.Option(help="A pack's folder or name; may be repeated.")] = None,
    port: Port = 8377,
    host: Host = "127.0.0.1",
    token: Token = "",
    open_browser: Open = True,
) -> None:
    """Shows runs, episodes step by step, and houses in the browser.

    Example: vigil view runs
    """
    roots = runs or ([RUNS] if RUNS.is_dir() else [])
    address = Address(host, port, token)
    drawer = Drawer()
    try:
        serve(make_view(Library(roots, pack or ["starter"]), drawer, address), address, open_browser)
    finally:
        drawer.close()


def serve(site: FastAPI, address: Address, open_browser: bool) -> None:
    """Serves a site until it is interrupted."""
    host = f"[{address.host}]" if ":" in address.host else address.host
    url = f"http://{host}:{address.port}/" + (f"?token={address.token}" if address.token else "")
    print(f"Serving {url} (Ctrl-C ends)", flush=True)
    if open_browser:
        threading.Timer(1.0, webbrowser.open, [url]).start()
    uvicorn.run(site, host=address.host, port=address.port, log_level="warning", server_header=False)
