"""`vigil pack stream`: writes some episodes of an endless stream as the folder of a pack."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from vigil.base.settings import Setting
from vigil.cli.arguments import SeedFile
from vigil.cli.progress import progress
from vigil.errors import SettingError
from vigil.packs.private import chosen_seed, is_secret
from vigil.runner.shared_settings import Families, Workers

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
