"""Pack: a frozen folder of episodes with their houses and solutions, verified by hash.

    manifest.json        name, version, counts, SHA-256 of every other file
    episodes.jsonl       one Episode a line, sorted by id
    solutions.jsonl      one Solution a line, sorted by episode id
    houses/<name>.json   canonical JSON

The pack's own hash is the SHA-256 of its manifest's bytes. A pack has no code, only data.
Source: `protocol.md` section 7.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from importlib.resources import files
from itertools import pairwise
from pathlib import Path
from typing import Literal, Protocol

from vigil.base.json_files import is_object, read_json
from vigil.errors import EpisodeError, PackMismatch, SettingError, did_you_mean
from vigil.packs.even_draw import SuiteEntry, balanced_units
from vigil.packs.files import EPISODES, HOUSES, MANIFEST, SOLUTIONS, Manifest, PackFiles
from vigil.packs.names import STREAM, newer_version, newest_version
from vigil.protocol.episode import Episode, Solution
from vigil.protocol.families import FAMILIES, Family
from vigil.protocol.house import House

PACKAGED = Path(str(files("vigil") / "data" / "packs"))
"""Folder of the packs that come with the package."""
ANSWERS = "closure.jsonl"
"""File with the answers of a closure-stress pack: see `vigil.scoring.closure`."""
CHORE_ANSWERS = "chores.jsonl"
"""File with the answers of a pack of lists of chores: see `vigil.scoring.chore_answers`."""
CHORES_SUITE: Literal["chores"] = "chores"
"""Value of `meta.suite` in the manifest of a pack of lists of chores."""
CHORES_BUDGETS = (40, 240)
"""Smallest and largest step budget of a list of chores (an episode with several numbered chores)."""
MAX_CACHED_HOUSES = 16
"""Number of houses that a pack caches in memory. Other houses are read from disk again when they are needed."""


@dataclass(frozen=True)
class Selection:
    """A selection of a pack's episodes; by default, all episodes."""

    families: tuple[Family, ...] = ()
    ids: tuple[str, ...] = ()
    limit: int | None = None
    """Maximum number of episodes, drawn evenly by `vigil.packs.even_draw`. Of two twins, both or neither are taken."""


class AssetSizes(Protocol):
    """What a pack needs of a database of AI2-THOR's assets, to check that the pack was made with the same database."""

    @property
    def sha256(self) -> str | None:
        """SHA-256 of the database file; None if there is no such file."""
        ...

    def __contains__(self, asset_id: str, /) -> bool: ...


