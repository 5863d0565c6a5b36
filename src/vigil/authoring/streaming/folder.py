"""The first so many episodes of a stream as the folder of a pack.

What is made is kept beside the folder, house by house, so that the same command goes on after an interruption, and with
a larger count adds to the folder: its episodes are then those that one command would have written, to the byte.
"""

import shutil
from collections.abc import Callable, Generator, Sequence
from contextlib import closing
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict

import vigil
from vigil.authoring.packing.assemble import FACTS
from vigil.authoring.packing.dataset_card import write_card
from vigil.authoring.streaming.address import address_of, hidden_address_of
from vigil.authoring.streaming.difficulty import Difficulty, difficulty_of
from vigil.authoring.streaming.houses import StreamHouse
from vigil.authoring.streaming.stream import Stream, StreamItem, items_in
from vigil.base.json_lines import AppendFile, Line, dump_line, parse_line
from vigil.errors import SettingError
from vigil.housegen.document import generators_of
from vigil.packs.files import MANIFEST
from vigil.packs.freeze import check_can_freeze, freeze
from vigil.packs.pack import Pack, manifest_of
from vigil.packs.private import SEED_SHA256, seed_sha256
from vigil.protocol.families import Family
from vigil.protocol.house import canonical_json

ADVICE = "Remove it; it is made anew."
OnItem = Callable[[int], None]
"""Is told how many episodes there are."""


class StreamHeader(BaseModel):
    """Which part of which stream a file or a pack holds."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    stream: str
    """Its address, with the versions that made it."""
    families: tuple[Family, ...]
    difficulties: tuple[Difficulty, ...]
    first: int
    last: int | None


def header_of(stream: Stream) -> StreamHeader:
    """Return which stream it is."""
    asked = stream.settings
    return StreamHeader(
        stream=hidden_address_of(asked.seed) if asked.is_seed_secret else address_of(asked.seed),
        families=asked.families,
        difficulties=asked.difficulties,
        first=stream.first,
        last=stream.last,
    )


def write_stream(out: Path, stream: Stream, count: int, on_item: OnItem = lambda episodes: None) -> Pack:
    """Writes the first `count` episodes into `out`, new, empty, or holding fewer of the same ones; returns the pack.

    Raises SettingError when the folder holds something else or the stream ends before, RecordError, SimulatorError.
    """
    header = header_of(stream)
    is_grown = _check_folder(out, header, count)
    items: list[StreamItem] = []
    with closing(cached_houses(out.with_name(f"{out.name}.stream.jsonl"), stream)) as houses:
        for item in items_in(houses):
            items.append(item)
            on_item(len(items))
            if len(items) == count:
                return _freeze(out, items, header, _seed_facts(out, stream), is_grown=is_grown)
    raise SettingError(
        f"{header.stream} holds {len(items)} wanted episodes in houses {stream.first} to {stream.last}, not {count}. "
        "Ask for fewer, or for more houses."
    )


def cached_houses(path: Path, stream: Stream) -> Generator[StreamHouse, None, None]:
    """Yield the houses of a stream: those in the file, then new ones, each of which is written down before.

    Raises SettingError when the file holds another stream's.
    """
    header = header_of(stream)
    path.parent.mkdir(parents=True, exist_ok=True)
    with AppendFile(path) as file:
        lines = file.lines.complete
        if not lines:
            file.truncate(0)
            file.append(dump_line(header))
        elif _header(lines[0], path) != header:
            raise SettingError(f"{str(path)!r} holds another stream's houses, or other families'. {ADVICE}")
        known = [parse_line(line, StreamHouse, str(path), ADVICE, SettingError) for line in lines[1:]]
        yield from known
        rest = stream.after(len(known))
        if rest is not None:
            with rest:
                for house in rest.houses():
                    file.append(dump_line(house))
                    yield house


def _header(line: Line, path: Path) -> StreamHeader:
    return parse_line(line, StreamHeader, str(path), ADVICE, SettingError)


def _check_folder(out: Path, header: StreamHeader, count: int) -> bool:
    """Return whether the folder is there and can be added to. Raises SettingError when it holds something else."""
    if not (out / MANIFEST).is_file():
        check_can_freeze(out, out.name)
        return False
    manifest = manifest_of(out)
    if manifest.meta.get("stream") != header.model_dump(mode="json") or manifest.episodes > count:
        raise SettingError(
            f"{str(out)!r} holds another pack, or more than {count} episodes of the stream. Packs are never "
            "overwritten: write into another folder."
        )
    return True


def _seed_facts(out: Path, stream: Stream) -> dict[str, Any]:
    """Return the hash of a secret seed, which makes the pack private; nothing of any other: the address tells it."""
    asked = stream.settings
    return {SEED_SHA256: seed_sha256(out.name, asked.seed)} if asked.is_seed_secret else {}


def _freeze(
    out: Path, items: Sequence[StreamItem], header: StreamHeader, seed_facts: dict[str, Any], *, is_grown: bool
) -> Pack:
    houses = {item.house.name: item.house for item in items}
    facts = [
        {"episode_id": item.episode.id, "difficulty": item.difficulty, **item.draft.facts.model_dump(mode="json")}
        for item in items
    ]
    meta: dict[str, Any] = {
        "stream": header.model_dump(mode="json"),
        "house_generator": generators_of(houses.values()),
        "difficulties": _counted(items),
        "vigil": vigil.__version__,
        **seed_facts,
    }
    whole = out.with_name(f".{out.name}.whole")
    if whole.exists():
        shutil.rmtree(whole)
    pack = freeze(
        whole,
        [item.episode for item in items],
        [item.solution for item in items],
        houses.values(),
        name=out.name,
        description=f"The first {len(items)} episodes of {header.stream}, for training. No number is published on it.",
        meta=meta,
        extra={FACTS: b"".join(canonical_json(row) + b"\n" for row in facts)},
    )
    write_card(pack)
    if is_grown:
        shutil.rmtree(out)
    whole.rename(out)
    return Pack.load(out)


def _counted(items: Sequence[StreamItem]) -> dict[str, int]:
    found = [difficulty_of(item.draft) for item in items]
    return {each: found.count(each) for each in dict.fromkeys(sorted(found))}
