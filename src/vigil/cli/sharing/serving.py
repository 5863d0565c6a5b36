"""`vigil serve`: an environment that clients play over HTTP and WebSocket."""

import signal
import sys
from contextlib import closing
from importlib.util import find_spec
from typing import Annotated

import typer

from vigil.cli.text import print_notes
from vigil.cli.web import TERMINATED, Host, Port, listen
from vigil.errors import SettingError
from vigil.integrations.serve.settings import ServeSettings


def serve(
    pack: Annotated[
        str, typer.Argument(metavar="PACK", help="Pack whose episodes are served: its folder, or its name.")
    ],
    settings: ServeSettings,
    host: Host = "127.0.0.1",
    port: Port = 8380,
    token: Annotated[
        str,
        typer.Option(
            envvar="VIGIL_TOKEN",
            help="Secret, of 8 characters or more, that clients must send. Needed if --host is not loopback.",
            show_default=False,
        ),
    ] = "",
) -> None:
    """Example: vigil serve starter --name acme-vlm --log-dir runs/acme-vlm

    One server records one run, of one player. The same command continues it: episodes that were being played when the
    server ended go on. `vigil score`, `vigil view` and `vigil verify` open the run's folder.
    """
    import uvicorn

    from vigil.integrations.serve.app import make_app
    from vigil.integrations.serve.host import open_host, plan_serving
    from vigil.integrations.serve.patience import server_config
    from vigil.web.site import Address

    address = Address(host, port, token)
    if find_spec("websockets") is None:
        raise SettingError('`vigil serve` needs a library for WebSockets. Run: pip install "vigil-bench[serve]".')
    plan = plan_serving(pack, settings)
    print_notes(plan.pack.manifest.version_notes)
    with closing(listen(address)) as listener:
        served = open_host(plan, settings)
        print(f"Records: {served.place} (the same command continues)")
        print(f"Serving http://{host}:{port} for {settings.name} (Ctrl-C ends)", flush=True)
        signal.signal(signal.SIGTERM, lambda *_: sys.exit(TERMINATED))
        config = server_config(make_app(served, address), settings.max_sessions)
        uvicorn.Server(config).run([listener])
