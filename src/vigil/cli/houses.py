"""`vigil houses`: generate, check and show houses."""

from __future__ import annotations

import itertools
import warnings
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from vigil.authoring.drafting.procthor import FORM
from vigil.base.settings import Setting
from vigil.cli.arguments import HouseArgument, SeedFile
from vigil.cli.progress import progress
from vigil.cli.text import print_note
from vigil.errors import HouseError, SettingError
from vigil.packs.private import chosen_seed, is_secret
from vigil.runner.shared_settings import AssetFile, Workers

if TYPE_CHECKING:
    from vigil.assets.database import AssetDatabase
    from vigil.housegen.checking.check import Fault
    from vigil.protocol.house import House
    from vigil.scene.fidelity import Mismatch
    from vigil.scene.things import Scene
    from vigil.sim.engines.mujoco.compiled.model import CompiledModel


def generate_house(
    out: Annotated[Path, Setting("House file to write (JSON).")],
    seed: Annotated[
        int | None,
        Setting("Random seed of the house; the same seed gives the same house. Give either this or --seed-file."),
    ] = None,
    seed_file: SeedFile = None,
    spec: Annotated[
        str,
        Setting(
            "Number of rooms of the house, or the name of a house spec, e.g. kitchen.", name="rooms", other_name="spec"
        ),
    ] = "1",
) -> None:
    """Example: vigil houses generate --seed 7 --rooms 2 --out house.json

    If the seed is secret (--seed-file), the house file does not reveal it.
    """
    from vigil.housegen.base.spec import spec_for
    from vigil.housegen.document import with_seed_removed
    from vigil.housegen.generate import generate

    made_from = chosen_seed(seed, seed_file)
    if made_from is None:
        raise SettingError("Give --seed or --seed-file: the house is generated from a seed.")
    if not out.parent.is_dir():
        raise SettingError(f"--out {str(out)!r}: folder {str(out.parent)!r} does not exist. Make it first.")
    house = generate(made_from, spec_for(spec))
    if is_secret(made_from):
        house = with_seed_removed(house, out.stem)
    house.save(out)
    print(f"{out}: {len(house.document.rooms)} rooms, {len(house.objects())} objects, sha256 {house.sha256}")


def check(
    places: Annotated[
        list[str],
        typer.Argument(
            metavar="HOUSES",
            help="Houses to check: files (.jsonl and .jsonl.gz have a house per line), or houses of "
            f"ProcTHOR-10K as {FORM}.",
        ),
    ],
    assets: AssetFile = None,
    load: Annotated[
        bool, typer.Option(help="Whether to also build the house's scene and compile it in MuJoCo.")
    ] = True,
    shapes: Annotated[
        bool,
        Setting("Also check that every object of the scene has the shape, place and state that the house file gives."),
    ] = False,
    quiet: Annotated[
        bool, typer.Option("--quiet", "-q", help="Print only the houses that cannot be loaded, and the totals.")
    ] = False,
) -> None:
    """Implausible things (overlapping objects, unreachable rooms) are printed as faults, but the command does not fail
    because of them.

    Example: vigil houses check house_*.json one_room.jsonl.gz --assets asset-database.json
    """
    from vigil.assets.database import AssetDatabase

    sizes = AssetDatabase.from_file(assets)
    checked = refused = faulty = 0
    for name, house in _houses(places):
        checked += 1
        try:
            if isinstance(house, HouseError):
                raise house
            faults = _examine(house, sizes, load, shapes)
        except HouseError as error:
            refused += 1
            print(f"{name}: cannot be loaded: {error}")
            continue
        faulty += bool(faults)
        if not quiet:
            print(f"{name}: {len(house.document.rooms)} rooms, {len(house.objects())} objects, {len(faults)} faults")
            for fault in faults:
                print(f"  {fault}")
    print(f"{checked} houses: {checked - refused} load, {refused} do not; {faulty} have faults")
    if refused:
        raise typer.Exit(2)


