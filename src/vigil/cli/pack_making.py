"""`vigil pack propose`, `build`, `make` and `remake`: from houses to drafts, from drafts and reviews to a pack."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from vigil.assets.sizes import AssetDatabase
from vigil.authoring.closure.generation import closure_bench
from vigil.authoring.drafting.drafts import DraftsFile, HouseOrigin
from vigil.authoring.drafting.generation import (
    PER_HOUSE,
    TRIED,
    GenerationSettings,
    generate_drafts,
)
from vigil.authoring.drafting.model_proposals import model_proposer
from vigil.authoring.drafting.procthor import FORM
from vigil.authoring.drafting.sources import Filed, Source, drawn, drawn_of, filed, seeded
from vigil.authoring.packing.assemble import HOUSE_USES, PER_FAMILY, PackRequest
from vigil.authoring.packing.recipes import (
    Recipe,
    check_assets,
    check_drafts,
    check_houses,
    file_sha256,
    origins_of,
    sources_of,
)
from vigil.authoring.packing.verify import VerificationSettings
from vigil.authoring.review.reviews import Review, read_reviews
from vigil.cli.arguments import Robust
from vigil.cli.making.closure import (
    SMALL_HOUSES,
    Kinds,
    Suite,
    build_suite,
    refuse_with_suite,
    refuse_without_suite,
    suite_request,
    suite_settings,
    tasks_named,
)
from vigil.cli.making.drafting import FormsOption, drafts_summary, forms_named, shown_on
from vigil.cli.pack_freezing import Making, freeze_drafts
from vigil.cli.progress import progress
from vigil.cli.text import say, tell
from vigil.closure import Kind
from vigil.episode import FAMILIES
from vigil.errors import SettingError
from vigil.freezing import check_free
from vigil.levels import LEVELS, levels_named
from vigil.runner.models.completion import completing
from vigil.runner.shared_settings import ApiKeyEnv, AssetFile, Backend, BaseUrl, Families, Workers
from vigil.runner.workers.pool import worker_count

HOUSES_PER_EPISODE, LEAST_HOUSES = 1.12, 12
"""Houses for each episode of a family, unless said otherwise."""
Rooms = Annotated[str, typer.Option(help="Numbers of rooms or specs, in turn, of generated houses.")]
HousePlaces = Annotated[
    list[str] | None, typer.Option(help=f"House file (.json, .jsonl, .jsonl.gz), or {FORM}; repeat.")
]
Name = Annotated[str, typer.Option(help="The pack's name.")]
PerFamily = Annotated[int, typer.Option(min=1, help="Episodes of each family.")]
HouseUses = Annotated[int, typer.Option(min=1, help="Episodes of a family in a house, at most.")]
LevelNames = Annotated[
    list[str] | None,
    typer.Option(
        "--level", help=f"{', '.join(LEVELS)} or all: shared out evenly; may be repeated.", show_default="any"
    ),
]
Starts = Annotated[
    int, typer.Option("--hardest-of", min=1, help="Starts drawn for each draft, of which the hardest is kept.")
]
Reviews = Annotated[list[Path] | None, typer.Option("--review", "--reviews", help="Review file; may be repeated.")]


def propose(
    out: Annotated[Path, typer.Option(help="Drafts file (JSONL); the same command continues it.")],
    houses: HousePlaces = None,
    seeds: Annotated[str | None, typer.Option(help="FIRST:END of houses to generate instead.")] = None,
    rooms: Rooms = "mixed",
    families: Families = (),
    suite: Suite = None,
    grammar: Annotated[bool, typer.Option("--grammar", help="Propose by the built-in grammar (the default).")] = False,
    model: Annotated[str | None, typer.Option(help="provider/model that proposes instead.")] = None,
    base_url: BaseUrl = None,
    api_key_env: ApiKeyEnv = None,
    seed: Annotated[int, typer.Option(help="For everything drawn; keep it to yourself for a private pack.")] = 0,
    per_house: Annotated[int, typer.Option(min=1, help="Drafts kept of a family in a house.")] = PER_HOUSE,
    tried: Annotated[int, typer.Option(min=1, help="Drafts tried of a family in a house.")] = TRIED,
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
    """
    if grammar and model is not None:
        raise SettingError("--grammar and --model exclude each other.")
    settings = GenerationSettings(
        families or tuple(FAMILIES),
        seed,
        per_house,
        tried,
        backend,
        AssetDatabase.of(assets),
        forms=forms_named(forms or "public"),
        starts=hardest_of,
    )
    if suite is not None:
        refuse_with_suite(family=families, model=model, grammar=grammar, hardest_of=hardest_of > 1)
        settings = suite_settings(settings)
    sources = _sources(houses or [], seeds, _specs(rooms, suite), limit)
    file = DraftsFile(out)
    with progress("houses") as show:
        on_progress = shown_on(show)
        if model is None:
            bench = closure_bench if suite else None
            generate_drafts(
                file, sources, settings, workers=worker_count(workers), bench=bench, on_progress=on_progress
            )
        else:
            with completing(model, base_url, api_key_env=api_key_env) as complete:
                proposer = model, model_proposer(complete, per_house, model)
                generate_drafts(file, sources, settings, proposer=proposer, on_progress=on_progress)
    drafts_summary(file)


