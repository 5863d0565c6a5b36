"""`vigil pack stream` and `vigil demos`: write some episodes of an endless stream as a pack, or as training data."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from vigil.base.settings import Setting
from vigil.cli.arguments import SeedFile
from vigil.cli.progress import progress
from vigil.errors import SettingError
from vigil.packs.private import chosen_seed, is_secret
from vigil.runner.shared_settings import (
    CoordinatesOption,
    Families,
    ProfileOption,
    PromptFileOption,
    PromptVariantOption,
    RenderQuality,
    Workers,
)

if TYPE_CHECKING:
    from vigil.authoring.streaming.difficulty import Difficulty

Difficulties = Annotated[
    "tuple[Difficulty, ...]",
    Setting(
        "Use only episodes of this difficulty (easy, medium or hard); may be repeated. All difficulties if unset.",
        name="difficulty",
        metavar="DIFFICULTY",
        read="vigil.authoring.streaming.difficulty:difficulties_named",
        repeats=True,
    ),
]
Houses = Annotated[
    str,
    Setting(
        "Numbers of the stream's houses to use, as FIRST:END (END itself is not used), or FIRST: for all "
        "houses from FIRST on.",
        metavar="FIRST:END",
    ),
]


def stream(
    count: Annotated[int, Setting("Number of episodes to write.", minimum=1)],
    out: Annotated[
        Path,
        Setting(
            "Folder for the episodes: new, empty, or with fewer episodes of the same stream, to which the "
            "missing ones are then added."
        ),
    ],
    seed: Annotated[
        int | None,
        Setting(
            "Seed of the stream; the same seed gives the same episodes. Give either this or --seed-file.", minimum=0
        ),
    ] = None,
    seed_file: SeedFile = None,
    families: Families = (),
    suite: Annotated[
        Literal["chores"] | None,
        Setting("Write lists of chores with their answers instead of episodes of the families."),
    ] = None,
    difficulties: Difficulties = (),
    houses: Houses = "0:",
    workers: Workers = None,
) -> None:
    """Examples:
    vigil pack stream --seed 7 --count 200 --out train
    vigil pack stream --seed 7 --suite chores --count 200 --out lists

    Progress is saved next to the folder. The same command continues an interrupted one; with a larger --count, it adds
    episodes.
    """
    from vigil.authoring.streaming.folder import write_stream
    from vigil.authoring.streaming.stream import Stream
    from vigil.runner.workers.pool import worker_count

    first, last = house_range(houses)
    made_from = chosen_seed(seed, seed_file)
    if made_from is None:
        raise SettingError("Give --seed or --seed-file: the stream is made from a seed.")
    asked = Stream(
        made_from,
        families=families,
        difficulties=difficulties,
        first=first,
        last=last,
        workers=worker_count(workers),
        is_seed_secret=is_secret(made_from),
        suite=suite,
    )
    with asked, progress("episodes") as show:
        pack = write_stream(out, asked, count, lambda episodes: show(episodes, count))
    print(f"{out}: {len(pack.episodes)} episodes in {pack.manifest.houses} houses, sha256 {pack.sha256}")
    print(f"{pack.manifest.meta['stream']['stream']}: {pack.manifest.families}, {pack.manifest.meta['difficulties']}")


def house_range(given: str) -> tuple[int, int | None]:
    """Return (first house, house after the last), from a text FIRST:END or FIRST: (no end). Raises SettingError."""
    first, colon, last = given.partition(":")
    if not (colon and first.isdecimal() and (last.isdecimal() or not last)):
        raise SettingError(f"Houses {given!r}: expected FIRST:END or FIRST:, e.g. 0:100.")
    return int(first), int(last) if last else None


@dataclass(frozen=True, kw_only=True)
class DemosOptions:
    """From what `vigil demos` makes demonstrations, how it writes them, and where to."""

    pack: Annotated[
        str,
        Setting(
            "Stream from which the demonstrations are made, e.g. stream:7, where 7 is the stream's seed. "
            "Packs are not accepted.",
            metavar="stream:SEED",
        ),
    ]
    out: Annotated[Path, Setting("Folder for the demonstrations: new or empty.")]
    count: Annotated[int, Setting("Number of episodes from which demonstrations are made.", minimum=1)] = 100
    form: Annotated[
        Literal["sft", "parquet", "lerobot"],
        Setting(
            "Format of the demonstrations: sft (chats as JSON lines), parquet (the same chats as Parquet), "
            "or lerobot (actions as a LeRobot dataset).",
            name="format",
        ),
    ] = "sft"
    families: Families = ()
    difficulties: Difficulties = ()
    houses: Houses = "0:"
    profile: ProfileOption = "baseline"
    prompt_variant: PromptVariantOption = "default"
    prompt_template: PromptFileOption = None
    coordinates: CoordinatesOption = None
    model: Annotated[
        str | None, Setting("Model whose coordinate system the demonstrations use for clicks, as provider/model.")
    ] = None
    quality: RenderQuality = "default"
    workers: Workers = None


def demos(options: DemosOptions) -> None:
    """Example: vigil demos --pack stream:7 --count 100 --out demos

    Each row is a request to a model with the right answer. Some rows are corrections: they also hold a false report
    that an agent could have given. In a LeRobot dataset, each row is a frame with the action that follows; there are
    no corrections.
    """
    from vigil.authoring.demonstrations.write import check_source, write_demonstrations
    from vigil.authoring.streaming.address import seed_in
    from vigil.authoring.streaming.stream import Stream
    from vigil.runner.plan import profile_of
    from vigil.runner.settings import RunSettings
    from vigil.runner.workers.pool import worker_count

    check_source(options.pack)
    asked = RunSettings(
        profile=options.profile,
        prompt_variant=options.prompt_variant,
        prompt_template=options.prompt_template,
        coordinates=options.coordinates,
        model=options.model or "",  # a demonstration is for a model, even if it is not named
    )
    first, last = house_range(options.houses)
    stream = Stream(
        seed_in(options.pack), families=options.families, difficulties=options.difficulties, first=first, last=last,
        workers=worker_count(options.workers),
    )  # fmt: skip
    with stream, progress("episodes") as show:
        facts = write_demonstrations(
            options.out, stream, options.count, profile_of(asked), form=options.form, quality=options.quality,
            on_episode=lambda episodes: show(episodes, options.count),
        )  # fmt: skip
    print(f"{options.out}: {facts['stream']}, episodes {facts['episodes']}, rows {facts['rows']}")
