"""The first N episodes of a stream as the folder of a pack.

A file next to the folder stores the houses that were already made. So the same command continues after an interruption,
and with a larger count it adds episodes to the folder. The result has the same bytes as if one command had written all
episodes.
"""

import shutil
from collections import Counter
from collections.abc import Callable, Generator, Sequence
from contextlib import closing
from pathlib import Path
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field

import vigil
from vigil.authoring.packing.assemble import FACTS
from vigil.authoring.packing.dataset_card import write_card
from vigil.authoring.packing.suites import SUITES
from vigil.authoring.streaming.address import address_of, hidden_address_of
from vigil.authoring.streaming.difficulty import Difficulty
from vigil.authoring.streaming.houses import StreamHouse
from vigil.authoring.streaming.stream import Stream, StreamItem, items_in
from vigil.base.json_lines import AppendFile, dump_line, parse_line
from vigil.errors import SettingError
from vigil.housegen.document import generators_of
from vigil.packs.files import MANIFEST
from vigil.packs.freeze import check_can_freeze, dump_rows, freeze
from vigil.packs.pack import Pack, manifest_of
from vigil.packs.private import SEED_SHA256, seed_sha256
from vigil.protocol.families import Family

ADVICE = "Remove the file; it is made again."
OnItem = Callable[[int], None]
"""Function that is called with the number of episodes so far."""


class StreamHeader(BaseModel):
    """The part of a stream that a file or a pack contains."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    stream: str
    """Address of the stream, with its version."""
    families: tuple[Family, ...]
    difficulties: tuple[Difficulty, ...]
    first: int
    last: int | None
    suite: Literal["chores"] | None = Field(default=None, exclude_if=lambda suite: suite is None)
    """Suite of the episodes; omitted for episodes of the families."""


def header_of(stream: Stream) -> StreamHeader:
    """Return the header for files and packs of a stream."""
    asked = stream.settings
    return StreamHeader(
        stream=hidden_address_of(asked.seed) if asked.is_seed_secret else address_of(asked.seed),
        families=asked.families,
        difficulties=asked.difficulties,
        first=stream.first,
        last=stream.last,
        suite=asked.suite,
    )


def write_stream(out: Path, stream: Stream, count: int, on_item: OnItem = lambda episodes: None) -> Pack:
    """Write the first `count` episodes into the folder `out`, and return the pack.

    The folder may be missing, empty, or have fewer episodes of the same stream. Raises SettingError if it has other
    content, or if the stream has fewer episodes. Raises RecordError if a file cannot be written, and SimulatorError if
    a house cannot be made.
    """
    header = header_of(stream)
    is_grown = _check_folder(out, header, count)
    items: list[StreamItem] = []
    with closing(cached_houses(out.with_name(f"{out.name}.stream.jsonl"), stream)) as houses:
        for item in items_in(houses):
            items.append(item)
            on_item(len(items))
            if len(items) == count:
                asked = stream.settings  # the hash of a secret seed makes a pack private
                facts = {SEED_SHA256: seed_sha256(out.name, asked.seed)} if asked.is_seed_secret else {}
                return _freeze(out, items, header, facts, is_grown=is_grown)
    raise SettingError(
        f"{header.stream} has only {len(items)} of the {count} requested episodes in houses {stream.first} to "
        f"{stream.last}. Ask for fewer episodes, or for more houses."
    )


def cached_houses(path: Path, stream: Stream) -> Generator[StreamHouse, None, None]:
    """Yield the houses of a stream: those in the file, then new houses. Each new house is first added to the file.

    Raises SettingError if the file is invalid or has houses of another stream.
    """
    header = header_of(stream)
    path.parent.mkdir(parents=True, exist_ok=True)
    with AppendFile(path) as file:
        lines = file.lines.complete
        if not lines:
            file.truncate(0)
            file.append(dump_line(header))
        elif parse_line(lines[0], StreamHeader, str(path), ADVICE, SettingError) != header:
            raise SettingError(f"{str(path)!r} holds houses of another stream, or of other settings. {ADVICE}")
        known = [parse_line(line, StreamHouse, str(path), ADVICE, SettingError) for line in lines[1:]]
        yield from known
        rest = stream.after(len(known))
        if rest is not None:
            with rest:
                for house in rest.houses():
                    file.append(dump_line(house))
                    yield house


def _check_folder(out: Path, header: StreamHeader, count: int) -> bool:
    """Return whether the folder has a pack to which episodes can be added.

    Raises SettingError if the folder has another pack, more episodes, or other files.
    """
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
        "difficulties": dict(sorted(Counter(item.difficulty for item in items).items())),
        "vigil": vigil.__version__,
        **seed_facts,
    }
    extra: dict[str, bytes] = {}
    if header.suite is not None:
        suite_facts, extra = SUITES[header.suite].contents(item.answer for item in items if item.answer is not None)
        meta |= suite_facts
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
        extra={FACTS: dump_rows(facts), **extra},
    )
    write_card(pack)
    if is_grown:
        shutil.rmtree(out)
    whole.rename(out)
    return Pack.load(out)