class Pack:
    """A pack whose files have been verified against its manifest."""

    def __init__(self, own_files: PackFiles) -> None:
        """Make a pack from its files. Callers use `Pack.load` instead."""
        self._files = own_files
        self.folder = own_files.folder
        self.manifest = own_files.manifest
        self.sha256 = own_files.sha256
        self.episodes = tuple(own_files.rows(EPISODES, Episode))
        self._houses: dict[str, House] = {}

    @classmethod
    def load(cls, path: str | Path, sha256: str | None = None) -> "Pack":
        """Return the pack in a folder, or the pack of that name that comes with VIGIL. The hash of every file is
        checked.

        Raises PackMismatch, EpisodeError or HouseError. If `sha256` is given and the pack's hash differs, raises
        PackMismatch.
        """
        own_files = PackFiles.of(find_pack(path), sha256)
        for name in sorted(own_files.manifest.files):
            own_files.read(name)
        pack = cls(own_files)
        pack._check()
        return pack

    @property
    def name(self) -> str:
        """The pack's name."""
        return self.manifest.name

    @cached_property
    def solutions(self) -> dict[str, Solution]:
        """Recorded solutions by episode id."""
        return {solution.episode_id: solution for solution in self._files.rows(SOLUTIONS, Solution)}

    @cached_property
    def suite_entries(self) -> dict[str, SuiteEntry]:
        """Suite entries (kind and pair) by episode id; empty for a pack that is not of a suite."""
        found = [name for name in (ANSWERS, CHORE_ANSWERS) if name in self.manifest.files]
        return {place.episode_id: place for name in found for place in self._files.rows(name, SuiteEntry)}

    @property
    def pairs(self) -> dict[str, str]:
        """Episode id -> name of the pair, for the episodes that have a twin."""
        return {name: place.pair for name, place in self.suite_entries.items() if place.pair is not None}

    def house_of(self, episode: Episode) -> House:
        """Return an episode's house as it was frozen. Several threads may call this at the same time.

        Raises PackMismatch or HouseError.
        """
        name = episode.house.name
        house = self._houses.pop(name, None)
        if house is None:
            file = f"{HOUSES}/{name}.json"
            house = House.from_json(name, self._files.read(file), f"House file {str(self.folder / file)!r}")
        self._houses[name] = house
        for oldest in list(self._houses)[:-MAX_CACHED_HOUSES]:
            self._houses.pop(oldest, None)
        return house

    def check_assets(self, given: AssetSizes) -> None:
        """Raise PackMismatch if objects would have other sizes under `given` than when the pack was made."""
        if self.asset_database_sha256 is None and given.sha256 is not None:
            first = {episode.house.name: episode for episode in self.episodes}
            nodes = (node for episode in first.values() for node, _ in self.house_of(episode).objects())
            if not any(node.asset_id in given for node in nodes):
                return  # a database changes nothing where no house has an asset of it
        fault = asset_mismatch(f"Pack {self.name!r}", self.asset_database_sha256, given.sha256)
        if fault is not None:
            raise PackMismatch(fault)

    @property
    def asset_database_sha256(self) -> str | None:
        """SHA-256 of the asset database with which the pack was made; None if it was made without an asset database."""
        return self.manifest.meta.get("asset_database_sha256")

    def episode(self, episode_id: str) -> Episode:
        """Return the episode with that id. Raises SettingError, which suggests a similar id."""
        for episode in self.episodes:
            if episode.id == episode_id:
                return episode
        known = [episode.id for episode in self.episodes]
        hint = did_you_mean(episode_id, known) or f" Its episodes are listed in {str(self.folder / EPISODES)!r}."
        raise SettingError(f"Pack {self.name!r} has no episode {episode_id!r}.{hint}")

    def select(self, selection: Selection) -> list[Episode]:
        """Return the selected episodes, sorted by id. Raises SettingError if there are none."""
        if selection.limit is not None and selection.limit < 1:
            raise SettingError(f"A limit of {selection.limit} episodes leaves nothing to play. Give 1 or more.")
        for family in selection.families:
            if family not in FAMILIES:
                raise SettingError(f"There is no family {family!r}. The families are {', '.join(FAMILIES)}.")
        wanted = {self.episode(episode_id).id for episode_id in selection.ids}
        chosen = [
            episode
            for episode in self.episodes
            if (not wanted or episode.id in wanted) and (not selection.families or episode.family in selection.families)
        ]
        if not chosen:
            raise SettingError(f"Pack {self.name!r} has no episode that fits the selection. See `vigil pack info`.")
        if selection.limit is not None:
            chosen = self._first(chosen, selection.limit)
        return chosen

    def _first(self, episodes: Sequence[Episode], limit: int) -> list[Episode]:
        """Return `limit` episodes, drawn evenly. If only one of the last two twins fits, return one episode less."""
        found: list[Episode] = []
        for unit in balanced_units(episodes, self.suite_entries):
            if len(found) + len(unit) > limit:
                break
            found += unit
        if not found:
            raise SettingError(
                f"A limit of {limit} leaves nothing to play: the episodes are pairs of twins. Give 2 or more."
            )
        return sorted(found, key=lambda episode: episode.id)

    def _check(self) -> None:
        check_ids(self.episodes, self.folder)
        counts = count_families(self.episodes)
        hashes = {episode.house.name: episode.house.sha256 for episode in self.episodes}
        if len(hashes) != self.manifest.houses:
            raise PackMismatch(
                f"Pack {str(self.folder)!r}: the manifest says {self.manifest.houses} houses, but the episodes are "
                f"in {len(hashes)}. Freeze the pack again."
            )
        if len(self.episodes) != self.manifest.episodes or counts != self.manifest.families:
            raise PackMismatch(
                f"Pack {str(self.folder)!r}: the manifest says {self.manifest.episodes} episodes "
                f"({self.manifest.families}), but {EPISODES} holds {len(self.episodes)} ({counts}). Freeze the "
                "pack again."
            )
        for episode in sorted(self.episodes, key=lambda episode: episode.house.name):
            if f"{HOUSES}/{episode.house.name}.json" not in self.manifest.files:
                known = [Path(name).stem for name in self.manifest.files if name.startswith(HOUSES)]
                raise PackMismatch(
                    f"Episode {episode.id!r}: house {episode.house.name!r} is not in pack {self.name!r}."
                    f"{did_you_mean(episode.house.name, known)}"
                )
            check_episode_house(episode, self.house_of(episode))
        sources = self.manifest.meta.get("house_sources")
        for name, source in sources.items() if is_object(sources) else ():
            if is_object(source) and source.get("sha256") not in (None, hashes.get(name)):
                raise PackMismatch(
                    f"Pack {str(self.folder)!r}: {MANIFEST}: meta.house_sources gives house {name!r} another SHA-256 "
                    "than its episodes do. Freeze the pack again."
                )


