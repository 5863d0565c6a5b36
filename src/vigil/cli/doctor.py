"""`vigil doctor`: what this machine has, and what is missing. `vigil thor-engine`: what AI2-THOR's client starts."""

import json
import platform
import time
from collections.abc import Mapping
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Annotated, Literal

import typer
from PIL import Image

from vigil.cli.arguments import AsJson
from vigil.errors import SettingError, VigilError
from vigil.pack import Pack
from vigil.runner.shared_settings import AssetFile, RenderQuality
from vigil.sim.conformance.trial_house import trial_house
from vigil.sim.showcase.graphics_check import doctor as examine_renderer
from vigil.sim.thor.connection import Connection
from vigil.sim.thor.requirements import examine
from vigil.sim.thor.start import engine_options
from vigil.thor.launch import thor_engine as command_of_engine
from vigil.thor.serve import main as serve_thor

PACKAGES = ("vigil-bench", "mujoco", "shapely", "numpy", "pydantic", "inspect-ai", "openai")


def doctor(
    out: Annotated[Path | None, typer.Option(help="Also write the frame that was drawn, as PNG.")] = None,
    backend: Annotated[
        Literal["mujoco", "thor"],
        typer.Option(help="thor: what AI2-THOR's own engine lacks here, and whether its client works with ours."),
    ] = "mujoco",
    as_json: AsJson = False,
) -> None:
    """Example: vigil doctor"""
    if backend == "thor":
        _say(_thor_facts(), as_json)
        return
    found = examine_renderer()
    frame = found.pop("frame")
    if frame is not None and out is not None:
        Image.fromarray(frame).save(out)
    facts = {"python": platform.python_version(), "system": platform.platform(), **_versions(), **found, **_pack()}
    _say(facts, as_json)
    if not found["ok"] or facts["starter_pack_fault"]:
        raise typer.Exit(1)


def _say(facts: Mapping[str, object], as_json: bool) -> None:
    if as_json:
        print(json.dumps(facts))
    else:
        for name, value in facts.items():
            print(f"{name:20} {_said(value)}")


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


def thor_engine(
    context: typer.Context,
    backend: Annotated[str, typer.Option(help="Simulator that it is an engine over.")] = "mujoco",
    assets: AssetFile = None,
    render_quality: RenderQuality = "default",
) -> None:
    """In Python: Controller(local_executable_path="vigil thor-engine --render-quality fast", scene=house)

    The client adds options of Unity's to the command. `vigil.thor_engine()` returns a command, and sees to DISPLAY.
    """
    raise typer.Exit(serve_thor([*engine_options(backend, render_quality, assets), *context.args]))


def _thor_facts() -> dict[str, str]:
    """Returns what AI2-THOR's own engine lacks on this machine, and whether its client works with ours."""
    found = examine()
    return {
        "ai2thor client": found.client,
        "its own engine": found.build,
        "missing for it": "; ".join(found.missing) or "nothing; it was not started",
        "client, our engine": _tried(),
    }


def _tried() -> str:
    began = time.monotonic()
    try:
        connection = Connection(trial_house().data, command_of_engine(backend="fake"))
        try:
            connection.step("MoveAhead")
        finally:
            connection.close()
    except SettingError as error:
        return f"not tried: {error}"
    except VigilError as error:
        return f"failed: {error}"
    return f"works ({time.monotonic() - began:.1f} s from the start to the first step)"
