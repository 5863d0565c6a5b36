"""Installs VIGIL's engine in place of AI2-THOR's own build, and runs unchanged programs with it."""

import json
import runpy
import shlex
import shutil
import sys
from pathlib import Path
from typing import Any

from vigil.errors import SettingError
from vigil.sim.thor.requirements import MAKER, METADATA_FILE, PLATFORMS, is_own_release, release_folder
from vigil.sim.thor.start import own_command

SERVERS = ("FIFO", "WSGI")
"""The client's protocols that the engine supports."""


def install(options: list[str]) -> list[Path]:
    """Write the releases that AI2-THOR's client starts, and return their folders.

    `options` are the engine's options. Raises SettingError when AI2-THOR's own build is in one of the folders.
    """
    folders = [release_folder(platform) for platform in PLATFORMS]
    for folder in folders:
        if folder.exists() and not is_own_release(folder):
            raise SettingError(f"{folder} is AI2-THOR's own build. Move it elsewhere, or use `vigil thor run`.")
    for folder in folders:
        folder.mkdir(parents=True, exist_ok=True)
        program = folder / folder.name
        program.write_text(f'#!/bin/sh\n# `vigil thor uninstall` removes this.\nexec {_command(options)} "$@"\n')
        program.chmod(0o755)
        (folder / METADATA_FILE).write_text(json.dumps({"server_types": SERVERS, "made_by": MAKER}))
    return folders


def uninstall() -> list[Path]:
    """Remove the releases that `install` wrote, and the client's lock files for them; return the removed folders."""
    found = [folder for folder in map(release_folder, PLATFORMS) if is_own_release(folder)]
    for folder in found:
        shutil.rmtree(folder)
        folder.with_name(f"{folder.name}.lock").unlink(missing_ok=True)
    return found


def run_program(program: Path, arguments: list[str], options: list[str]) -> None:
    """Run a Python program. Every Controller in it starts VIGIL's engine, whatever platform the program names.

    Raises SettingError when the client or the program is missing.
    """
    if not program.is_file():
        raise SettingError(f"{program} is not a file. Give a Python program that uses ai2thor's Controller.")
    try:
        from ai2thor.controller import Controller  # noqa: PLC0415  # pyright: ignore[reportMissingImports] - an extra
    except ImportError:
        raise SettingError('AI2-THOR\'s client is not installed: pip install "vigil-bench[thor]".') from None
    command, start = own_command(options), Controller.__init__

    def start_here(self: Any, *positional: Any, **named: Any) -> None:
        for name in ("platform", "gpu_device", "local_build", "x_display"):
            named.pop(name, None)
        start(self, *positional, **{**named, "local_executable_path": command})

    Controller.__init__ = start_here
    argv, path = sys.argv, sys.path[:]
    sys.argv, sys.path[:0] = [str(program), *arguments], [str(program.parent.resolve())]
    try:
        runpy.run_path(str(program), run_name="__main__")
    finally:
        Controller.__init__, sys.argv, sys.path[:] = start, argv, path


def _command(options: list[str]) -> str:
    return shlex.join([sys.executable, "-m", "vigil.thor", *options])
