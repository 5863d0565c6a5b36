"""`vigil thor`: AI2-THOR programs, unchanged, on VIGIL's engine."""

from pathlib import Path
from typing import Annotated

import typer

from vigil.cli.arguments import EngineBackend
from vigil.cli.text import print_note
from vigil.runner.shared_settings import AssetFile, RenderQuality

Program = Annotated[Path, typer.Argument(help="Python program that uses ai2thor's Controller.", show_default=False)]


def install(
    backend: EngineBackend = "mujoco", assets: AssetFile = None, render_quality: RenderQuality = "default"
) -> None:
    """Example: vigil thor install

    After this, `Controller(platform="CloudRendering", scene=house)` starts VIGIL's engine and needs no network.
    The client requires libvulkan for this platform, although the engine does not use it.
    """
    from vigil.sim.thor.requirements import examine
    from vigil.sim.thor.start import engine_options
    from vigil.thor.install import install as install_engine
    from vigil.thor.launch import check_backend

    check_backend(backend, assets)
    for folder in install_engine(engine_options(backend, render_quality, assets)):
        print(folder)
    if examine().platform != "CloudRendering":
        print_note(
            "AI2-THOR's client needs libvulkan1 for CloudRendering, and it is not installed here (apt-get install "
            "libvulkan1; no GPU is needed). `vigil thor run` works without it."
        )


def uninstall() -> None:
    """Example: vigil thor uninstall"""
    from vigil.thor.install import uninstall as uninstall_engine

    for folder in uninstall_engine():
        print(folder)


def run(
    context: typer.Context,
    program: Program,
    backend: EngineBackend = "mujoco",
    assets: AssetFile = None,
    render_quality: RenderQuality = "default",
) -> None:
    """Example: vigil thor run program.py --an-option-of-the-program

    This command needs neither `vigil thor install` nor libvulkan nor a display. Arguments after the program's name are
    passed to the program.
    """
    from vigil.sim.thor.start import engine_options
    from vigil.thor.install import run_program
    from vigil.thor.launch import check_backend

    check_backend(backend, assets)
    run_program(program, context.args, engine_options(backend, render_quality, assets))
