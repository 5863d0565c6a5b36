"""`vigil pack`: what is in a pack, and whether every episode holds what it promises."""

import json
from collections import Counter
from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table

from vigil.authoring.starter import build_starter
from vigil.authoring.validate import validate_pack
from vigil.cli.options import Assets, database
from vigil.cli.text import console
from vigil.episode import FAMILIES
from vigil.pack import Pack
from vigil.sim import make_simulator

app = typer.Typer(help="Look into and validate packs of episodes.", no_args_is_help=True)
PackArgument = Annotated[str, typer.Argument(help="A pack's folder, or the name of a packaged one, e.g. starter.")]


@app.command("info")
def info(pack: PackArgument, as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False) -> None:
    """Verifies every hash and says what the pack holds.

    Example: vigil pack info starter
    """
    loaded = Pack.load(pack)
    if as_json:
        print(json.dumps({**loaded.manifest.model_dump(mode="json"), "sha256": loaded.sha256}))
        return
    manifest = loaded.manifest
    print(f"{manifest.name} (version {manifest.version}): {manifest.episodes} episodes in {manifest.houses} houses")
    print(f"sha256 {loaded.sha256}; all {len(manifest.files)} files as frozen")
    table = Table("family", "name", "episodes", "houses", "steps", "invalid", "templates")
    for family, spec in FAMILIES.items():
        episodes = [episode for episode in loaded.episodes if episode.family == family]
        templates = Counter(episode.provenance.template for episode in episodes)
        table.add_row(
            family,
            spec.name,
            str(len(episodes)),
            str(len({episode.house.name for episode in episodes})),
            str(spec.max_steps),
            str(spec.max_invalid),
            ", ".join(f"{name} {count}" for name, count in sorted(templates.items())),
        )
    console().print(table)


@app.command("validate")
def validate(
    pack: PackArgument,
    assets: Assets = None,
    backend: Annotated[str, typer.Option(help="Simulator to validate in.")] = "mujoco",
) -> None:
    """Validates every episode by every rule and replays its recorded solution; exits with 2 when one fails.

    Example: vigil pack validate starter
    """
    loaded = Pack.load(pack)
    findings = validate_pack(loaded, make_simulator(backend, assets=database(assets)))
    for finding in findings:
        print(finding)
    print(f"{len(loaded.episodes)} episodes of pack {loaded.name!r}: {len(findings)} findings")
    if findings:
        raise typer.Exit(2)


@app.command("build-starter")
def build(out: Annotated[Path, typer.Option(help="New or empty folder.")]) -> None:
    """Builds the starter pack anew, from nothing: houses, drafts, validation, solutions.

    Example: vigil pack build-starter --out my_starter
    """
    pack = build_starter(out, make_simulator("mujoco", assets=database(None)), print)
    print(f"{out}: {len(pack.episodes)} episodes, sha256 {pack.sha256}")
