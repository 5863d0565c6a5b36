"""`vigil view`, `vigil play` and `vigil review`: the local web pages."""

from __future__ import annotations

import errno
import gc
import os
import signal
import socket
import sys
import threading
import webbrowser
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from vigil.base.settings import Setting
from vigil.cli.arguments import OpenBrowser
from vigil.cli.text import print_notes
from vigil.errors import SettingError
from vigil.runner.shared_settings import AssetFile, PackName, PricesOption
from vigil.web.play_settings import PlaySettings

if TYPE_CHECKING:
    from fastapi import FastAPI

    from vigil.web.site import Address

Host = Annotated[
    str,
    Setting(
        "Address on which the pages are served. An address that other machines can reach (not "
        "127.0.0.1 or localhost) needs --token."
    ),
]
Port = Annotated[int, typer.Option(min=1, max=65535, help="Port on which the pages are served.")]
Token = Annotated[
    str,
    typer.Option(
        envvar="VIGIL_TOKEN",
        help=(
            "Secret, of 8 characters or more, that visitors must give before they see the pages. If unset, "
            "visitors do not need a secret."
        ),
        show_default=False,
    ),
]
RUNS = Path("runs")
TERMINATED = 143
SCREENS = ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER")
"""Environment variables of which at least one is set if there is a screen or browser. Without them, Linux opens
browsers in the terminal."""


def view(
    runs: Annotated[
        list[Path] | None,
        typer.Argument(
            help="Folders of the runs to show. A folder that contains several runs stands for all of them.",
            show_default="runs",
        ),
    ] = None,
    pack: Annotated[
        list[str] | None, Setting("Pack whose houses and episodes are also shown, as folder or name; may be repeated.")
    ] = None,
    assets: AssetFile = None,
    prices: PricesOption = None,
    port: Port = 8377,
    host: Host = "127.0.0.1",
    token: Token = "",
    open_browser: OpenBrowser = True,
) -> None:
    """Example: vigil view runs"""
    from vigil.runner.workers.messages import RenderSettings
    from vigil.web.drawing import RenderService
    from vigil.web.library import Library
    from vigil.web.site import Address
    from vigil.web.view import make_view

    roots = runs or ([RUNS] if RUNS.is_dir() else [])
    address = Address(host, port, token)
    render_service = RenderService()
    with closing(listen(address)) as listener, closing(render_service):
        library = Library(roots, pack or ["starter"], assets, prices)
        threading.Thread(target=library.runs, daemon=True).start()  # read them while the browser opens
        serve(
            make_view(library, render_service, address, RenderSettings(asset_database=assets)),
            address,
            listener,
            open_browser,
        )


def play(
    settings: PlaySettings,
    port: Port = 8378,
    host: Host = "127.0.0.1",
    token: Token = "",
    open_browser: OpenBrowser = True,
) -> None:
    """Example: vigil play --pack starter --player ada --limit 10"""
    from vigil.packs.pack import manifest_of
    from vigil.web.play import make_play, open_play_session
    from vigil.web.site import Address

    address = Address(host, port, token)
    print_notes(manifest_of(settings.pack).version_notes)
    with closing(listen(address)) as listener, closing(open_play_session(settings)) as play_session:
        print(f"Records: {play_session.place} (the same command continues)")
        serve(make_play(play_session, address), address, listener, open_browser)


def review(
    reviewer: Annotated[str, Setting("Name of the reviewer, recorded with each verdict.")],
    pack: PackName = "starter",
    drafts: Annotated[
        Path | None, Setting("File with drafts to review instead of a pack, written by `vigil pack propose`.")
    ] = None,
    file: Annotated[Path, Setting("File to which the verdicts are added, one line each.")] = Path("reviews.jsonl"),
    seed: Annotated[int, Setting("Random seed of the order in which episodes are shown.")] = 0,
    assets: AssetFile = None,
    port: Port = 8379,
    host: Host = "127.0.0.1",
    token: Token = "",
    open_browser: OpenBrowser = True,
) -> None:
    """Examples:
    vigil review --pack starter --reviewer ada --file reviews.jsonl
    vigil review --drafts drafts.jsonl --reviewer ada
    """
    from vigil.cli.packs import load_pack
    from vigil.runner.workers.messages import RenderSettings
    from vigil.web.drawing import RenderService
    from vigil.web.review import ReviewSession, ReviewSet, make_review
    from vigil.web.site import Address

    address = Address(host, port, token)
    review_set = ReviewSet.of_pack(load_pack(pack, assets)[0]) if drafts is None else ReviewSet.of_drafts(drafts)
    session = ReviewSession(review_set, file, reviewer, seed, RenderSettings(asset_database=assets))
    with closing(listen(address)) as listener, closing(RenderService()) as render_service:
        print(f"Verdicts: {file}")
        serve(make_review(session, render_service, address), address, listener, open_browser)


def listen(address: Address) -> socket.socket:
    """Return a socket that listens at the address. Raises SettingError if it is invalid, in use or needs a token."""
    address.check()
    family = socket.AF_INET6 if ":" in address.host else socket.AF_INET
    listener = socket.socket(family, socket.SOCK_STREAM)
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind((address.host, address.port))
        listener.listen(128)
    except OSError as error:
        listener.close()
        if error.errno == errno.EADDRINUSE:
            raise SettingError(
                f"Port {address.port} is in use. Give another, e.g. --port {(address.port + 9) % 65535 + 1}."
            ) from None
        raise SettingError(
            f"--host {address.host!r} --port {address.port}: cannot listen there ({error.strerror})."
        ) from None
    return listener


def serve(site: FastAPI, address: Address, listener: socket.socket, open_browser: bool) -> None:
    """Serve a site until it is interrupted."""
    import uvicorn

    host = f"[{address.host}]" if ":" in address.host else address.host
    url = f"http://{host}:{address.port}/" + (f"?token={address.token}" if address.token else "")
    print(f"Serving {url} (Ctrl-C ends)", flush=True)
    if open_browser:
        threading.Timer(1.0, open_page, [url]).start()
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(TERMINATED))  # so that open files and processes are closed, too
    gc.freeze()  # the collector then ignores all objects loaded so far, while long runs are read
    config = uvicorn.Config(site, log_level="warning", server_header=False, ws="none")
    uvicorn.Server(config).run([listener])


def open_page(url: str) -> None:
    """Open a page in the browser; if there is no browser, print the address for the user."""
    has_screen = sys.platform != "linux" or any(os.environ.get(name) for name in SCREENS)
    if not has_screen or not webbrowser.open(url):
        print("No browser was found here. Open the address yourself.", flush=True)
