"""`vigil doctor`: what this machine has, and what is missing."""

import json
import platform
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Annotated

import typer
from PIL import Image

from vigil.cli.arguments import AsJson
from vigil.errors import VigilError
from vigil.pack import Pack
from vigil.sim.showcase.graphics_check import doctor as examine_renderer

PACKAGES = ("vigil-bench", "mujoco", "shapely", "numpy", "pydantic", "inspect-ai", "openai")


def doctor(
    out: Annotated[Path | None, typer.Option(help="Also write the frame that was drawn, as PNG.")] = None,
    as_json: AsJson = False,
) -> None:
    """Example: vigil doctor"""
    found = examine_renderer()
    frame = found.pop("frame")
    if frame is not None and out is not None:
        Image.fromarray(frame).save(out)
    facts = {"python": platform.python_version(), "system": platform.platform(), **_versions(), **found, **_pack()}
    if as_json:
        print(json.dumps(facts))
    else:
        for name, value in facts.items():
            print(f"{name:20} {_said(value)}")
    if not found["ok"] or facts["starter_pack_fault"]:
        raise typer.Exit(1)


def _said(value: object) -> str:
    match value:
        case None:
            return "none"
        case bool():
            return "yes" if value else "no"
        case float():
            return f"{value:.3f}"
        case _:
            return str(value)


def _versions() -> dict[str, str]:
    found = {}
    for package in PACKAGES:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            found[package] = "not installed"
    return found


def _pack() -> dict[str, str | None]:
    try:
        pack = Pack.load("starter")
    except VigilError as error:
        return {"starter_pack": None, "starter_pack_fault": str(error)}
    return {"starter_pack": f"{len(pack.episodes)} episodes, sha256 {pack.sha256[:12]}", "starter_pack_fault": None}
