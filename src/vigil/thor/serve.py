"""The start of the engine: reads the client's command line, and answers over the connection that the client wants."""

import argparse
import ctypes
import os
import sys
from collections.abc import Sequence
from pathlib import Path

from vigil.assets.database import AssetDatabase
from vigil.errors import SettingError, VigilError
from vigil.sim import EDITABLE_BACKENDS, make_simulator
from vigil.sim.scene_editor import SceneEditor
from vigil.thor.base.settings import Settings
from vigil.thor.base.world import World
from vigil.thor.engine import ThorEngine
from vigil.thor.wire import fifo, wsgi

MALLOPT = {"M_MMAP_THRESHOLD": -3, "M_TRIM_THRESHOLD": -1}
"""Options of glibc's allocator (malloc.h), and their numbers."""
LARGE_BYTES = 128 * 1024
"""Blocks of memory of at least this size go back to the system when they are freed. glibc begins with this size."""
WIRES = {"FIFO": fifo.serve, "WSGI": wsgi.serve}


def main(words: Sequence[str]) -> int:
    """Serve one client until the client ends. Return the exit status, which is 2 after an error."""
    try:
        given, _ = _parser().parse_known_args(words)
        return_large_blocks()
        kind = os.environ.get("AI2THOR_SERVER_TYPE")
        if kind not in WIRES:
            raise SettingError(
                "The engine is started by AI2-THOR's client, not by hand: "
                "Controller(local_executable_path=vigil.thor_engine(), scene=house)."
            )
        WIRES[kind](ThorEngine(_world(given, has_patches=kind == "FIFO")), os.environ)
    except VigilError as error:
        print(error, file=sys.stderr)
        return 2
    return 0


def return_large_blocks() -> None:
    """Make glibc return large blocks of memory to the system. Otherwise it keeps more and more for later houses."""
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None) if sys.platform == "linux" else None
    if mallopt is None:
        return
    for option in MALLOPT.values():
        mallopt(option, LARGE_BYTES)


def _world(given: argparse.Namespace, *, has_patches: bool) -> World:
    editor = make_simulator(given.backend, assets=AssetDatabase.from_file(given.assets), quality=given.quality)
    if not isinstance(editor, SceneEditor):
        raise SettingError(f"Backend {given.backend!r} cannot serve AI2-THOR's client: its scene cannot be edited.")
    settings = Settings(screen_width=given.width, screen_height=given.height, render_image=not given.without_pictures)
    return World(editor, settings, serves_patches=has_patches, knows_sizes=given.assets is not None)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="vigil thor-engine", allow_abbrev=False)
    parser.add_argument("--backend", default="mujoco", choices=sorted(EDITABLE_BACKENDS))
    parser.add_argument("--render-quality", dest="quality", default="default", choices=["default", "fast"])
    parser.add_argument(
        "--assets", type=Path, default=None, help="AI2-THOR's asset-database.json, which gives the sizes of the objects"
    )
    parser.add_argument("-screen-width", dest="width", type=int, default=300, help=argparse.SUPPRESS)
    parser.add_argument("-screen-height", dest="height", type=int, default=300, help=argparse.SUPPRESS)
    parser.add_argument("-nographics", dest="without_pictures", action="store_true", help=argparse.SUPPRESS)
    return parser
