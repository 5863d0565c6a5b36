"""One house of a stream with its episodes. They depend only on the stream's seed, the house's number and the filters.

All families are drafted in each house, because making and loading a house takes long. The filters (wanted families and
difficulties) only remove episodes; they do not change the remaining episodes.
"""

import hashlib
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache, cached_property
from typing import Literal

from pydantic import BaseModel, ConfigDict, Field

from vigil.authoring.drafting.drafts import DIGITS, Draft, ListDraft, Rejection
from vigil.authoring.drafting.generation import (
    FAMILY_GRAMMAR,
    DraftWorker,
    GenerationSettings,
    Proposer,
    family_proposer,
)
from vigil.authoring.drafting.grammar import kinds_of
from vigil.authoring.drafting.house_context import HouseContext
from vigil.authoring.drafting.sources import MIXED, GeneratedHouse, secret_house
from vigil.authoring.packing.suites import SUITES
from vigil.authoring.streaming.address import stream_version
from vigil.authoring.streaming.difficulty import DIFFICULTIES, Difficulty, difficulty_of
from vigil.packs.files import HOUSES
from vigil.packs.pack import manifest_of, packaged_names
from vigil.protocol.episode import Episode
from vigil.protocol.families import FAMILIES, Family
from vigil.protocol.house import House, canonical_json
from vigil.scoring.chore_answers import ListAnswer

PER_HOUSE, TRIED = 4, 8
"""Maximum number of valid drafts, and of checked drafts, of a family in a house; the family's kinds share them."""
LISTS_PER_HOUSE = 1
"""Greatest number of lists of chores of each length in one house."""
KINDS_TRIED = 5
"""Maximum number of a family's kinds that are proposed in one house. The house's name determines which kinds."""
TRIED_STARTS = 24
"""Number of places tried for a start. It is smaller than for packs, so that houses are made quickly."""
FIRST_HOUSE_SEED = 2**32
"""Smallest seed of a stream's houses. Houses of `vigil pack make` and of the packaged packs have smaller seeds."""
SEED_BYTES = 6
PACKAGED = "it is a house of a packaged pack"


@dataclass(frozen=True, slots=True)
class StreamSettings:
    """Settings of a stream: its seed, and the wanted families and difficulties."""

    seed: int
    families: tuple[Family, ...] = tuple(FAMILIES)
    difficulties: tuple[Difficulty, ...] = DIFFICULTIES
    is_seed_secret: bool = False
    """Whether houses and episodes must not reveal the seed."""
    suite: Literal["chores"] | None = None
    """Suite of the episodes; None for episodes of the families."""

    @property
    def label(self) -> str:
        """Name of the stream in messages."""
        return "of a secret seed" if self.is_seed_secret else str(self.seed)


class StreamHouse(BaseModel):
    """A house of a stream with its episodes, in the order of their ids."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    number: int
    """Position of the house in the stream, counted from 0."""
    name: str
    document: dict | None
    """The house document; None if the house is left out."""
    drafts: tuple[Draft, ...] = ()
    answers: tuple[ListAnswer, ...] = Field(default=(), exclude_if=lambda answers: not answers)
    """Answers of lists of chores, in the order of the drafts; empty for episodes of the families."""
    left_out: str = ""
    """Reason why the house is left out: a packaged pack has it, or it cannot be made. Empty if it is not left out."""

    @cached_property
    def house(self) -> House:
        """The house as an object. It must not be read if the house is left out."""
        assert self.document is not None
        return House(self.name, self.document)


@cache
def packaged_houses() -> frozenset[str]:
    """Return the SHA-256 of each house file in the packaged packs."""
    return frozenset(
        sha256
        for name in packaged_names()
        for path, sha256 in manifest_of(name).files.items()
        if path.startswith(f"{HOUSES}/")
    )


def is_packaged(house: House) -> bool:
    """Return whether a packaged pack has exactly this house."""
    return hashlib.sha256(canonical_json(house.data) + b"\n").hexdigest() in packaged_houses()


def house_source(settings: StreamSettings, number: int) -> GeneratedHouse:
    """Return the source of house number `number` of a stream."""
    specs = MIXED if settings.suite is None else SUITES[settings.suite].houses
    spec = specs[number % len(specs)]
    if settings.is_seed_secret:
        return secret_house(settings.seed, number, spec)
    digest = hashlib.sha256(f"stream {settings.seed} house {number}".encode()).digest()
    return GeneratedHouse(FIRST_HOUSE_SEED + int.from_bytes(digest[:SEED_BYTES], "big"), spec)


class StreamHouseMaker:
    """Makes the houses of one stream, on its own simulator."""

    def __init__(self, settings: StreamSettings) -> None:
        self._settings = settings
        is_of_families = settings.suite is None
        drafting = GenerationSettings(
            settings.families,
            settings.seed,
            PER_HOUSE if is_of_families else LISTS_PER_HOUSE,
            TRIED,
            is_seed_secret=settings.is_seed_secret,
            grammar=replace(FAMILY_GRAMMAR, make_proposer=_proposer_with_less_search)
            if settings.suite is None
            else SUITES[settings.suite].grammar,
        )
        self._worker = DraftWorker(drafting)

    def made(self, number: int) -> StreamHouse:
        """Return house number `number` of the stream, with its episodes."""
        source = house_source(self._settings, number)
        house, lines = self._worker.work(source, self._settings.families)
        if house is None or is_packaged(house):
            why = PACKAGED if house else next(line.message for line in lines if isinstance(line, Rejection))
            return StreamHouse(number=number, name=source.name, document=None, left_out=why)
        lists = [line for line in lines if isinstance(line, ListDraft)]
        drafts = [line for line in lines if isinstance(line, Draft)] + [each.drafts[0] for each in lists]
        named = [self._with_stream_id(draft, number) for draft in drafts]
        wanted = [draft for draft in named if difficulty_of(draft) in self._settings.difficulties]
        ordered = tuple(sorted(wanted, key=lambda draft: draft.episode.id))
        names = {old.episode.id: new.episode.id for old, new in zip(drafts, named, strict=True)}
        given = {names[each.answers[0].episode_id]: each.answers[0] for each in lists}
        answers = tuple(
            given[draft.episode.id].model_copy(update={"episode_id": draft.episode.id}) for draft in ordered if given
        )
        return StreamHouse(number=number, name=house.name, document=house.data, drafts=ordered, answers=answers)

    def _with_stream_id(self, draft: Draft, number: int) -> Draft:
        """Return a draft with an id that names stream, version and house; unchanged if the seed is secret."""
        if self._settings.is_seed_secret:
            return draft
        episode = draft.episode
        stem = f"stream{self._settings.seed}v{stream_version()}_{number:010d}"
        family, category = episode.family.lower(), draft.facts.category.lower()
        named = episode.model_copy(update={"id": f"{stem}_{episode.id[-DIGITS:]}_{category}_{family}"})
        return draft.model_copy(update={"episode": named})


def _proposer_with_less_search(seed: int) -> Proposer:
    """Return a proposer that tries fewer starts, and not all kinds of a family that has many."""
    propose = family_proposer(seed)

    def proposals(context: HouseContext, family: Family) -> Iterator[tuple[str, Iterator[Episode | Rejection]]]:
        context.tried_starts = TRIED_STARTS
        stride = -(-len(kinds_of(family)) // KINDS_TRIED)
        turn = zlib.crc32(context.house.name.encode())
        for place, (kind, drafts) in enumerate(propose(context, family)):
            if (place + turn) % stride == 0:
                yield kind, drafts

    return proposals
