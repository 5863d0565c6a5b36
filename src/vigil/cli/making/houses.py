"""Sources of the houses for a pack, and notes on the seed that draws them."""

from collections.abc import Sequence

from vigil.authoring.drafting.sources import HouseSource, OnDownload, houses_drawn_from, houses_from, houses_from_seeds
from vigil.cli.making.closure import SMALL_HOUSES
from vigil.errors import SettingError
from vigil.packs.private import NEW_SEED, is_secret

HOUSES_PER_EPISODE, MIN_HOUSES = 1.12, 12
"""Default number of houses for each episode of a family, and the minimum."""
SHORT_SEED = (
    "A seed below 2^64 can be found by trying all of them against the pack, and the names of its houses and episodes "
    f"hold the houses' own seeds. For a pack that must stay unseen use a long one: {NEW_SEED} > seed.txt, then "
    "--seed-file seed.txt."
)
SECRET_RECIPE = (
    "With --houses the seed of `pack make` is not secret: it is in the recipe, and anyone with the houses can make "
    "the pack. Give --seed with a number instead of --seed-file; or draft with `pack propose --houses ... "
    "--seed-file FILE` and freeze with `pack build`, which does not write a recipe."
)


def generated_sources(
    seed: int, count: int | None, per_family: int, specs: Sequence[str], report: OnDownload
) -> list[HouseSource]:
    """Return houses to generate, drawn by a seed; `report` gets a note when the seed can be found by trying."""
    if not is_secret(seed):
        report(SHORT_SEED)
    return houses_drawn_from(seed, count or max(MIN_HOUSES, round(HOUSES_PER_EPISODE * per_family)), specs)


def requested_sources(
    houses: list[str], seeds: str | None, specs: list[str], limit: int | None, secret: int | None, report: OnDownload
) -> Sequence[HouseSource]:
    """Return houses from files, or houses to generate: for `seeds`, or with a secret seed for those numbers."""
    if bool(houses) == (seeds is not None):
        raise SettingError("Give either --houses or --seeds.")
    return houses_from(houses, limit, report) if seeds is None else houses_from_seeds(seeds, specs, secret)


def parse_specs(rooms: str, suite: str | None = None) -> list[str]:
    """Return the specs of houses that an option names."""
    if suite is not None and rooms == "mixed":
        return list(SMALL_HOUSES)
    return [name.strip() for name in rooms.split(",")]