def show(
    file: HouseArgument,
    out: Annotated[Path, Setting("PNG file to which the picture is written.")],
    assets: AssetFile = None,
) -> None:
    """On the plan, north (+z) is up. Doors show how far they are open. Dots are small objects; a ring marks the start.

    Example: vigil houses show house.json --out plan.png
    """
    from vigil.assets.database import AssetDatabase
    from vigil.authoring.drafting.sources import house_at
    from vigil.scene.build import build_scene
    from vigil.scene.plan_image import draw_plan, plan_and_view
    from vigil.sim.pictures.renders import render_birdseye

    if not out.parent.is_dir():
        raise SettingError(f"--out {str(out)!r}: folder {str(out.parent)!r} does not exist. Make it first.")
    if out.suffix.lower() != ".png":
        raise SettingError(f"--out {str(out)!r}: the picture is a PNG; give a name that ends in .png.")
    house, sizes = house_at(file, print_note), AssetDatabase.from_file(assets)
    scene = build_scene(house, sizes)
    plan_and_view(draw_plan(house, scene), render_birdseye(scene)).save(out)
    print(out)


def sweep_houses(
    seeds: Annotated[
        str, Setting("Seeds from which houses are generated, as FIRST:END, e.g. 0:1000; END itself is not used.")
    ] = "0:20",
    rooms: Annotated[
        str,
        Setting("Numbers of rooms, separated by commas. For each seed, one house of each of these sizes is generated."),
    ] = "1,2,3,4,6,10",
    load: Annotated[
        bool, typer.Option(help="Whether to also build each house's scene and compile it in MuJoCo.")
    ] = True,
    min_count: Annotated[
        int,
        Setting("List each category of objects that occurs less often than this in all houses together.", minimum=0),
    ] = 0,
    workers: Workers = None,
) -> None:
    """Example: vigil houses sweep --seeds 0:100 --rooms 1,4,10"""
    from vigil.housegen.base.spec import spec_for
    from vigil.housegen.survey import survey
    from vigil.runner.workers.pool import worker_count

    first, end = _whole_numbers(seeds, ":", "--seeds", "FIRST:END, e.g. 0:1000", 2)
    if first >= end:
        raise SettingError(f"--seeds {seeds!r} does not contain a seed: END must be larger than FIRST, e.g. 0:1000.")
    counts = _whole_numbers(rooms, ",", "--rooms", "numbers of rooms, e.g. 1,2,4", None)
    for count in counts:
        spec_for(str(count))
    total, done = len(counts) * (end - first), itertools.count(1)
    with progress("houses") as show:

        def report(problems: list[str]) -> None:
            show(next(done), total)
            for problem in problems:
                print(problem)

        result = survey(range(first, end), counts, _own_loaded if load else _unloaded, report, worker_count(workers))
    print(*result.lines(), sep="\n")
    rare = [f"{name} {result.category_counts[name]}" for name in result.rare_categories(min_count)]
    if rare:
        print(f"fewer than {min_count} of: {', '.join(rare)}")
    print(f"{sum(result.houses.values())} houses, {len(result.problems)} problems")
    if result.problems or rare:
        raise typer.Exit(2)


def _own_loaded(house: House) -> None:
    from vigil.assets.database import AssetDatabase

    _loaded(house, AssetDatabase.default())


def _unloaded(house: House) -> None:
    """Do nothing: used in place of loading when only the house's document is checked."""


def _whole_numbers(text: str, between: str, option: str, form: str, count: int | None) -> list[int]:
    words = text.split(between)
    if not all(word.strip().isdecimal() for word in words) or count not in (None, len(words)):
        raise SettingError(f"{option} {text!r} is not {form}.")
    return [int(word) for word in words]


