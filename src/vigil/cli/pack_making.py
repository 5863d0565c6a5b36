"""`vigil pack propose`, `build`, `make` and `remake`: from houses to drafts, from drafts and reviews to a pack."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from vigil.assets.database import AssetDatabase
from vigil.authoring.closure.generation import closure_worker
from vigil.authoring.drafting.drafts import DraftsFile, HouseOrigin
from vigil.authoring.drafting.generation import (
    PER_HOUSE,
    TRIED,
    GenerationSettings,
    generate_drafts,
)
from vigil.authoring.drafting.model_proposals import model_proposer
from vigil.authoring.drafting.procthor import FORM
from vigil.authoring.drafting.sources import HouseInFile, HouseSource, draw_sample, houses_from
from vigil.authoring.packing.assemble import MAX_PER_HOUSE, PER_FAMILY, PackRequest, assemble, candidates
from vigil.authoring.packing.candidate_checks import candidate_checker, house_finder
from vigil.authoring.packing.level_measurement import measured_levels
from vigil.authoring.packing.recipes import (
    Recipe,
    check_assets,
    check_drafts,
    check_houses,
    origins_of,
    recipe_of,
    sources_of,
)
from vigil.authoring.packing.verify import VerificationSettings, episode_tasks, house_batches
from vigil.authoring.review.reviews import Review, read_reviews
from vigil.cli.arguments import Robust, SeedFile
from vigil.cli.making.closure import (
    Kinds,
    Suite,
    build_suite,
    draft_suite,
    parse_tasks,
    refuse_with_suite,
    refuse_without_suite,
    suite_request,
    suite_settings,
)
from vigil.cli.making.drafting import (
    FormsOption,
    drafting_for_pack,
    drafts_summary,
    forms_named,
    progress_callback,
)
from vigil.cli.making.houses import SECRET_RECIPE, generated_sources, parse_specs, requested_sources
from vigil.cli.progress import progress
from vigil.cli.text import print_note, print_notes
from vigil.errors import SettingError
from vigil.packs.freeze import check_can_freeze
from vigil.packs.pack import Pack
from vigil.packs.private import chosen_seed, is_secret
from vigil.protocol.families import FAMILIES
from vigil.runner.models.access import Endpoint, model_access
from vigil.runner.models.completion import open_completion
from vigil.runner.shared_settings import ApiKeyEnv, AssetFile, Backend, BaseUrl, Families, Workers
from vigil.runner.workers.pool import worker_count
from vigil.scoring.closure import Kind
from vigil.scoring.levels import LEVELS, EpisodeLevel, parse_levels

Rooms = Annotated[str, typer.Option(help="Numbers of rooms, or specs, of generated houses, in turn.")]
HousePlaces = Annotated[
    list[str] | None, typer.Option(help=f"House file (.json, .jsonl, .jsonl.gz), or {FORM}; repeat.")
]
Name = Annotated[str, typer.Option(help="Name of the pack.")]
PerFamily = Annotated[int, typer.Option(min=1, help="Number of episodes of each family.")]
MaxPerHouse = Annotated[int, typer.Option(min=1, help="Maximum number of episodes of a family in a house.")]
LevelNames = Annotated[
    list[str] | None,
    typer.Option(
        "--level", help=f"{', '.join(LEVELS)} or all: shared out evenly; may be repeated.", show_default="any"
    ),
]
Starts = Annotated[
    int, typer.Option("--hardest-of", min=1, help="Number of starts drawn for each draft; the hardest is kept.")
]
Reviews = Annotated[list[Path] | None, typer.Option("--review", "--reviews", help="Review file; may be repeated.")]


def propose(
    out: Annotated[Path, typer.Option(help="Drafts file (JSONL); the same command continues it.")],
    houses: HousePlaces = None,
    seeds: Annotated[str | None, typer.Option(help="Seeds FIRST:END of houses to generate instead.")] = None,
    rooms: Rooms = "mixed",
    families: Families = (),
    suite: Suite = None,
    grammar: Annotated[bool, typer.Option(
        "--grammar", help="Propose with the built-in grammar (the default).")] = False,
    model: Annotated[str | None, typer.Option(help="Model that proposes instead, as provider/model.")] = None,
    base_url: BaseUrl = None,
    api_key_env: ApiKeyEnv = None,
    seed: Annotated[int | None, typer.Option(help="Random seed; 0 if unset.")] = None,
    seed_file: SeedFile = None,
    per_house: Annotated[int, typer.Option(min=1, help=
        "Maximum number of drafts kept per family and house.")] = PER_HOUSE,
    tries: Annotated[int, typer.Option(min=1, help="Maximum number of drafts tried per family and house.")] = TRIED,
    hardest_of: Starts = 1,
    forms: FormsOption = None,
    limit: Annotated[int | None, typer.Option(min=1, help="Only the first N houses of each --houses.")] = None,
    workers: Workers = None,
    backend: Backend = "mujoco",
    assets: AssetFile = None,
) -> None:  # fmt: skip
    """Examples:
    vigil pack propose --seeds 100:160 --rooms kitchen,2,3 --out drafts.jsonl
    vigil pack propose --houses house.json --family SM --model openai/gpt-4o --out drafts.jsonl
    vigil pack propose --suite closure --seeds 100:160 --out closure.jsonl
    vigil pack propose --seeds 0:60 --seed-file secret.txt --out private.jsonl

    With a secret seed, --seeds numbers the houses, and names do not reveal the seed.
    """
    drawn_by = chosen_seed(seed, seed_file) or 0
    if grammar and model is not None:
        raise SettingError("--grammar and --model exclude each other.")
    settings = GenerationSettings(
        families or tuple(FAMILIES),
        drawn_by,
        per_house,
        tries,
        backend,
        AssetDatabase.from_file(assets),
        forms=forms_named(forms or "public"),
        starts=hardest_of,
        is_seed_secret=is_secret(drawn_by),
    )
    if suite is not None:
        refuse_with_suite(family=families, model=model, grammar=grammar, hardest_of=hardest_of > 1)
        settings = suite_settings(settings)
    sources = requested_sources(houses or [], seeds, parse_specs(rooms, suite), limit, settings.secret, print_note)
    file = DraftsFile(out)
    with progress("houses") as show:
        on_progress = progress_callback(show)
        if model is None:
            make_worker = closure_worker if suite else None
            generate_drafts(
                file, sources, settings, workers=worker_count(workers), make_worker=make_worker, on_progress=on_progress
            )
        else:
            with open_completion(Endpoint(model_access(model, base_url, {}, api_key_env))) as complete:
                proposer = model, model_proposer(complete, per_house, model)
                generate_drafts(file, sources, settings, proposer=proposer, on_progress=on_progress)
    drafts_summary(file)


def build(
    name: Name,
    out: Annotated[Path, typer.Option(help="New or empty folder.")],
    drafts: Annotated[list[Path] | None, typer.Option(help="Drafts file; may be repeated.")] = None,
    kept: Annotated[
        Path | None, typer.Option("--earlier-drafts", help="Drafts of an earlier version of the pack; chosen first.")
    ] = None,
    version: Annotated[str, typer.Option(help="Version of the pack.")] = "1",
    reviews: Reviews = None,
    per_family: PerFamily = PER_FAMILY,
    families: Families = (),
    suite: Suite = None,
    kind: Kinds = None,
    alias: Annotated[list[str] | None, typer.Option(help="Another name of the pack; may be repeated.")] = None,
    description: Annotated[str, typer.Option(help="One sentence for the manifest and the card.")] = "",
    seed: Annotated[int | None, typer.Option(help="Random seed for breaking ties; 0 if unset.")] = None,
    seed_file: SeedFile = None,
    max_per_house: MaxPerHouse = MAX_PER_HOUSE,
    level: LevelNames = None,
    robust: Robust = False,
    workers: Workers = None,
    backend: Backend = "mujoco",
    assets: AssetFile = None,
) -> None:  # fmt: skip
    """Example: vigil pack build --drafts drafts.jsonl --reviews reviews.jsonl --per-family 10 --name mine --out mine"""
    old = DraftsFile(kept) if kept else None
    files = [*([old] if old else []), *(DraftsFile(path) for path in drafts or [])]
    if not files:
        raise SettingError("Give --drafts, --earlier-drafts or both: files with episodes to choose from.")
    if suite is not None:
        refuse_with_suite(family=families, earlier_drafts=kept, level=level, robust=robust)
    else:
        refuse_without_suite(kind)
    given = [review for path in reviews or [] for review in _reviews(path)]
    breaks_ties = chosen_seed(seed, seed_file) or 0
    database = AssetDatabase.from_file(assets)
    pack_request = PackRequest(
        name,
        per_family,
        breaks_ties,
        max_per_house,
        version=version,
        description=description,
        aliases=tuple(alias or []),
        families=families or tuple(FAMILIES),
        is_seed_secret=any(map(is_secret, (breaks_ties, *(file.read().header.seed for file in files)))),
        asset_database_sha256=database.sha256,
        levels=parse_levels(level or []),
        is_robust=robust,
    )
    verification = VerificationSettings(backend, database, worker_count(workers), robust)
    if suite is not None:
        asked = suite_request(pack_request, parse_tasks(kind or [], per_family))
        with progress("checks"):
            build_suite(out, files, asked, given, verification)
        return
    _freeze(out, files, given, pack_request, verification, kept=old)


def _freeze(
    out: Path,
    files: list[DraftsFile],
    given: list[Review],
    pack_request: PackRequest,
    verification: VerificationSettings,
    *,
    kept: DraftsFile | None = None,
) -> Pack:
    levels = _levels(files, given, pack_request, verification, kept)
    with progress("checks") as show:
        check = candidate_checker(files, verification, lambda now: show(now.done, now.of, f"{now.faulty} left out"))
        pack, bad = assemble(out, files, given, pack_request, check, previous=kept, levels=levels)
    for findings in bad.values():
        print(f"left out: {findings[0]}")
    print(f"{out}: {len(pack.episodes)} episodes in {pack.manifest.houses} houses, sha256 {pack.sha256}")
    print(f"reviewed: {pack.manifest.meta['reviews']}")
    return pack


def _levels(
    files: list[DraftsFile],
    given: list[Review],
    pack_request: PackRequest,
    verification: VerificationSettings,
    kept: DraftsFile | None,
) -> dict[str, EpisodeLevel] | None:
    """Return the level of every candidate draft; None if the pack does not ask for levels."""
    if not pack_request.levels:
        return None
    pool = [each for each in candidates(files, given, kept) if each.episode.family in pack_request.families]
    solved = {candidate.episode.id: candidate.draft.actions for candidate in pool}
    work = house_batches(episode_tasks([each.episode for each in pool], solved), house_finder(files))
    with progress("levels") as show:
        return {found.episode_id: found for found in measured_levels(work, verification, show)}


def make(
    name: Name,
    out: Annotated[Path, typer.Option(help="New or empty folder; drafts are kept next to it.")],
    seed: Annotated[int | None, typer.Option(min=0, help="Random seed of the pack: keep it secret.")] = None,
    seed_file: SeedFile = None,
    houses: HousePlaces = None,
    count: Annotated[int | None, typer.Option(min=1, help="Houses to draw; all of --houses if unset.")] = None,
    one_family_per_house: Annotated[
        bool, typer.Option("--one-family-per-house", help="Use each house for one family only, in turn.")
    ] = False,
    rooms: Rooms = "mixed",
    per_family: PerFamily = PER_FAMILY,
    families: Families = (),
    suite: Suite = None,
    kind: Kinds = None,
    max_per_house: MaxPerHouse = MAX_PER_HOUSE,
    level: LevelNames = None,
    forms: FormsOption = None,
    robust: Robust = False,
    hardest_of: Starts = 1,
    reviews: Reviews = None,
    workers: Workers = None,
    backend: Backend = "mujoco",
    assets: AssetFile = None,
) -> None:  # fmt: skip
    """Examples:
    vigil pack make --name held_out --seed-file seed.txt --per-family 25 --out packs/held_out
    vigil pack make --name real --houses procthor-10k:val --count 200 --per-family 25 --out packs/real
    vigil pack make --name stress --suite closure --seed 918273645 --per-family 20 --out packs/stress

    With --houses the seed, 0 by default, is not secret, and OUT.recipe.json is written, which names all houses with
    their hashes: `vigil pack remake` makes the same bytes from it.
    """
    drawn_by = _seed_of(houses, seed, seed_file)
    if suite is not None:
        refuse_with_suite(
            family=families,
            one_family_per_house=one_family_per_house,
            level=level,
            robust=robust,
            hardest_of=hardest_of > 1,
        )
    else:
        refuse_without_suite(kind)
    tasks = parse_tasks(kind or [], per_family) if suite is not None else None
    check_can_freeze(out, name)
    offered = houses_from(houses or [], report=print_note)
    origins = [] if reviews else _origins(offered)
    if houses:
        sources = draw_sample(offered, drawn_by or 0, count)
    else:
        sources = generated_sources(drawn_by or 0, count, per_family, parse_specs(rooms, suite), print_note)
    database = AssetDatabase.from_file(assets)
    pack_request = PackRequest(
        name,
        per_family,
        drawn_by or 0,
        max_per_house,
        families=families or tuple(FAMILIES),
        is_seed_secret=not houses,
        asset_database_sha256=database.sha256,
        levels=parse_levels(level or []),
        is_robust=robust,
        forms=forms_named(forms or ("public" if houses else "all")),
    )
    verification = VerificationSettings(backend, database, worker_count(workers), robust)
    given = [review for path in reviews or [] for review in _reviews(path)]
    if tasks is not None:
        pack = _make_suite(out, sources, pack_request, tasks, verification, given)
    else:
        pack = _make(
            out,
            sources,
            pack_request,
            given,
            verification,
            one_family_per_house=one_family_per_house,
            starts=hardest_of,
        )
    if origins:
        recipe = recipe_of(
            pack_request, origins, pack.sha256,
            backend=backend, drafted_in=count, one_family_per_house=one_family_per_house, starts=hardest_of,
            tasks=tasks,
        )  # fmt: skip
        _save_recipe(out, recipe)


def _seed_of(houses: list[str] | None, seed: int | None, seed_file: Path | None) -> int | None:
    """Return the seed that was given; with --houses it may be missing. Raises SettingError."""
    if houses and seed_file is not None:
        raise SettingError(SECRET_RECIPE)
    drawn_by = chosen_seed(seed, seed_file)
    if drawn_by is None and not houses:
        raise SettingError(
            "Give either --seed or --seed-file, which generate houses, or --houses with files or a dataset of them."
        )
    return drawn_by


def _save_recipe(out: Path, recipe: Recipe) -> None:
    written = out.with_name(f"{out.name}.recipe.json")
    recipe.save(written)
    print(f"{written}: with the same houses, vigil pack remake makes the same bytes from it")


def remake(
    recipe: Annotated[str, typer.Argument(help="A recipe's file, or the name of a packaged one.")],
    out: Annotated[Path, typer.Option(help="New or empty folder; drafts are kept next to it.")],
    houses: Annotated[
        list[str] | None, typer.Option(help="File with the recipe's houses, unless they are from ProcTHOR-10K.")
    ] = None,
    workers: Workers = None,
    assets: AssetFile = None,
) -> None:
    """Example: vigil pack remake procthor_one_room_v3 --houses one_room_train.jsonl.gz --out packs/one_room"""
    wanted = Recipe.load(recipe)
    check_can_freeze(out, wanted.name)
    check_drafts(wanted)
    database = AssetDatabase.from_file(assets)
    check_assets(wanted, database)
    print_notes(wanted.notes())
    sources = sources_of(wanted, houses or [], print_note)
    with progress("houses read") as show:
        check_houses(wanted, sources, lambda number: show(number, len(sources)))
    print(f"{len(sources)} houses are those of recipe {wanted.name!r}")
    verification = VerificationSettings(wanted.backend, database, worker_count(workers), wanted.is_robust)
    chosen = draw_sample(sources, wanted.seed, wanted.drafted_in)
    if wanted.suite is not None:
        pack = _make_suite(out, chosen, wanted.request, wanted.tasks, verification, [])
    else:
        one_family_per_house, starts = wanted.one_family_per_house, wanted.starts
        pack = _make(
            out, chosen, wanted.request, [], verification, one_family_per_house=one_family_per_house, starts=starts
        )
    if pack.sha256 != wanted.pack_sha256:
        print(f"not the recipe's bytes: its pack has sha256 {wanted.pack_sha256}")
        raise typer.Exit(2)
    print("the same bytes as the recipe's")


def _origins(offered: Sequence[HouseInFile]) -> list[HouseOrigin]:
    with progress("houses read") as show:
        return origins_of(offered, lambda number: show(number, len(offered)))


def _make(
    out: Path,
    sources: Sequence[HouseSource],
    pack_request: PackRequest,
    given: list[Review],
    verification: VerificationSettings,
    *,
    one_family_per_house: bool,
    starts: int,
) -> Pack:
    """Propose in all houses, or continue, and freeze the pack."""
    file, settings = drafting_for_pack(out, pack_request, verification)
    settings = replace(settings, one_family_per_house=one_family_per_house, starts=starts)
    with progress("houses") as show:
        generate_drafts(file, sources, settings, workers=verification.workers, on_progress=progress_callback(show))
    drafts_summary(file)
    return _freeze(out, [file], given, pack_request, verification)


def _make_suite(
    out: Path,
    sources: Sequence[HouseSource],
    pack_request: PackRequest,
    tasks: Mapping[Kind, int],
    verification: VerificationSettings,
    given: list[Review],
) -> Pack:
    """Propose tasks of the suite in all houses, or continue, and freeze the pack."""
    with progress("houses") as show:
        file = draft_suite(out, sources, pack_request, verification, progress_callback(show))
    drafts_summary(file)
    with progress("checks"):
        return build_suite(out, [file], suite_request(pack_request, tasks), given, verification)


def _reviews(path: Path) -> list[Review]:
    if not path.is_file():
        raise SettingError(f"Review file {str(path)!r} does not exist.")
    return read_reviews(path)
