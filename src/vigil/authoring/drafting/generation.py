"""Generation of drafts: propose episodes of some families in many houses, and validate each.

One unit of work is a house with the families that are still to be done in it. Units run in worker processes, and their
results are written in the order of the houses. The file thus depends only on its settings, except for the durations.
"""

import time
import zlib
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import islice
from typing import Protocol

import numpy as np

from vigil.assets.database import AssetDatabase
from vigil.authoring.drafting.drafts import (
    DRAFTS_VERSION,
    ClosureDraft,
    Draft,
    DraftFacts,
    DraftLine,
    DraftsFile,
    FamilyDone,
    Header,
    Rejection,
    draft_id,
)
from vigil.authoring.drafting.grammar import kinds_of
from vigil.authoring.drafting.house_context import AUTHOR, HouseContext
from vigil.authoring.drafting.sources import HouseSource
from vigil.authoring.language.sentences import Forms
from vigil.authoring.review.validate import Validator
from vigil.errors import EpisodeError, HouseError, SettingError
from vigil.processes.group import map_in_workers
from vigil.protocol.actions import Action, Report
from vigil.protocol.episode import Episode
from vigil.protocol.families import FAMILIES, Family
from vigil.protocol.goals import ReportStatus
from vigil.protocol.house import House
from vigil.protocol.world import Setup
from vigil.scene.outlines import room_floor
from vigil.sim import make_simulator
from vigil.sim.privileged import PrivilegedSimulator

PER_HOUSE, TRIED = 3, 20
HOUSE_RULE = "house_holds_episodes"
"""Rule that a house breaks if it cannot be loaded or nobody can stand in it."""
Proposer = Callable[[HouseContext, Family], Iterator[tuple[str, Iterator[Episode | Rejection]]]]
"""A function that yields kinds, each with its drafts and with rejections of proposals that did not become drafts."""