def asset_mismatch(what: str, wanted: str | None, given: str | None) -> str | None:
    """Return the error message if `what` was made with another asset database (hash `wanted`) than the database in use
    (hash `given`); None if the two hashes are equal.
    """
    if wanted == given:
        return None
    made, here = (
        "no asset database" if each is None else f"the asset database of SHA-256 {each[:12]}..."
        for each in (wanted, given)
    )
    do = "Leave out --assets, and unset VIGIL_ASSETS." if wanted is None else "Give that database with --assets."
    return f"{what} was made with {made}, but here {here} is used: objects would have other sizes. {do}"


def find_pack(path: str | Path) -> Path:
    """Return the folder of a pack: `path` itself, or the folder of the pack with that name that comes with VIGIL. A
    name without a version means the pack's newest version.

    Raises PackMismatch.
    """
    folder, name = Path(path), str(path)
    if folder.is_dir():
        return folder
    if name.startswith(STREAM):
        raise PackMismatch(
            f"{name!r} is a stream, not a pack. `vigil pack stream --seed SEED --count 200 --out FOLDER` writes "
            "the stream's first episodes as a pack; then give FOLDER."
        )
    names = packaged_names()
    if name in names:
        return PACKAGED / name
    aliases = {each: manifest_of(PACKAGED / each).meta.get("aliases", ()) for each in names}
    known = {alias: PACKAGED / each for each in names for alias in (*aliases[each], each)}
    found = name if name in known else newest_version(name, known)
    if found is not None:
        return known[found]
    later = newer_version(name, known)
    if later is not None:
        raise PackMismatch(
            f"Pack {name!r} does not come with this package; {later!r} is its newest version here. Runs on "
            f"{name!r} can be read only with that pack: give the pack's folder."
        )
    raise PackMismatch(
        f"There is no pack {name!r}: neither a folder nor a packaged one ({', '.join(names) or 'none'})."
        f"{did_you_mean(name, names)}"
    )


def packaged_names() -> list[str]:
    """Return the names of the packs that come with the package, sorted."""
    return sorted(entry.parent.name for entry in PACKAGED.glob(f"*/{MANIFEST}"))


def manifest_of(path: str | Path) -> Manifest:
    """Return the manifest of a pack. Other files of the pack are not read. Raises PackMismatch."""
    return PackFiles.of(find_pack(path)).manifest


def manifest_sha256(folder: Path) -> str:
    """Return the SHA-256 that identifies a pack. Raises PackMismatch if the folder does not have a manifest."""
    return PackFiles.of(folder).sha256


def frozen_episodes(path: str | Path, sha256: str) -> list[Episode]:
    """Return the episodes of the pack with the hash `sha256`, without loading the pack's houses.

    Raises PackMismatch if the pack at `path` has another hash, or its file of episodes does not match its manifest.
    """
    return PackFiles.of(find_pack(path), sha256).rows(EPISODES, Episode)