def build(
    name: Name,
    out: Annotated[Path, typer.Option(help="New or empty folder.")],
    drafts: Annotated[list[Path] | None, typer.Option(help="Drafts file; may be repeated.")] = None,
    kept: Annotated[
        Path | None, typer.Option(help="Drafts file of an earlier version's episodes, which enter first.")
    ] = None,
    version: Annotated[str, typer.Option(help="The pack's version.")] = "1",
    reviews: Reviews = None,
    per_family: PerFamily = PER_FAMILY,
    families: Families = (),
    suite: Suite = None,
    kind: Kinds = None,
    alias: Annotated[list[str] | None, typer.Option(help="Another name of the pack; may be repeated.")] = None,
    description: Annotated[str, typer.Option(help="One sentence for the manifest and the card.")] = "",
    seed: Annotated[int, typer.Option(help="Breaks ties.")] = 0,
    house_uses: HouseUses = HOUSE_USES,
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
        raise SettingError("Give --drafts, --kept or both: files with episodes to choose from.")
    tasks = _tasks(suite, kind, per_family, family=families, kept=kept, level=level, robust=robust)
    given = _reviews(reviews or [])
    pack_request = PackRequest(
        name,
        per_family,
        seed,
        house_uses,
        version=version,
        description=description,
        aliases=tuple(alias or []),
        families=families or tuple(FAMILIES),
        asset_database_sha256=file_sha256(assets),
        levels=levels_named(level or []),
        is_robust=robust,
    )
    verification = VerificationSettings(backend, AssetDatabase.of(assets), worker_count(workers), robust)
    if tasks is not None:
        build_suite(out, files, suite_request(pack_request, tasks), given, verification)
        return
    freeze_drafts(out, files, given, pack_request, verification, kept=old)


SECRET_FROM = 2**64
SHORT_SEED = (
    "A seed below 2^64 can be found by trying all of them against the pack. For a pack that is to stay unseen take a "
    "long one: python3 -c 'import secrets; print(secrets.randbits(128))'."
)


def make(
    name: Name,
    out: Annotated[Path, typer.Option(help="New or empty folder; drafts are kept beside it.")],
    seed: Annotated[int | None, typer.Option(min=0, help="Draws houses, drafts and all else: keep it secret.")] = None,
    houses: HousePlaces = None,
    count: Annotated[int | None, typer.Option(min=1, help="Houses to draw; of --houses all, unless given.")] = None,
    spread: Annotated[
        bool, typer.Option("--spread", help="Ask each house for one family alone, in turn: more houses in the time.")
    ] = False,
    rooms: Rooms = "mixed",
    per_family: PerFamily = PER_FAMILY,
    families: Families = (),
    suite: Suite = None,
    kind: Kinds = None,
    house_uses: HouseUses = HOUSE_USES,
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
    vigil pack make --name held_out --seed 918273645 --per-family 25 --out packs/held_out
    vigil pack make --name real --houses procthor-10k:val --count 200 --per-family 25 --out packs/real
    vigil pack make --name stress --suite closure --seed 918273645 --per-family 20 --out packs/stress

    With --houses the seed, 0 by default, is no secret, and OUT.recipe.json is written, which names all houses with
    their hashes: `vigil pack remake` makes the same bytes of it.
    """
    if seed is None and not houses:
        raise SettingError("Give either --seed, which generates houses, or --houses with files or a dataset of them.")
    tasks = _tasks(
        suite, kind, per_family, family=families, spread=spread, level=level, robust=robust, hardest_of=hardest_of > 1
    )
    check_free(out, name)
    offered = filed(houses or [], report=tell)
    origins = [] if reviews else _origins(offered)
    wanted = count or max(LEAST_HOUSES, round(HOUSES_PER_EPISODE * per_family))
    sources = drawn_of(offered, seed or 0, count) if houses else _secret(seed or 0, wanted, _specs(rooms, suite))
    pack_request = PackRequest(
        name,
        per_family,
        seed or 0,
        house_uses,
        families=families or tuple(FAMILIES),
        is_seed_secret=not houses,
        asset_database_sha256=file_sha256(assets),
        levels=levels_named(level or []),
        is_robust=robust,
        forms=forms_named(forms or ("public" if houses else "all")),
    )
    verification = VerificationSettings(backend, AssetDatabase.of(assets), worker_count(workers), robust)
    making = Making(pack_request, verification, _reviews(reviews or []), spread, hardest_of, tasks)
    pack = making.pack(out, sources)
    if origins:
        _write_recipe(out, making.recipe(origins, pack, count))


def remake(
    recipe: Annotated[str, typer.Argument(help="A recipe's file, or the name of a packaged one.")],
    out: Annotated[Path, typer.Option(help="New or empty folder; drafts are kept beside it.")],
    houses: Annotated[
        list[str] | None, typer.Option(help="File of the recipe's houses, unless it takes them from ProcTHOR-10K.")
    ] = None,
    workers: Workers = None,
    assets: AssetFile = None,
) -> None:
    """Example: vigil pack remake procthor_one_room_v2 --houses one_room_train.jsonl.gz --out packs/one_room"""
    wanted = Recipe.load(recipe)
    check_free(out, wanted.name)
    check_drafts(wanted)
    check_assets(wanted, assets)
    say(wanted.notes())
    sources = sources_of(wanted, houses or [], tell)
    with progress("houses read") as show:
        check_houses(wanted, sources, lambda number: show(number, len(sources)))
    print(f"{len(sources)} houses are those of recipe {wanted.name!r}")
    verification = VerificationSettings(
        wanted.backend, AssetDatabase.of(assets), worker_count(workers), wanted.is_robust
    )
    tasks = wanted.tasks if wanted.suite is not None else None
    making = Making(wanted.request, verification, (), wanted.is_spread, wanted.starts, tasks)
    pack = making.pack(out, drawn_of(sources, wanted.seed, wanted.drafted_in))
    if pack.sha256 != wanted.pack_sha256:
        print(f"not the recipe's bytes: its pack has sha256 {wanted.pack_sha256}")
        raise typer.Exit(2)
    print("the same bytes as the recipe's")


def _tasks(suite: str | None, kind: Sequence[str] | None, per_kind: int, **excluded: object) -> dict[Kind, int] | None:
    """Returns how many tasks of which kinds of a suite are asked for; None without a suite.

    Raises SettingError on options that do not go with the suite (`excluded`), or not without one.
    """
    if suite is None:
        refuse_without_suite(kind)
        return None
    refuse_with_suite(**excluded)
    return tasks_named(kind or [], per_kind)


def _secret(seed: int, count: int, specs: list[str]) -> Sequence[Source]:
    """Returns houses drawn by a seed that is to be kept secret, and says where it is too short for that."""
    if seed < SECRET_FROM:
        say([SHORT_SEED])
    return drawn(seed, count, specs)


def _write_recipe(out: Path, recipe: Recipe) -> None:
    written = out.with_name(f"{out.name}.recipe.json")
    recipe.save(written)
    print(f"{written}: whoever has the houses makes the same bytes of it with vigil pack remake")


def _origins(offered: Sequence[Filed]) -> list[HouseOrigin]:
    with progress("houses read") as show:
        return origins_of(offered, lambda number: show(number, len(offered)))


def _sources(houses: list[str], seeds: str | None, specs: list[str], limit: int | None) -> Sequence[Source]:
    if bool(houses) == (seeds is not None):
        raise SettingError("Give either --houses or --seeds.")
    return filed(houses, limit, tell) if seeds is None else seeded(seeds, specs)


def _specs(rooms: str, suite: str | None = None) -> list[str]:
    if suite is not None and rooms == "mixed":
        return list(SMALL_HOUSES)
    return [name.strip() for name in rooms.split(",")]


def _reviews(paths: Sequence[Path]) -> list[Review]:
    for path in paths:
        if not path.is_file():
            raise SettingError(f"Review file {str(path)!r} does not exist.")
    return [review for path in paths for review in read_reviews(path)]
