"""Freezing: writes episodes, solutions and houses into a pack's folder atomically. Equal input gives equal bytes."""

import hashlib
import json
import re
import shutil
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from pydantic import BaseModel

from vigil.base.versions import PackVersions
from vigil.errors import EpisodeError, SettingError
from vigil.packs.files import EPISODES, HOUSES, MANIFEST, NAME_PATTERN, SOLUTIONS, Manifest
from vigil.packs.pack import Pack, check_episode_house, check_ids, count_families, protocol_faults
from vigil.protocol.episode import Episode, Solution
from vigil.protocol.house import House, canonical_json


def freeze(
    folder: Path,
    episodes: Iterable[Episode],
    solutions: Iterable[Solution],
    houses: Iterable[House],
    *,
    name: str,
    version: str = "1",
    description: str = "",
    meta: Mapping[str, Any] | None = None,
    extra: Mapping[str, bytes] | None = None,
) -> Pack:
    """Write a pack into `folder`, which must be new or empty, and return the pack. The same input gives the same bytes.

    `extra` maps paths to the contents of further files; the manifest lists their hashes, too. Raises EpisodeError if an
    episode contradicts its family, its house or the other episodes. Raises SettingError if the folder is not empty or
    the name is invalid.
    """
    check_can_freeze(folder, name)
    ordered = sorted(episodes, key=lambda episode: episode.id)
    solved = sorted(solutions, key=lambda solution: solution.episode_id)
    by_name = {house.name: house for house in houses}
    check_ids(ordered, folder)
    _check_input(ordered, by_name, (meta or {}).get("suite"))
    if [solution.episode_id for solution in solved] != [episode.id for episode in ordered]:
        raise EpisodeError(
            f"Pack {name!r}: every episode needs exactly one solution, but a solution or an episode is missing."
        )
    used = sorted({episode.house.name for episode in ordered})
    contents = {**_contents(ordered, solved, [by_name[house] for house in used]), **(extra or {})}
    manifest = Manifest(
        name=name,
        version=version,
        versions=PackVersions.current(),
        description=description,
        episodes=len(ordered),
        houses=len(used),
        families=count_families(ordered),
        meta=dict(meta or {}),
        files={path: hashlib.sha256(data).hexdigest() for path, data in sorted(contents.items())},
    )
    _write(folder, {**contents, MANIFEST: json.dumps(manifest.model_dump(), indent=1, sort_keys=True).encode() + b"\n"})
    return Pack.load(folder)


def _contents(episodes: list[Episode], solutions: list[Solution], houses: list[House]) -> dict[str, bytes]:
    """Return path -> content for all files of a pack except the manifest."""
    return {
        EPISODES: dump_rows(episodes),
        SOLUTIONS: dump_rows(solutions),
        **{f"{HOUSES}/{house.name}.json": canonical_json(house.data) + b"\n" for house in houses},
    }


def _check_input(episodes: list[Episode], houses: Mapping[str, House], suite: str | None) -> None:
    for episode in episodes:
        faults, name = protocol_faults(episode, suite), episode.house.name
        if faults:
            raise EpisodeError(f"Episode {episode.id!r}: {'; '.join(faults)}.")
        if name not in houses:
            raise EpisodeError(f"Episode {episode.id!r}: its house {name!r} is not among the houses that were given.")
        check_episode_house(episode, houses[name])


def dump_rows(rows: Iterable[BaseModel | Mapping[str, Any]]) -> bytes:
    """Return rows as lines of canonical JSON."""
    dumped = (row.model_dump(mode="json") if isinstance(row, BaseModel) else row for row in rows)
    return b"".join(canonical_json(row) + b"\n" for row in dumped)


def check_can_freeze(folder: Path, name: str) -> None:
    """Raise SettingError if a pack called `name` cannot be frozen into `folder`."""
    if not re.match(NAME_PATTERN, name):
        raise SettingError(f"Pack name {name!r}: expected up to 100 letters, digits, '_', '.', '-', e.g. held_out_v1.")
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise SettingError(
            f"{str(folder)!r} is not an empty folder. Packs are never overwritten: freeze into a new folder."
        )


def _write(folder: Path, contents: Mapping[str, bytes]) -> None:
    """Write a pack atomically: into a temporary folder next to `folder`, which is then renamed.

    Temporary folders that a killed process left behind are deleted.
    """
    partial = folder.absolute().with_name(f".{folder.absolute().name}.partial")
    if partial.exists():
        shutil.rmtree(partial)
    for path, data in contents.items():
        target = partial / path
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_bytes(data)
    partial.rename(folder)