def count_rooms(folder: Path) -> dict[str, int]:
    """Return the number of rooms of each house of the pack in `folder`. Raises PackMismatch."""
    own_files = PackFiles.of(folder)
    found: dict[str, int] = {}
    for name in own_files.manifest.files:
        if name.startswith(f"{HOUSES}/"):
            try:
                found[Path(name).stem] = len(read_json(own_files.read(name))["rooms"])
            except (ValueError, TypeError, KeyError) as error:
                raise PackMismatch(
                    f"{str(folder / name)!r} is not a house ({error!r}). Freeze the pack again."
                ) from None
    return found


def count_families(episodes: Iterable[Episode]) -> dict[Family, int]:
    """Return family -> number of its episodes (if any), in the order of the table of families."""
    counts = dict.fromkeys(FAMILIES, 0)
    for episode in episodes:
        counts[episode.family] += 1
    return {family: count for family, count in counts.items() if count}


def check_episode_house(episode: Episode, house: House) -> None:
    """Raise PackMismatch or EpisodeError if an episode and its house do not match."""
    if house.sha256 != episode.house.sha256:
        raise PackMismatch(
            f"Episode {episode.id!r}: house {house.name!r} has SHA-256 {house.sha256[:12]}..., but the episode was "
            f"made for {episode.house.sha256[:12]}.... Restore the house for which the episode was made, or make "
            "the episode again."
        )
    parents = {change.placement.parent for change in episode.setup.objects.values() if change.placement}
    named = {
        "bindings or goal": set(episode.bound_ids()),
        "setup": set(episode.setup.objects) | {parent for parent in parents if parent is not None},
    }
    for place, ids in named.items():
        for object_id in sorted(each for each in ids if not house.may_contain(each)):
            raise EpisodeError(
                f"Episode {episode.id!r}: {place} names {object_id!r}, absent from house {house.name!r}."
                f"{did_you_mean(object_id, house.ids)}"
            )


def protocol_faults(episode: Episode, suite: str | None = None) -> list[str]:
    """Return descriptions of how an episode contradicts its family: in its budgets, start horizon or kind of goal.

    A pack is checked for this when it is frozen, not when it is loaded.

    `suite` is the suite of the episode's pack; None if the pack is not of a suite.
    """
    spec = FAMILIES[episode.family]
    faults: list[str] = []
    if suite is None and episode.goal.kind not in FAMILIES[episode.family].allowed_goal_kinds:
        faults.append(f"a goal of kind {episode.goal.kind} is allowed only in packs of a suite")
    if suite == CHORES_SUITE:
        least, most = CHORES_BUDGETS
        expected = invalid_limit(episode.max_steps)
        if not least <= episode.max_steps <= most or episode.max_invalid != expected:
            faults.append(
                f"budgets are {episode.max_steps} steps and {episode.max_invalid} invalid actions, but a list of "
                f"chores has {least} to {most} steps and, for these steps, {expected} invalid actions"
            )
    elif (episode.max_steps, episode.max_invalid) != (spec.max_steps, spec.max_invalid):
        faults.append(
            f"budgets are {episode.max_steps} steps and {episode.max_invalid} invalid actions, but family "
            f"{episode.family} has {spec.max_steps} and {spec.max_invalid}"
        )
    if spec.start_horizon is not None and episode.start.horizon != spec.start_horizon:
        faults.append(
            f"start horizon is {episode.start.horizon:g}, but family {episode.family} starts at {spec.start_horizon:g}"
        )
    return faults


def invalid_limit(max_steps: int) -> int:
    """Return how many invalid replies a list of chores allows: three tenths of its step budget `max_steps`."""
    return max_steps * 3 // 10


def check_ids(episodes: Sequence[Episode], folder: Path) -> None:
    """Raise EpisodeError unless ids are unique and sorted."""
    ids = [episode.id for episode in episodes]
    for before, after in pairwise(ids):
        if before == after:
            raise EpisodeError(f"Pack {str(folder)!r}: two episodes have the id {before!r}; ids must be unique.")
        if before > after:
            raise EpisodeError(f"Pack {str(folder)!r}: episode {after!r} comes after {before!r}; sort them by id.")
