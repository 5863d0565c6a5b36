"""`vigil pack`: what is in a pack, whether every episode is valid, and how two packs differ."""

from __future__ import annotations

import json
import os
from collections import Counter
from contextlib import ExitStack, closing
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table

from vigil.base.settings import Setting
from vigil.cli.arguments import AsJson, PackArgument, Robust
from vigil.cli.progress import progress
from vigil.cli.text import console, print_notes
from vigil.packs.private import is_private
from vigil.runner.shared_settings import AssetFile, Backend, EpisodeIds, Families, Workers

if TYPE_CHECKING:
    from vigil.assets.database import AssetDatabase
    from vigil.authoring.review.compare_backends import BackendComparison
    from vigil.packs.pack import Pack


def list_packs(as_json: AsJson = False) -> None:
    """Example: vigil pack list"""
    from vigil.packs.names import other_names, version_words
    from vigil.packs.pack import find_pack, manifest_of, manifest_sha256, packaged_names

    manifests = {name: manifest_of(name) for name in packaged_names()}
    rows = [
        {
            "name": name,
            "also": other_names(name, manifest.meta.get("aliases", ())),
            "version": version_words(name, manifest.version),
            "episodes": manifest.episodes,
            "families": len(manifest.families),
            "houses": manifest.houses,
            "sha256": manifest_sha256(find_pack(name)),
        }
        for name, manifest in manifests.items()
    ]
    if as_json:
        print(json.dumps(rows))
        return
    table = Table("--pack", "or", "version", "episodes", "families", "houses", "sha256")
    for row in rows:
        counts = (str(row[key]) for key in ("episodes", "families", "houses"))
        table.add_row(row["name"], ", ".join(row["also"]), row["version"], *counts, row["sha256"][:12])
    console().print(table)
    print("For a custom pack, give its folder instead of a name. `vigil pack info NAME` says more.")


def info(pack: PackArgument, as_json: AsJson = False) -> None:
    """Example: vigil pack info starter"""
    from vigil.authoring.packing.dataset_card import skill_shares, steps_of
    from vigil.packs.names import version_words
    from vigil.packs.pack import Pack
    from vigil.scoring.levels import read_pack_levels

    loaded = Pack.load(pack)
    print_notes(loaded.manifest.version_notes)
    if as_json:
        solutions = {"steps": steps_of(loaded), "skills": skill_shares(loaded)}
        levels = Counter(each.level for each in read_pack_levels(loaded.folder).values())
        facts = {"sha256": loaded.sha256, "solutions": solutions, "levels": levels}
        print(json.dumps({**loaded.manifest.model_dump(mode="json"), **facts}))
        return
    manifest = loaded.manifest
    version = version_words(manifest.name, manifest.version)
    print(f"{manifest.name} (version {version}): {manifest.episodes} episodes in {manifest.houses} houses")
    print(f"made with rules {manifest.versions.rules}, shapes {manifest.versions.shapes}")
    if is_private(manifest.meta):
        print("private: made from a secret seed. Do not share this output; the pack's card says what may be shared.")
    print(f"sha256 {loaded.sha256}; all {len(manifest.files)} files as frozen")
    _print_families(loaded)
    _print_levels(loaded)
    strata = manifest.meta.get("strata")
    if strata is not None:
        _print_strata(strata)
        print(f"reviewed: {manifest.meta['reviews']}")
        if manifest.meta["text_guess_sv"] is not None:
            print(f"SV labels guessed correctly from the object's category: share {manifest.meta['text_guess_sv']}")


