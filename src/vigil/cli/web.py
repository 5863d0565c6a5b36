"""`vigil view`, `vigil play` and `vigil review`: the pages on loopback."""

import threading
import webbrowser
from pathlib import Path
from typing import Annotated, cast

import typer
import uvicorn
from fastapi import FastAPI

from vigil.cli.options import PackName
from vigil.episode import Family
from vigil.pack import Pack
from vigil.sim import Quality
from vigil.web.drawing import Drawer
from vigil.web.library import Library
from vigil.web.play import make_play
from vigil.web.review import Desk, make_review
from vigil.web.site import Address
from vigil.web.sitting import SittingSettings, open_sitting
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


def play(
    player: Annotated[str, typer.Option(help="Name of who plays; goes into the run's header.")],
    pack: PackName = "starter",
    limit: Annotated[int | None, typer.Option(min=1, help="Only N episodes, drawn at random.")] = None,
    family: Annotated[list[str] | None, typer.Option(help="Only this family; may be repeated.")] = None,
    practice: Annotated[bool, typer.Option("--practice", help="Show feedback and verdicts; a run of its own.")] = False,
    log_dir: Annotated[Path | None, typer.Option(help="The run's folder; the same command continues it.")] = None,
    render_quality: Annotated[Quality, typer.Option(help="Quality of the picture.")] = "default",
    backend: Annotated[str, typer.Option(help="Simulator.")] = "mujoco",
    seed: Annotated[int | None, typer.Option(help="Of the random order.", show_default="by the name")] = None,
    port: Port = 8378,
    host: Host = "127.0.0.1",
    token: Token = "",
    open_browser: Open = True,
) -> None:
    """Lets a person play episodes in the browser as an agent does; the record is a run like any other.

    Example: vigil play --pack starter --player ada --limit 10
    """
    address = Address(host, port, token)
    address.check()
    settings = SittingSettings(
        player=player,
        pack=pack,
        limit=limit,
        families=tuple(cast(Family, name.strip().upper()) for name in family or ()),
        practice=practice,
        log_dir=log_dir,
        backend=backend,
        quality=render_quality,
        seed=seed,
    )
    sitting = open_sitting(settings)
    try:
        serve(make_play(sitting, address), address, open_browser)
    finally:
        sitting.close()


def review(
    reviewer: Annotated[str, typer.Option(help="Name of who reviews.")],
    pack: PackName = "starter",
    file: Annotated[Path, typer.Option(help="Review file; verdicts are added to it.")] = Path("reviews.jsonl"),
    seed: Annotated[int, typer.Option(help="Of the queue's order.")] = 0,
    port: Port = 8379,
    host: Host = "127.0.0.1",
    token: Token = "",
    open_browser: Open = True,
) -> None:
    """Reviews the episodes of a pack in the browser; each verdict is a line of the review file at once.

    Example: vigil review --pack starter --reviewer ada --file reviews.jsonl
    """
    address = Address(host, port, token)
    desk = Desk(Pack.load(pack), file, reviewer, seed)
    drawer = Drawer()
    try:
        serve(make_review(desk, drawer, address), address, open_browser)
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