def export(
    file: HouseArgument,
    out: Annotated[Path, typer.Argument(help="House file to write, for AI2-THOR (JSON).")],
    asset_database: Annotated[
        Path, Setting("AI2-THOR's asset-database.json, from which an asset is chosen for each object.")
    ],
    material_database: Annotated[
        Path | None,
        Setting(
            "AI2-THOR's material-database.json, from which materials are chosen. If unset, the materials do not change."
        ),
    ] = None,
    thor: Annotated[
        bool, Setting("Write the house for AI2-THOR. This option is required, because other formats do not exist.")
    ] = False,
) -> None:
    """Objects are left out, and listed, if the database does not have an asset of their type or the asset does not fit.
    We have not tried the result in AI2-THOR itself.

    Example: vigil houses export --thor --asset-database asset-database.json house.json thor_house.json
    """
    from vigil.assets.database import AssetDatabase
    from vigil.authoring.drafting.sources import house_at
    from vigil.housegen.checking.check import check_house
    from vigil.housegen.thor_export import export_thor, load_materials
    from vigil.protocol.house import House

    if not thor:
        raise SettingError("`vigil houses export` needs a format: give --thor, which is the only format.")
    if not out.parent.is_dir():
        raise SettingError(f"House file {str(out)!r}: folder {str(out.parent)!r} does not exist. Make it first.")
    house, assets = house_at(file, print_note), AssetDatabase.load(asset_database)
    materials = load_materials(material_database) if material_database else {}
    result = export_thor(house, assets, materials)
    exported = House(out.stem, result.data)
    exported.save(out)
    faults = Counter(fault.rule for fault in check_house(exported, assets))
    print(f"{out}: {len(exported.objects())} of {len(house.objects())} objects have a place in it")
    if result.left_out:
        print(
            f"  left out, with the objects on them, because the database lacks their type: {', '.join(result.left_out)}"
        )
    if result.removed_collisions:
        print(f"  removed, because they do not fit with the new sizes: {', '.join(result.removed_collisions)}")
    if faults:
        found = ", ".join(f"{number} {rule}" for rule, number in sorted(faults.items()))
        print(f"  vigil houses check finds: {found}")


def _houses(places: list[str]) -> Iterator[tuple[str, House | HouseError]]:
    """Yield (name, house) for each place; for a house that cannot be read, (name, error)."""
    from vigil.authoring.drafting.procthor import is_dataset
    from vigil.authoring.drafting.sources import houses_from, read_all
    from vigil.protocol.house import House

    for place in places:
        if not is_dataset(place) and not place.endswith((".jsonl", ".gz")):
            try:
                yield place, House.load(Path(place))
            except HouseError as error:
                yield place, error
            continue
        try:
            sources = houses_from([place], report=print_note)
        except HouseError as error:
            yield place, error
            continue
        for source, house in read_all(sources):
            yield source.name if is_dataset(place) else f"{place}:{source.line}", house


def _examine(house: House, database: AssetDatabase, load: bool, shapes: bool) -> list[Fault | Mismatch]:
    """Return the house's faults. Raises HouseError when loading leaves out an object or gives a warning."""
    from vigil.housegen.checking.check import UNLOADABLE_RULES, check_house
    from vigil.scene.fidelity import mismatches_of, too_many_triangles

    faults, flaws = check_house(house, database), []
    shapeless = next((fault for fault in faults if fault.rule in UNLOADABLE_RULES), None)
    if shapeless is not None:
        raise HouseError(f"House {house.name!r}: {shapeless}.")
    if load or shapes:
        scene, model = _loaded(house, database)
        if shapes:
            flaws = mismatches_of(scene, house, database)
            flaws += too_many_triangles(house.name, model.triangles, len(scene.rooms))
    return [*faults, *flaws]


def _loaded(house: House, database: AssetDatabase) -> tuple[Scene, CompiledModel]:
    """Return the scene and its MuJoCo model. Raises HouseError when an object is missing or a warning occurs."""
    from vigil.scene.build import build_scene
    from vigil.sim.engines.mujoco.compiled.model import build

    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        scene = build_scene(house, database)
        model = build(scene)
    absent = sorted({node.id for node, _ in house.objects()} - scene.things.keys())
    if absent or caught:
        what = f"objects {absent} are missing" if absent else f"loading warns: {caught[0].message}"
        raise HouseError(f"House {house.name!r}: {what}.")
    return scene, model