def _print_families(pack: Pack) -> None:
    """Print the paper's tables of families: numbers of episodes, budgets and skills."""
    from vigil.protocol.families import FAMILIES

    table = Table("family", "name", "layer", "visible", "episodes", "houses", "steps", "invalid", "skills", "templates")
    for family, spec in FAMILIES.items():
        episodes = [episode for episode in pack.episodes if episode.family == family]
        templates = Counter(episode.provenance.template for episode in episodes)
        table.add_row(
            family,
            spec.name,
            spec.tier,
            "yes" if spec.visible_at_start else "no",
            str(len(episodes)),
            str(len({episode.house.name for episode in episodes})),
            str(spec.max_steps),
            str(spec.max_invalid),
            ", ".join(spec.skills),
            ", ".join(f"{name} {count}" for name, count in sorted(templates.items()) if name),
        )
    console().print(table)


def _print_levels(pack: Pack) -> None:
    """Print the number of episodes by family and level, if the pack has levels."""
    from vigil.protocol.families import FAMILIES
    from vigil.scoring.levels import LEVELS, read_pack_levels

    levels = read_pack_levels(pack.folder)
    if not levels:
        return
    counts = Counter((episode.family, levels[episode.id].level) for episode in pack.episodes if episode.id in levels)
    table = Table("family", *LEVELS)
    for family in (family for family in FAMILIES if any(counts[family, level] for level in LEVELS)):
        table.add_row(family, *(str(counts[family, level]) for level in LEVELS))
    console().print(table)


def _print_strata(strata: dict) -> None:
    from vigil.protocol.families import FAMILIES
    from vigil.scoring.target_strata import sort_by_size

    table = Table("of", "counts")
    named = {family: strata["families"][family] for family in FAMILIES if family in strata["families"]}
    named |= {name: strata[name] for name in ("rooms", "house_sizes", "categories")}
    named["not found by turning"] = strata["not_found_by_turning"]
    for name, counts in named.items():
        table.add_row(name, ", ".join(f"{key} {count}" for key, count in sort_by_size(counts).items()))
    console().print(table)


def verify(
    pack: PackArgument,
    workers: Workers = None,
    log: Annotated[
        Path | None,
        Setting(
            "File that records which episodes are already verified, so that the same command continues an "
            "interrupted check."
        ),
    ] = None,
    assets: AssetFile = None,
    backend: Backend = "mujoco",
    robust: Robust = False,
) -> None:
    """Example: vigil pack verify starter"""
    from vigil.authoring.packing.verify import VerificationSettings, verify_pack
    from vigil.runner.workers.pool import worker_count

    loaded, database = load_pack(pack, assets)
    with progress("verify") as show:
        settings = VerificationSettings(backend, database, worker_count(workers), robust)
        findings = verify_pack(loaded, settings, log, lambda done, of, faulty: show(done, of, f"{faulty} faulty"))
    for finding in findings:
        print(finding)
    family_of = {episode.id: episode.family for episode in loaded.episodes}
    broken = {(found.episode_id, found.rule) for found in findings}
    by_rule = Counter((family_of[name], rule) for name, rule in broken)
    for (family, rule), count in sorted(by_rule.items()):
        print(f"{family}: {count} episodes break the rule {rule}")
    faulty = len({finding.episode_id for finding in findings})
    print(f"{len(loaded.episodes) - faulty} of {len(loaded.episodes)} episodes of pack {loaded.name!r} are valid")
    if findings:
        raise typer.Exit(2)


def load_pack(pack: str | Path, assets: Path | None) -> tuple[Pack, AssetDatabase]:
    """Print the notes of a pack, and return it with its asset database. Raises PackMismatch."""
    from vigil.assets.database import AssetDatabase
    from vigil.packs.pack import Pack

    loaded, database = Pack.load(pack), AssetDatabase.from_file(assets)
    print_notes(loaded.manifest.version_notes)
    loaded.check_assets(database)
    return loaded, database


