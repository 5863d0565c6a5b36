"""Generation of drafts: propose episodes of some families in many houses, validate each, and keep the valid ones.

One unit of work is a house with the families that are still to be done in it; units run in worker processes and are
written down in the order of the houses, so that the file depends on its settings alone (but for the seconds).
"""

import time
import zlib
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Future
from dataclasses import dataclass
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
from vigil.base.processes import worker_pool
from vigil.errors import EpisodeError, HouseError, SettingError
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
Proposer = Callable[[HouseContext, Family], Iterator[tuple[str, Iterator[Episode | Rejection]]]]
"""Yields kinds, each with its drafts and with what could not even be drafted."""


@dataclass(frozen=True, slots=True)
class GenerationSettings:
    """How drafts are generated."""

    families: tuple[Family, ...]
    seed: int = 0
    per_house: int = PER_HOUSE
    """Drafts kept of each family in each house, shared out evenly (rounded up) among its kinds."""
    tried: int = TRIED
    """Drafts validated of each family in each house, shared out likewise."""
    backend: str = "mujoco"
    assets: AssetDatabase | None = None
    one_family_per_house: bool = False
    """Whether each house is asked for one family alone, in turn: more houses in the same time."""
    starts: int = 1
    """Starts drawn for each draft, of which the hardest is kept; with several, what is hard to name comes first."""
    forms: Forms = "public"
    """Which half of the sentence forms is spoken."""
    is_seed_secret: bool = False
    """Whether names of houses and episodes are to tell nothing of the seed."""
    author: str = AUTHOR
    """Who proposes, as the drafts file says; the grammar of a suite has a name of its own."""

    @property
    def secret(self) -> int | None:
        """The seed where it is secret."""
        return self.seed if self.is_seed_secret else None

    def families_in(self, index: int) -> tuple[Family, ...]:
        """Return which families the house at a place in the list of houses is asked for."""
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
        """Return how many drafts of each of a family's kinds are kept in a house."""
        return -(-self.per_house // len(FAMILIES[family].kinds))

    def tried_of_kind(self, family: Family) -> int:
        """Return how many drafts of each of a family's kinds are validated in a house."""
        return -(-self.tried // len(FAMILIES[family].kinds))

    def simulator(self) -> PrivilegedSimulator:
        """Return a simulator of its own."""
        return make_simulator(self.backend, assets=self.assets or AssetDatabase.default())


@dataclass(frozen=True, slots=True)
class GenerationProgress:
    """How far the generation of drafts has come."""

    houses: int
    of: int
    kept: int
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
    """Proposes in all houses that are not done yet, and appends the drafts and rejections to `file`.

    `proposer` is an author's name with its function, which then works in this process alone; the grammar by default.
    `make_worker` makes what works in each process, of a suite whose drafts are no single episodes.
    Raises SettingError, or RecordError when the file cannot be written.
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
    if proposer is not None or workers == 1 or len(units) < 2:
        generator = DraftGenerator(settings, proposer[1]) if proposer else make_worker(settings)
        for unit in units:
            yield generator.work(*unit)
        return
    with worker_pool(workers, _begin_worker, settings, make_worker) as pool:
        futures: list[Future[HouseResult]] = [pool.submit(_work, *unit) for unit in units]
        try:
            for future in futures:
                yield future.result()
        finally:
            pool.shutdown(cancel_futures=True)


class DraftWorker(Protocol):
    """What proposes and validates in one process."""

    def work(self, source: HouseSource, families: tuple[Family, ...]) -> HouseResult:
        """Return a house and what came of proposing some families in it."""
        ...


def grammar_worker(settings: GenerationSettings) -> DraftWorker:
    """Return the built-in grammar with its simulator."""
    return DraftGenerator(settings, grammar_proposer(settings))


_workers: list[DraftWorker] = []
"""The bench of this worker process."""


def _begin_worker(settings: GenerationSettings, make_worker: Callable[[GenerationSettings], DraftWorker]) -> None:
    _workers.append(make_worker(settings))


def _work(source: HouseSource, families: tuple[Family, ...]) -> HouseResult:
    return _workers[0].work(source, families)


def grammar_proposer(settings: GenerationSettings) -> Proposer:
    """Return the built-in grammar as a proposer."""

    def proposals(context: HouseContext, family: Family) -> Iterator[tuple[str, Iterator[Episode]]]:
        for kind, drafts in kinds_of(family).items():
            key = f"{family} {kind} {context.house.name}"
            context.rng = np.random.default_rng([settings.seed, zlib.crc32(key.encode())])
            yield kind, drafts(context)

    return proposals


class DraftGenerator:
    """A simulator with what is needed to draft and to validate in it."""

    def __init__(self, settings: GenerationSettings, proposer: Proposer) -> None:
        self._settings = settings
        self._proposer = proposer
        self._simulator = settings.simulator()
        self._validator = Validator(self._simulator, is_draft=True)

    def work(self, source: HouseSource, families: tuple[Family, ...]) -> HouseResult:
        """Return a house and what came of proposing some families in it."""
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
            found = list(self._family(context, family))
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

    def _family(self, context: HouseContext, family: Family) -> Iterator[Draft | Rejection]:
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
        """Return a draft under its own id when it holds, else why it does not."""
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
    """Return what a pack is balanced over."""
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
    """Yield the lines of a house that cannot be had."""
    for family in families:
        yield Rejection(family=family, kind="", house=name, rule=HOUSE_RULE, message=message)
        yield FamilyDone(family=family, house=name, kept=0, rejected={HOUSE_RULE: 1}, seconds=round(seconds, 2))
