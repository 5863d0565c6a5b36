"""Writing of demonstrations into a folder: the rows, a card, and a file with the settings that made them."""

import json
import shutil
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from itertools import islice
from pathlib import Path
from typing import Any, ClassVar, Literal, Protocol

from vigil.authoring.cards import CARD, render_card
from vigil.authoring.demonstrations.chat_rows import ParquetRowWriter, SftWriter
from vigil.authoring.demonstrations.columns import WORDS
from vigil.authoring.demonstrations.lerobot import LeRobotWriter
from vigil.authoring.demonstrations.play import Demonstrator, Example
from vigil.authoring.streaming.address import is_stream, seed_in
from vigil.authoring.streaming.folder import header_of
from vigil.authoring.streaming.stream import Stream
from vigil.errors import SettingError
from vigil.packs.private import is_secret
from vigil.protocol.observation import Quality
from vigil.protocol.profile import Profile
from vigil.protocol.prompt import policy_sha256, policy_version

FACTS = "demonstrations.json"

OnEpisode = Callable[[int], None]
"""Function that is called with the number of episodes written so far."""


Format = Literal["sft", "parquet", "lerobot"]


class RowWriter(Protocol):
    """A writer of the files of one format in a folder."""

    table: ClassVar[str]
    """Path of the file with the rows, or a pattern if there are several files."""
    has_corrections: ClassVar[bool]
    """Whether the rows include corrections (requests with a false report in addition to the correct answer)."""

    def __init__(self, folder: Path) -> None: ...

    def add(self, examples: Sequence[Example]) -> None:
        """Write the examples of one episode."""

    def close(self) -> None:
        """Complete and close the files."""


def check_source(pack: str) -> None:
    """Raise SettingError unless `pack` is the address of a stream whose seed is not secret."""
    if not is_stream(pack):
        raise SettingError(
            f"Demonstrations cannot be made from pack {pack!r}, because agents trained on a pack's episodes cannot "
            "be measured on them. Give a stream, whose houses are not in packaged packs: --pack stream:7."
        )
    if is_secret(seed_in(pack)):
        raise SettingError(
            "The seed of this stream is long enough to be a secret, and each row of the demonstrations would reveal "
            "it. Give a stream with a seed below 2^64, e.g. --pack stream:7."
        )


def write_demonstrations(
    out: Path,
    stream: Stream,
    count: int,
    profile: Profile,
    *,
    form: Format = "sft",
    quality: Quality = "default",
    on_episode: OnEpisode = lambda episodes: None,
) -> dict[str, Any]:
    """Write demonstrations of a stream's first `count` episodes into a new or empty folder; return facts about them.

    Raises SettingError if the format is unknown, the folder is not empty or the stream has fewer episodes. Raises
    SimulatorError if an episode cannot be played.
    """
    if form not in FORMATS:
        raise SettingError(f"Format {form!r} does not exist. Choose one of: {', '.join(FORMATS)}.")
    if out.exists() and (not out.is_dir() or any(out.iterdir())):
        raise SettingError(f"{str(out)!r} is not an empty folder. Give a new folder.")
    chosen = FORMATS[form]
    rows, episodes, privileged = Counter[str](), Counter[str](), 0
    with _whole(out) as folder, closing(stream.items()) as items, closing(Demonstrator(profile, quality)) as player:
        with closing(chosen(folder)) as writer:
            for item in islice(items, count):
                found = player.examples(item, with_corrections=chosen.has_corrections)
                writer.add(found)
                rows.update(example.fault or "demonstration" for example in found)
                privileged += sum(example.is_privileged for example in found)
                episodes[item.episode.family] += 1
                on_episode(episodes.total())
        if episodes.total() < count:
            raise SettingError(
                f"The stream has only {episodes.total()} of the {count} requested episodes. Ask for fewer."
            )
        facts = {
            **header_of(stream).model_dump(mode="json"),
            "format": form,
            "quality": quality,
            "profile": profile.model_dump(mode="json"),
            "prompt": policy_version(profile),
            "prompt_sha256": policy_sha256(profile),
            "episodes": dict(sorted(episodes.items())),
            "rows": dict(sorted(rows.items())),
            "privileged_rows": privileged,
        }
        (folder / FACTS).write_text(json.dumps(facts, indent=1) + "\n", encoding="utf-8")
        (folder / CARD).write_text(folder_readme(facts, chosen.table), encoding="utf-8")
    return facts


@contextmanager
def _whole(out: Path) -> Iterator[Path]:
    """Yield a temporary folder. At the end it becomes `out`; if an exception is raised, it is removed."""
    partial = out.absolute().with_name(f".{out.name}.partial")
    shutil.rmtree(partial, ignore_errors=True)
    partial.mkdir(parents=True)
    try:
        yield partial
        partial.rename(out)
    except BaseException:
        shutil.rmtree(partial)
        raise


def folder_readme(facts: Mapping[str, Any], table: str) -> str:
    """Return the text of the folder's README, which states these facts; `table` is the path of the rows."""
    shown = {**facts, "profile": facts["profile"]["name"], "is_lerobot": facts["format"] == "lerobot"}
    return render_card("demonstrations", **shown, table=table, words=WORDS)


FORMATS: dict[Format, type[RowWriter]] = {"sft": SftWriter, "parquet": ParquetRowWriter, "lerobot": LeRobotWriter}