def compare_back_ends(
    pack: PackArgument,
    family: Families = (),
    episode: EpisodeIds = (),
    limit: Annotated[
        int | None,
        Setting(
            "Maximum number of episodes to compare, spread evenly over the families. All episodes if unset.", minimum=1
        ),
    ] = None,
    first: Annotated[str, Setting("First of the two simulators to compare.")] = "mujoco",
    second: Annotated[str, Setting("Second of the two simulators to compare.")] = "thor",
    assets: AssetFile = None,
    as_json: AsJson = False,
) -> None:
    """Example: vigil compare-backends vigil_smoke

    The simulator thor uses VIGIL's engine for AI2-THOR, unless the variable VIGIL_THOR_ENGINE chooses another engine.
    """
    from vigil.authoring.review.compare_backends import compare_backends
    from vigil.packs.pack import Selection
    from vigil.sim import make_simulator
    from vigil.sim.thor.differences import EXPLAINED
    from vigil.sim.thor.start import ENGINE_VARIABLE, OWN

    os.environ.setdefault(ENGINE_VARIABLE, OWN)
    loaded, database = load_pack(pack, assets)
    episodes = loaded.select(Selection(family, episode, limit))
    with ExitStack() as stack, progress("compare") as show:
        a, b = (stack.enter_context(closing(make_simulator(name, assets=database))) for name in (first, second))
        found = compare_backends(loaded, episodes, a, b, lambda done, of: show(done, of, ""))
    explained = EXPLAINED if "thor" in (first, second) else frozenset()
    if as_json:
        print(json.dumps(_as_json(found, explained)))
    else:
        _print_differences(found, explained)
    if any(each.kind not in explained for each in found.differences):
        raise typer.Exit(1)


def _as_json(found: BackendComparison, explained: frozenset[str]) -> dict[str, object]:
    from vigil.authoring.review.compare_backends import KINDS

    counts = {kind: len(found.of_kind(kind)) for kind in KINDS}
    unexplained = [str(each) for each in found.differences if each.kind not in explained]
    facts = {"first": found.a, "second": found.b, "episodes": found.episodes, "actions": found.steps}
    return {**facts, "differences": counts, "explained": sorted(explained), "unexplained": unexplained}


def _print_differences(found: BackendComparison, explained: frozenset[str]) -> None:
    from vigil.authoring.review.compare_backends import KINDS

    print(f"{found.a} / {found.b}: {found.episodes} episodes, {found.steps} actions")
    table = Table("of what", "facts", "episodes", "explained", "for example")
    for kind, what in KINDS.items():
        some = found.of_kind(kind)
        if some:
            is_explained = "yes" if kind in explained else "no"
            table.add_row(what, str(len(some)), str(len({e.episode_id for e in some})), is_explained, str(some[0]))
    console().print(table)
    for each in found.differences:
        if each.kind not in explained:
            print(each)
    print("docs/ai2thor.md lists the explained differences and their reasons.")


def diff(
    a: PackArgument,
    b: Annotated[str, typer.Argument(help="Pack that is compared with the first one: its folder or its name.")],
    as_json: AsJson = False,
) -> None:
    """Example: vigil pack diff starter my_starter"""
    from vigil.authoring.packing.compare import compare
    from vigil.packs.pack import Pack

    found = compare(Pack.load(a), Pack.load(b))
    if as_json:
        print(json.dumps(asdict(found)))
    else:
        for mark, ids in (("-", found.only_a), ("+", found.only_b)):
            for name in ids:
                print(f"{mark} {name}")
        for name, fields in found.changed.items():
            print(f"~ {name}: {', '.join(fields)}")
        print(f"{found.same} the same, {len(found.changed)} changed, {len(found.only_a)} gone, {len(found.only_b)} new")
    if not found.is_none:
        raise typer.Exit(1)


def build_starter_pack(out: Annotated[Path, Setting("Folder for the pack: new or empty.")]) -> None:
    """Example: vigil pack build-starter --out my_starter"""
    from vigil.assets.database import AssetDatabase
    from vigil.authoring.packing.starter import build_starter
    from vigil.sim import make_simulator

    pack = build_starter(out, make_simulator("mujoco", assets=AssetDatabase.default()), print)
    print(f"{out}: {len(pack.episodes)} episodes, sha256 {pack.sha256}")
