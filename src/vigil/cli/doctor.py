"""`vigil doctor`: what this machine has and what is missing. `vigil thor-engine`: the engine for AI2-THOR's client."""

from __future__ import annotations

import platform
import time
from contextlib import closing
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer
from PIL import Image

from vigil.base.settings import Setting
from vigil.cli.arguments import AsJson, EngineBackend
from vigil.cli.text import print_facts
from vigil.errors import SettingError, VigilError
from vigil.runner.shared_settings import AssetFile, RenderQuality

if TYPE_CHECKING:
    from vigil.sim.conformance.checks import ConformanceCheck
    from vigil.sim.conformance.harness import Harness

FAILED = "failed"
PACKAGES = ("vigil-bench", "mujoco", "shapely", "numpy", "pydantic", "inspect-ai", "openai")


def doctor(
    out: Annotated[
        Path | None,
        Setting("PNG file to which the check writes the frame that it draws. If unset, the frame is not saved."),
    ] = None,
    backend: Annotated[
        Literal["mujoco", "thor"],
        Setting(
            "Simulator to check. For mujoco, the check draws a frame; for thor, it says what AI2-THOR's engine "
            "needs on this machine, and whether AI2-THOR's client works with VIGIL's engine."
        ),
    ] = "mujoco",
    full: Annotated[
        bool,
        Setting(
            "Also play the conformance checks, which test whether the simulator behaves as the protocol "
            "requires; for --backend thor only."
        ),
    ] = False,
    as_json: AsJson = False,
) -> None:
    """Example: vigil doctor"""
    from vigil.agents.sandbox import missing_for_sandbox
    from vigil.sim.graphics_check import check_graphics as examine_renderer

    if backend == "thor":
        facts = _thor_checks() if full else _thor_facts()
        print_facts(facts, as_json)
        if any(str(fact).startswith(FAILED) for fact in facts.values()):
            raise typer.Exit(1)
        return
    found = examine_renderer()
    frame = found.pop("frame")
    if frame is not None and out is not None:
        Image.fromarray(frame).save(out)
    sandbox = {"sandbox": missing_for_sandbox() or "works (vigil run --sandbox)"}
    system = {"python": platform.python_version(), "system": platform.platform()}
    facts = {**system, **_versions(), **found, **_pack(), **sandbox}
    print_facts(facts, as_json)
    if not found["ok"] or facts["starter_pack_fault"]:
        raise typer.Exit(1)


def _versions() -> dict[str, str]:
    found = {}
    for package in PACKAGES:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            found[package] = "not installed"
    return found


def _pack() -> dict[str, str | None]:
    from vigil.packs.pack import Pack

    try:
        pack = Pack.load("starter")
    except VigilError as error:
        return {"starter_pack": None, "starter_pack_fault": str(error)}
    return {"starter_pack": f"{len(pack.episodes)} episodes, sha256 {pack.sha256[:12]}", "starter_pack_fault": None}


def thor_engine(
    context: typer.Context,
    backend: EngineBackend = "mujoco",
    assets: AssetFile = None,
    render_quality: RenderQuality = "default",
) -> None:
    """In Python: Controller(local_executable_path="vigil thor-engine --render-quality fast", scene=house)

    The client adds Unity's options to the command. In Python, `vigil.thor_engine()` returns this command, and sets the
    variable DISPLAY, which the client requires.
    """
    from vigil.sim.thor.start import engine_options
    from vigil.thor.serve import main as serve_thor

    raise typer.Exit(serve_thor([*engine_options(backend, render_quality, assets), *context.args]))


def _thor_facts() -> dict[str, str]:
    """Return what this machine lacks for AI2-THOR's own engine, and whether AI2-THOR's client works with VIGIL's
    engine."""
    from vigil.sim.thor.requirements import examine
    from vigil.sim.thor.start import chosen_engine
    from vigil.thor.launch import thor_engine as command_of_engine

    found, chosen = examine(), chosen_engine()
    other = "our engine" if chosen.command is None else f"{chosen.name} engine"
    return {
        "ai2thor client": found.client,
        "chosen engine": chosen.name,
        "AI2-THOR's engine": found.build,
        "missing for it": "; ".join(found.missing) or "nothing; it was not started",
        f"client, {other}": _try_client(chosen.command or command_of_engine(backend="fake")),
    }


def _try_client(command: str) -> str:
    from vigil.sim.conformance.reference_house import reference_house
    from vigil.sim.thor.guarded_client import GuardedClient

    began = time.monotonic()
    try:
        with closing(GuardedClient(reference_house().data, command)) as connection:
            connection.step("MoveAhead")
    except SettingError as error:
        return f"not tried: {error}"
    except VigilError as error:
        return f"{FAILED}: {error}"
    return f"works ({time.monotonic() - began:.1f} s from the start to the first step)"


def _thor_checks() -> dict[str, str]:
    """Return {conformance check: result} for the engine that AI2-THOR's client is set to use."""
    from vigil.assets.database import AssetDatabase
    from vigil.sim import make_simulator
    from vigil.sim.conformance.checks import CHECKS
    from vigil.sim.conformance.harness import Harness

    with closing(make_simulator("thor", assets=AssetDatabase.default())) as simulator:
        harness = Harness(simulator)
        return {
            "simulator": simulator.name,
            **{check.__name__: _conformance_result(check, harness) for check in CHECKS},
        }


def _conformance_result(check: ConformanceCheck, harness: Harness) -> str:
    from vigil.sim.thor.differences import EXPECTED_FAILURES

    try:
        check(harness)
    except (AssertionError, VigilError) as error:
        reason = EXPECTED_FAILURES.get(check.__name__)
        return f"{FAILED}: {error}" if reason is None else f"fails, as expected: {reason}"
    return "holds"