@dataclass(frozen=True, slots=True)
class GenerationSettings:
    """Settings of the generation of drafts."""

    families: tuple[Family, ...]
    seed: int = 0
    per_house: int = PER_HOUSE
    """Greatest number of valid drafts of each family in each house, divided evenly (rounded up) among its kinds."""
    tried: int = TRIED
    """Greatest number of drafts validated of each family in each house, divided likewise."""
    backend: str = "mujoco"
    assets: AssetDatabase | None = None
    one_family_per_house: bool = False
    """Whether each house gets only one family, in rotation, so that the same time covers more houses."""
    starts: int = 1
    """Number of start poses drawn for each draft, of which the hardest is used.

    With several, objects that are hard to name are proposed first.
    """
    forms: Forms = "public"
    """Half of the sentence forms from which instructions are drawn, or all."""
    is_seed_secret: bool = False
    """Whether names of houses and episodes must not reveal the seed."""
    author: str = AUTHOR
    """Author of the proposals in the drafts file; the grammar of a suite has its own name."""

    @property
    def secret(self) -> int | None:
        """The seed if it is secret, else None."""
        return self.seed if self.is_seed_secret else None

    def families_in(self, index: int) -> tuple[Family, ...]:
        """Return the families proposed in the house at an index of the list of houses."""
        return (self.families[index % len(self.families)],) if self.one_family_per_house else self.families

    def header(self, simulator: str, author: str) -> Header:
        """Return the first line of the drafts file."""
        return Header(
            author=author,
            seed=self.seed,
            simulator=simulator,
            per_house=self.per_house,
            tried=self.tried,
            starts=self.starts,
            forms=self.forms,
            drafts=DRAFTS_VERSION,
            is_seed_secret=self.is_seed_secret,
            asset_database_sha256=None if self.assets is None else self.assets.sha256,
        )

    def kept_of_kind(self, family: Family) -> int:
        """Return the greatest number of valid drafts of each of a family's kinds in a house."""
        return -(-self.per_house // len(FAMILIES[family].kinds))

    def tried_of_kind(self, family: Family) -> int:
        """Return the greatest number of drafts validated of each of a family's kinds in a house."""
        return -(-self.tried // len(FAMILIES[family].kinds))

    def simulator(self) -> PrivilegedSimulator:
        """Return a new simulator."""
        return make_simulator(self.backend, assets=self.assets or AssetDatabase.default())


@dataclass(frozen=True, slots=True)
class GenerationProgress:
    """Progress of the generation of drafts."""

    houses: int
    """Number of houses done."""
    of: int
    """Number of houses to do."""
    kept: int
    """Number of valid drafts or tasks."""
    rejected: int


WorkUnit = tuple[HouseSource, tuple[Family, ...]]
HouseResult = tuple[House | None, list[DraftLine]]


def generate_drafts(
    file: DraftsFile,
    sources: Iterable[HouseSource],
    settings: GenerationSettings,
    *,
    workers: int = 1,
    proposer: tuple[str, Proposer] | None = None,
    make_worker: Callable[[GenerationSettings], "DraftWorker"] | None = None,
    on_progress: Callable[[GenerationProgress], None] = lambda report: None,
) -> None:
    """Propose in all houses that are not done yet, and append the drafts and rejections to `file`.

    `proposer` is an author's name with its function, which then runs only in this process; the grammar by default.
    `make_worker` makes the worker of each process; a suite whose drafts are not single episodes gives its own.
    Raises SettingError, or RecordError if the file cannot be written.
    """
    wanted = list(sources)
    author = proposer[0] if proposer else settings.author
    with file.writing(settings.header(settings.backend, author)) as writer:
        units: list[WorkUnit] = []
        for index, source in enumerate(wanted):
            missing: tuple[Family, ...] = tuple(
                family for family in settings.families_in(index) if (source.name, family) not in writer.done
            )
            if missing:
                units.append((source, missing))
        kept = rejected = 0
        work = _house_results(units, settings, workers, proposer, make_worker or grammar_worker)
        for number, (house, lines) in enumerate(work, start=1):
            writer.add(house, lines)
            kept += sum(isinstance(line, Draft | ClosureDraft) for line in lines)
            rejected += sum(isinstance(line, Rejection) for line in lines)
            on_progress(GenerationProgress(number, len(units), kept, rejected))


def _house_results(
    units: Sequence[WorkUnit],
    settings: GenerationSettings,
    workers: int,
    proposer: tuple[str, Proposer] | None,
    make_worker: Callable[[GenerationSettings], "DraftWorker"],
) -> Iterator[HouseResult]:
    if proposer is not None:
        make, workers = partial(DraftGenerator, settings, proposer[1]), 1  # a proposer that asks a model stays here
    else:
        make = partial(make_worker, settings)
    yield from map_in_workers(make, _work, units, workers)


class DraftWorker(Protocol):
    """A worker that proposes and validates in one process."""

    def work(self, source: HouseSource, families: tuple[Family, ...]) -> HouseResult:
        """Return a house, or None if it cannot be made, and the lines of proposing some families in it."""
        ...


def grammar_worker(settings: GenerationSettings) -> DraftWorker:
    """Return a worker that proposes with the built-in grammar on its own simulator."""
    return DraftGenerator(settings, grammar_proposer(settings))


def _work(worker: DraftWorker, unit: WorkUnit) -> HouseResult:
    return worker.work(*unit)


def grammar_proposer(settings: GenerationSettings) -> Proposer:
    """Return the built-in grammar as a proposer."""

    def proposals(context: HouseContext, family: Family) -> Iterator[tuple[str, Iterator[Episode]]]:
        for kind, drafts in kinds_of(family).items():
            key = f"{family} {kind} {context.house.name}"
            context.rng = np.random.default_rng([settings.seed, zlib.crc32(key.encode())])
            yield kind, drafts(context)

    return proposals


class DraftGenerator:
    """A draft worker whose proposer yields single episodes."""

    def __init__(self, settings: GenerationSettings, proposer: Proposer) -> None:
        self._settings = settings
        self._proposer = proposer
        self._simulator = settings.simulator()
        self._validator = Validator(self._simulator, is_draft=True)

    def work(self, source: HouseSource, families: tuple[Family, ...]) -> HouseResult:
        """Return a house, or None if it cannot be made, and the lines of proposing some families in it."""
        begun = time.monotonic()
        try:
            house = source.house()
            context = HouseContext(self._simulator, house, np.random.default_rng(self._settings.seed))
            context.compared_starts = self._settings.starts
            context.forms = self._settings.forms
        except (HouseError, EpisodeError, SettingError) as error:
            return None, list(lines_without_house(source.name, families, str(error), time.monotonic() - begun))
        origin = source.origin(house)
        lines: list[DraftLine] = [] if origin is None else [origin]
        for family in families:
            begun = time.monotonic()
            found = list(self._lines_of_family(context, family))
            lines += found
            rules = Counter(line.rule for line in found if isinstance(line, Rejection))
            kept = sum(isinstance(line, Draft) for line in found)
            seconds = round(time.monotonic() - begun, 2)
            lines.append(
                FamilyDone(
                    family=family, house=house.name, kept=kept, rejected=dict(sorted(rules.items())), seconds=seconds
                )
            )
        return house, lines

    def _lines_of_family(self, context: HouseContext, family: Family) -> Iterator[Draft | Rejection]:
        most, tried = self._settings.kept_of_kind(family), self._settings.tried_of_kind(family)
        seen: set[str] = set()
        for kind, proposals in self._proposer(context, family):
            kept = 0
            context.begin(Setup())
            for proposal in islice(proposals, tried):
                line = proposal if isinstance(proposal, Rejection) else self._examine(context, kind, proposal)
                context.begin(Setup())
                if isinstance(line, Draft):
                    if line.episode.id in seen:
                        continue
                    seen.add(line.episode.id)
                    kept += 1
                yield line
                if kept >= most:
                    break

    def _examine(self, context: HouseContext, kind: str, episode: Episode) -> Draft | Rejection:
        """Return the draft of a valid episode, with its final id; else a rejection with the first broken rule."""
        verdict = self._validator.validate(episode, context.house)
        rule, message = next(((found.rule, found.message) for found in verdict.findings), ("", ""))
        if rule:
            return Rejection(
                family=episode.family,
                kind=kind,
                house=context.house.name,
                rule=rule,
                message=message,
                instruction=episode.instruction,
            )
        facts = facts_of(context, episode, verdict.actions)
        provenance = episode.provenance.model_copy(update={"validated": True, "solution_steps": len(verdict.actions)})
        name = draft_id(episode, facts.category, context.house, self._settings.secret)
        named = episode.model_copy(update={"id": name, "provenance": provenance})
        return Draft(kind=kind, episode=named, actions=verdict.actions, facts=facts)


def facts_of(context: HouseContext, episode: Episode, actions: tuple[Action, ...]) -> DraftFacts:
    """Return the facts over which packs are balanced; resets the simulator to the episode's start."""
    context.simulator.reset(episode.start, episode.setup)
    target = context.thing(episode.goal.object_id)
    rooms = context.simulator.scene().rooms
    last = actions[-1]
    label = last.status if isinstance(episode.goal, ReportStatus) and isinstance(last, Report) else None
    return DraftFacts(
        category=target.category,
        rooms=len(rooms),
        area_m2=round(sum(room_floor(room).area for room in rooms), 1),
        distance_m=round(context.view.state_of(target.id).box_distance_m, 2),
        is_seen_by_turning=context.is_visible_from(episode.start.position, target),
        label=label if label in ("on", "off", "open", "closed") else None,
    )


def lines_without_house(name: str, families: tuple[Family, ...], message: str, seconds: float) -> Iterator[DraftLine]:
    """Yield the lines of a house that cannot be made: for each family a rejection and its end."""
    for family in families:
        yield Rejection(family=family, kind="", house=name, rule=HOUSE_RULE, message=message)
        yield FamilyDone(family=family, house=name, kept=0, rejected={HOUSE_RULE: 1}, seconds=round(seconds, 2))
