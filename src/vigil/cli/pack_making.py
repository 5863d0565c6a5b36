"""`vigil pack propose`, `build`, `make`, `remake` and `perturb`: drafts in houses, packs from drafts and from packs."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from vigil.base.settings import Setting
from vigil.cli.arguments import PackArgument
from vigil.cli.making.options import Building, Common, Content, Drafting, Drawing, OutFolder, Proposing
from vigil.cli.progress import progress
from vigil.cli.text import print_note, print_notes
from vigil.errors import SettingError
from vigil.packs.files import Change
from vigil.packs.private import NEW_SEED, is_secret
from vigil.runner.shared_settings import AssetFile, Backend, Workers

if TYPE_CHECKING:
    from vigil.authoring.drafting.drafts import HouseOrigin
    from vigil.authoring.drafting.generation import GenerationSettings
    from vigil.authoring.drafting.sources import HouseSource
    from vigil.packs.pack import Pack

SHORT_SEED = (
    "This seed does not keep the pack secret: a seed below 2^64 can be found by trying, and the names of houses and "
    f"episodes contain seeds. For a private pack, make a long seed ({NEW_SEED} > seed.txt), and give "
    "--seed-file seed.txt."
)
SECRET_RECIPE = (
    "With --houses the seed of `pack make` is not secret: it is in the recipe, and anyone with the houses can make "
    "the pack. Give --seed with a number instead of --seed-file; or draft with `pack propose --houses ... "
    "--seed-file FILE` and freeze with `pack build`, which does not write a recipe."
)


def propose(
    out: Annotated[
        Path,
        Setting(
            "File to which the valid drafts are written (JSONL). If the command was interrupted, give it again to "
            "continue the file."
        ),
    ],
    common: Common,
    proposing: Proposing,
    drafting: Drafting,
) -> None:
    """Examples:
    vigil pack propose --seeds 100:160 --rooms kitchen,2,3 --out drafts.jsonl
    vigil pack propose --houses house.json --family SM --model openai/gpt-4o --out drafts.jsonl
    vigil pack propose --seeds 100:160 --template put_into,rearrange --template obstacle --out drafts.jsonl
    vigil pack propose --suite closure --seeds 100:160 --out closure.jsonl
    vigil pack propose --seeds 0:60 --seed-file secret.txt --out private.jsonl

    With a secret seed (--seed-file), --seeds only numbers the houses, and the names of houses and episodes do not
    reveal the seed.
    """
    from vigil.authoring.drafting.drafts import DraftsFile
    from vigil.authoring.drafting.generation import FAMILY_GRAMMAR, generate_drafts
    from vigil.authoring.drafting.model_proposals import model_proposer
    from vigil.cli.making.pack import print_drafts, progress_callback
    from vigil.runner.models.access import Endpoint, model_access
    from vigil.runner.models.completion import open_completion
    from vigil.runner.workers.pool import worker_count

    model, workers = proposing.model, worker_count(common.workers)
    if proposing.grammar and model is not None:
        raise SettingError("--grammar and --model exclude each other. Leave one out.")
    if common.templates and model is not None:
        raise SettingError(
            "--template is for the built-in grammar; with --model, the model chooses the kinds. Leave one out."
        )
    common.check_suite(model=model, grammar=proposing.grammar, hardest_of=drafting.hardest_of > 1)
    settings = _generation_settings(common, proposing, drafting)
    sources = _requested_sources(proposing, drafting.specs(common.suite), settings.secret)
    file = DraftsFile(out)
    with ExitStack() as stack:
        show = stack.enter_context(progress("houses"))
        if model is not None:
            endpoint = Endpoint(model_access(model, proposing.base_url, {}, proposing.api_key_env))
            proposer = model_proposer(stack.enter_context(open_completion(endpoint)), proposing.per_house, model)
            asked = replace(FAMILY_GRAMMAR, author=model, make_proposer=lambda seed: proposer)
            settings, workers = replace(settings, grammar=asked), 1  # a model is asked from this process
        generate_drafts(file, sources, settings, workers=workers, on_progress=progress_callback(show))
    print_drafts(file)


def _generation_settings(common: Common, proposing: Proposing, drafting: Drafting) -> GenerationSettings:
    """Return the settings of drafting with the built-in grammar."""
    from vigil.assets.database import AssetDatabase
    from vigil.authoring.closure.generation import FAMILY
    from vigil.authoring.drafting.generation import FAMILY_GRAMMAR, GenerationSettings
    from vigil.authoring.packing.suites import SUITES
    from vigil.protocol.families import FAMILIES

    seed = common.chosen_seed or 0
    return GenerationSettings(
        (FAMILY,) if common.suite else common.families or tuple(FAMILIES),
        seed,
        proposing.per_house,
        proposing.tries,
        common.backend,
        AssetDatabase.from_file(common.assets),
        forms=drafting.forms("public"),
        starts=drafting.hardest_of,
        is_seed_secret=is_secret(seed),
        grammar=SUITES[common.suite].grammar if common.suite else FAMILY_GRAMMAR,
        templates=common.templates,
    )


def _requested_sources(proposing: Proposing, specs: list[str], secret: int | None) -> Sequence[HouseSource]:
    """Return the houses in which to propose: houses from files, or houses to generate for the numbers in `--seeds`."""
    from vigil.authoring.drafting.sources import houses_from, houses_from_seeds

    if bool(proposing.houses) == (proposing.seeds is not None):
        raise SettingError("Give either --houses or --seeds.")
    if proposing.seeds is None:
        return houses_from(proposing.houses, proposing.limit, print_note)
    return houses_from_seeds(proposing.seeds, specs, secret)


def build(
    out: Annotated[Path, Setting("Folder for the pack: new or empty.")], content: Content, building: Building
) -> None:
    """Example: vigil pack build --drafts drafts.jsonl --reviews reviews.jsonl --per-family 10 --name mine --out mine"""
    from vigil.authoring.drafting.drafts import DraftsFile
    from vigil.cli.making.pack import PackFreezer

    old = DraftsFile(building.earlier_drafts) if building.earlier_drafts else None
    files = [*([old] if old else []), *map(DraftsFile, building.drafts)]
    if not files:
        raise SettingError("There are no drafts to choose from: give files with --drafts, --earlier-drafts or both.")
    content.check_suite(earlier_drafts=building.earlier_drafts, level=content.levels, robust=content.robust)
    seeds = [content.chosen_seed or 0, *(file.read().header.seed for file in files)]
    request = content.request(
        version=building.version,
        description=building.description,
        aliases=building.aliases,
        is_seed_secret=any(map(is_secret, seeds)),
    )
    PackFreezer(out, request, content.reviews, content.verification).freeze(files, old)


def make(out: OutFolder, content: Content, drawing: Drawing, drafting: Drafting) -> None:
    """Examples:
    vigil pack make --name held_out --seed-file seed.txt --per-family 25 --out packs/held_out
    vigil pack make --name real --houses procthor-10k:val --count 200 --per-family 25 --out packs/real
    vigil pack make --name stress --suite closure --seed 918273645 --per-family 20 --out packs/stress

    The command uses more houses until the pack is complete or --max-houses are used, and prints what is missing. To
    continue, give the same command with a larger --max-houses. With --houses, the seed (0 by default) is not secret,
    and the file OUT.recipe.json is written, too. It names all houses with their hashes, and `vigil pack remake` makes
    the same pack from it, byte for byte.
    """
    make_from(out, content, drawing, drafting)


def make_from(out: Path, content: Content, drawing: Drawing, drafting: Drafting) -> Pack:
    """Make a pack, or continue to make it, and return it. Raises InputError."""
    from vigil.authoring.drafting.sources import draw_sample, houses_drawn_from, houses_from
    from vigil.authoring.packing.recipes import origins_of, recipe_of
    from vigil.cli.making.pack import make_pack
    from vigil.packs.freeze import check_can_freeze

    _check_seed(content, drawing)
    content.check_suite(
        one_family_per_house=drawing.one_family_per_house,
        level=content.levels,
        robust=content.robust,
        hardest_of=drafting.hardest_of > 1,
    )
    request = content.request(
        is_seed_secret=not drawing.houses,
        forms=drafting.forms("public" if drawing.houses else "all"),
        drafted_in=drawing.first(content.per_family),
        one_family_per_house=drawing.one_family_per_house,
        starts=drafting.hardest_of,
    )
    check_can_freeze(out, content.name)
    most = drawing.most(content.per_family)
    offered = houses_from(drawing.houses, report=print_note)
    origins: list[HouseOrigin] = []
    if not content.reviews:
        with progress("houses read") as show:
            origins = origins_of(offered, lambda number: show(number, len(offered)))
    if offered:
        sources = draw_sample(offered, request.seed, most)
    else:
        if not is_secret(request.seed):
            print_note(SHORT_SEED)
        sources = houses_drawn_from(request.seed, most or 0, drafting.specs(content.suite))
    pack = make_pack(out, sources, request, content.reviews, content.verification)
    if origins:
        written = out.with_name(f"{out.name}.recipe.json")
        recipe_of(request, origins, pack.sha256).save(written)
        print(f"{written}: from this file and the same houses, vigil pack remake makes the same bytes")
    return pack


def _check_seed(content: Content, drawing: Drawing) -> None:
    """Raise SettingError if a seed is missing, or if a secret seed would be written to a recipe."""
    if drawing.houses and content.seed_file is not None:
        raise SettingError(SECRET_RECIPE)
    if content.chosen_seed is None and not drawing.houses:
        raise SettingError(
            "Give one of these options: --seed or --seed-file to generate houses, or --houses with files or a "
            "dataset of houses."
        )


def remake(
    recipe: Annotated[
        str, typer.Argument(help="Recipe of the pack: a file, or the name of a recipe that comes with VIGIL.")
    ],
    out: OutFolder,
    houses: Annotated[
        list[str] | None,
        Setting("File with the houses that the recipe names; not needed for houses from ProcTHOR-10K."),
    ] = None,
    workers: Workers = None,
    assets: AssetFile = None,
) -> None:
    """Example: vigil pack remake procthor_one_room_v7 --houses one_room_train.jsonl.gz --out packs/one_room"""
    from vigil.assets.database import AssetDatabase
    from vigil.authoring.drafting.sources import draw_sample
    from vigil.authoring.packing.recipes import Recipe, check_assets, check_drafts, check_houses, sources_of
    from vigil.authoring.packing.verify import VerificationSettings
    from vigil.cli.making.pack import make_pack
    from vigil.packs.freeze import check_can_freeze
    from vigil.runner.workers.pool import worker_count

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
    checks = VerificationSettings(wanted.backend, database, worker_count(workers), wanted.is_robust)
    drawn = draw_sample(sources, wanted.seed, wanted.drafted_in and len(sources))
    pack = make_pack(out, drawn, wanted.request, [], checks)
    if pack.sha256 != wanted.pack_sha256:
        print(f"not the recipe's bytes: the recipe's pack has sha256 {wanted.pack_sha256}")
        raise typer.Exit(2)
    print("the same bytes as the recipe's")


def perturb(
    pack: PackArgument,
    change: Annotated[Change, Setting("What differs in the new pack.")],
    out: Annotated[Path, Setting("Folder for the new pack: new or empty.")],
    seed: Annotated[int, Setting("Seed of the changes. Other seeds give other packs.", minimum=0)] = 0,
    name: Annotated[str | None, Setting("Name of the new pack.", unset="PACK_CHANGE_SEED")] = None,
    workers: Workers = None,
    assets: AssetFile = None,
    backend: Backend = "mujoco",
) -> None:
    """Examples:
    vigil pack perturb vigil_mini --change wording --out packs/mini_wording
    vigil pack perturb vigil_mini --change start --seed 7 --out packs/mini_start

    wording: every instruction has another sentence form and names the same objects; if possible, the form is one that
    published packs do not use. start: every start is moved by 0.25 to 1 m and turned by at most 30 degrees. light: all
    lamps have another colour and strength.

    Each episode is certified again, and keeps the id of its original. Give `vigil report` the runs on both packs.
    """
    from vigil.authoring.packing.verify import VerificationSettings
    from vigil.authoring.perturbation.perturb import PerturbationSettings, perturb_pack
    from vigil.cli.packs import load_pack
    from vigil.runner.workers.pool import worker_count

    loaded, database = load_pack(pack, assets)
    is_robust = bool(loaded.manifest.meta.get("is_robust"))
    checks = VerificationSettings(backend, database, worker_count(workers), is_robust)
    settings = PerturbationSettings(change, seed, loaded.manifest.suite, checks)
    with progress("houses") as show:
        made = perturb_pack(loaded, out, name or f"{loaded.name}_{change}_{seed}", settings, show)
    print(f"{out}: {len(made.episodes)} of {len(loaded.episodes)} episodes, sha256 {made.sha256}")
    found = made.manifest.perturbation
    for reason, count in () if found is None else found.left_out.items():
        print(f"left out: {reason} {count}")
