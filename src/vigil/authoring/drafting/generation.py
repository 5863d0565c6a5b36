"""Generation of drafts: proposes tasks in many houses, and checks each task.

A unit of work is a house with the families that are not yet finished in it. Units run in worker processes, and their
results are written in the order of the houses. So the file depends only on its settings, except for the recorded
durations. A grammar consists of a proposer and a checker: the families' grammar is here, and the grammar of the closure
suite in `vigil.authoring.closure.generation`.
"""

import time
import zlib
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import islice
from typing import Any

import numpy as np

from vigil.assets.database import AssetDatabase
from vigil.authoring.drafting.amounts import PER_HOUSE, TRIED
from vigil.authoring.drafting.drafts import (
    DRAFTS_VERSION,
    ClosureDraft,
    Draft,
    DraftFacts,
    DraftLine,
    DraftsFile,
    FamilyDone,
    Header,
    ListDraft,
    Rejection,
    TaskDraft,
    draft_id,
)
from vigil.authoring.drafting.grammar import Proposals, kinds_of
from vigil.authoring.drafting.house_context import AUTHOR, HouseContext
from vigil.authoring.drafting.sources import HouseSource
from vigil.authoring.language.sentences import Forms
from vigil.authoring.review.validate import Finding, Validator
from vigil.base.processes.group import map_in_workers
from vigil.errors import EpisodeError, HouseError, SettingError
from vigil.protocol.actions import Action, Report
from vigil.protocol.episode import Episode
from vigil.protocol.families import Family, wanted_kinds
from vigil.protocol.goals import ReportStatus
from vigil.protocol.house import House
from vigil.protocol.world import Setup
from vigil.scene.outlines import room_floor
from vigil.scoring.chore_answers import ListAnswer
from vigil.scoring.closure import ClosureAnswer
from vigil.sim import make_simulator
from vigil.sim.privileged import PrivilegedSimulator

HOUSE_RULE = "house_holds_episodes"
"""Rule that a house breaks if it cannot be loaded, or if it has no free place to stand."""


@dataclass(frozen=True, slots=True)
class SolvedSide:
    """One side of a valid task, with the actions that close it correctly."""

    episode: Episode
    actions: tuple[Action, ...]
    answer: ClosureAnswer | ListAnswer | None = None
    """Correct closing of the side in a suite; None for an episode of the families."""


Proposer = Callable[[HouseContext, Family], Iterator[tuple[str, Iterator[Any]]]]
"""Function that yields (kind, its proposals). Ideas that did not become proposals are included as rejections."""
Checker = Callable[[Any, House], tuple[Sequence[SolvedSide], Sequence[Finding]]]
"""Function that returns the sides of a valid proposal and no findings, or no sides and the findings about it."""


@dataclass(frozen=True, slots=True)
class Grammar:
    """A way to make drafts: who proposes tasks, and who checks them."""

    author: str
    """Name of the author of the proposals, for the drafts file."""
    make_proposer: Callable[[int], Proposer]
    """Function that takes a seed and returns the proposer."""
    make_checker: Callable[[PrivilegedSimulator], Checker]
    """Function that takes a simulator and returns the checker."""
    shares_limits: bool = True
    """Whether a family's limits in a house are divided among its kinds. If False, each kind has the whole limit."""
    facts_of: Callable[[HouseContext, SolvedSide], DraftFacts] | None = None
    """Function that returns the facts about a valid proposal's first side; None to use `facts_of` below."""


def seed_context(context: HouseContext, seed: int, label: str) -> None:
    """Seed the context's random numbers from `seed`, `label` and the name of its house."""
    context.rng = np.random.default_rng([seed, zlib.crc32(f"{label} {context.house.name}".encode())])


def proposer_of(kinds: Callable[[Family], Mapping[str, Proposals]], seed: int, suite: str = "") -> Proposer:
    """Return a proposer. `kinds` takes a family and returns kind -> the function that proposes tasks of this kind.

    `seed`, the name of the suite (if any, otherwise of the family) and the kind determine the random choices.
    """

    def proposals(context: HouseContext, family: Family) -> Iterator[tuple[str, Iterator[Any]]]:
        for kind, propose in kinds(family).items():
            seed_context(context, seed, f"{suite or family} {kind}")
            yield kind, propose(context)

    return proposals


family_proposer = partial(proposer_of, kinds_of)
"""Function that takes a seed and returns the proposer of the families' kinds."""


def family_checker(simulator: PrivilegedSimulator) -> Checker:
    """Return the checker of single episodes by the rules of the families."""
    validator = Validator(simulator, is_draft=True)

    def check(episode: Episode, house: House) -> tuple[Sequence[SolvedSide], Sequence[Finding]]:
        result = validator.validate(episode, house)
        return [SolvedSide(episode, result.actions)], result.findings

    return check


FAMILY_GRAMMAR = Grammar(AUTHOR, family_proposer, family_checker)


@dataclass(frozen=True, slots=True)
class GenerationSettings:
    """Settings of the generation of drafts."""

    families: tuple[Family, ...]
    seed: int = 0
    per_house: int = PER_HOUSE
    """Maximum number of valid drafts of each family in each house; the family's kinds share it evenly (rounded up)."""
    tried: int = TRIED
    """Maximum number of proposals of each family that are checked in each house; the family's kinds share it, too."""
    backend: str = "mujoco"
    assets: AssetDatabase | None = None
    one_family_per_house: bool = False
    """Whether each house gets only one family, in rotation, so that more houses are used in the same time."""
    starts: int = 1
    """Number of start poses drawn for each draft; the hardest is used.

    If it is more than one, objects that are hard to name are proposed first.
    """
    forms: Forms = "public"
    """Sentence forms from which instructions are drawn: the public half, the held-out half, or all."""
    is_seed_secret: bool = False
    """Whether names of houses and episodes must not reveal the seed."""
    grammar: Grammar = FAMILY_GRAMMAR
    templates: tuple[str, ...] = ()
    """Kinds of episodes to draft. A family that has none of these kinds gets all its kinds."""

    @property
    def secret(self) -> int | None:
        """The seed if it is secret; otherwise None."""
        return self.seed if self.is_seed_secret else None

    def families_in(self, index: int) -> tuple[Family, ...]:
        """Return the families to propose in the house at position `index` of the list of houses."""
        return (self.families[index % len(self.families)],) if self.one_family_per_house else self.families

    def header(self) -> Header:
        """Return the header of the drafts file, which is its first line."""
        return Header(
            author=self.grammar.author,
            seed=self.seed,
            simulator=self.backend,
            per_house=self.per_house,
            tried=self.tried,
            starts=self.starts,
            forms=self.forms,
            templates=self.templates,
            drafts=DRAFTS_VERSION,
            is_seed_secret=self.is_seed_secret,
            asset_database_sha256=None if self.assets is None else self.assets.sha256,
        )

    def limit(self, of_house: int, family: Family) -> int:
        """Return the limit for each kind of a family in a house; `of_house` is the limit for the whole family."""
        kinds = wanted_kinds(family, self.templates)
        return -(-of_house // len(kinds)) if self.grammar.shares_limits else of_house

    def simulator(self) -> PrivilegedSimulator:
        """Return a new simulator."""
        return make_simulator(self.backend, assets=self.assets or AssetDatabase.default())


@dataclass(frozen=True, slots=True)
class GenerationProgress:
    """Progress of the generation of drafts."""

    houses: int
    """Number of houses that are finished."""
    of: int
    """Total number of houses."""
    kept: Mapping[str, int]
    """Family (in a suite: kind) -> number of valid drafts in the file."""
    rejected: int
    """Number of rejections in the file."""


WorkUnit = tuple[HouseSource, tuple[Family, ...]]
HouseResult = tuple[House | None, list[DraftLine]]


def generate_drafts(
    file: DraftsFile,
    sources: Iterable[HouseSource],
    settings: GenerationSettings,
    *,
    workers: int = 1,
    on_progress: Callable[[GenerationProgress], None] = lambda report: None,
) -> None:
    """Propose tasks in all houses that are not finished yet, and append the drafts and rejections to `file`.

    Raises SettingError, or RecordError if the file cannot be written.
    """
    with file.writing(settings.header()) as writer:
        units: list[WorkUnit] = []
        done = writer.done
        for index, source in enumerate(sources):
            missing = [each for each in settings.families_in(index) if (source.name, each) not in done]
            if missing:
                units.append((source, tuple(missing)))
        kept, rejected = Counter(task.group for task in writer.begun.tasks), len(writer.begun.rejections)
        results = map_in_workers(partial(DraftWorker, settings), _work, units, workers)
        for number, (house, lines) in enumerate(results, start=1):
            writer.add(house, lines)
            kept.update(line.group for line in lines if isinstance(line, TaskDraft))
            rejected += sum(isinstance(line, Rejection) for line in lines)
            on_progress(GenerationProgress(number, len(units), kept, rejected))


def _work(worker: "DraftWorker", unit: WorkUnit) -> HouseResult:
    return worker.work(*unit)


class DraftWorker:
    """Proposes tasks in houses and checks them, on its own simulator."""

    def __init__(self, settings: GenerationSettings) -> None:
        self._settings = settings
        self._simulator = settings.simulator()
        self._propose = settings.grammar.make_proposer(settings.seed)
        self._check = settings.grammar.make_checker(self._simulator)

    def work(self, source: HouseSource, families: tuple[Family, ...]) -> HouseResult:
        """Propose episodes of these families in a house. Return the house and the lines for the drafts file.

        The house is None if it cannot be made.
        """
        begun = time.monotonic()
        try:
            house = source.house()
            context = HouseContext(self._simulator, house, np.random.default_rng(self._settings.seed))
        except (HouseError, EpisodeError, SettingError) as error:
            failed = [
                Rejection(family=family, kind="", house=source.name, rule=HOUSE_RULE, message=str(error))
                for family in families
            ]
            return None, [line for each in failed for line in (each, _done(each.family, source.name, [each], begun))]
        context.compared_starts = self._settings.starts
        context.forms = self._settings.forms
        origin = source.origin(house)
        lines: list[DraftLine] = [] if origin is None else [origin]
        for family in families:
            begun = time.monotonic()
            found = list(self._lines_of_family(context, family))
            lines += [*found, _done(family, house.name, found, begun)]
        return house, lines

    def _lines_of_family(self, context: HouseContext, family: Family) -> Iterator[DraftLine]:
        most, tried = (self._settings.limit(each, family) for each in (self._settings.per_house, self._settings.tried))
        seen: set[str] = set()
        wanted = wanted_kinds(family, self._settings.templates)
        for kind, proposals in self._propose(context, family):
            if self._settings.templates and kind not in wanted:
                continue
            kept = 0
            context.begin(Setup())
            for proposal in islice(proposals, tried):
                is_draft = not isinstance(proposal, Rejection)
                line = self._examine(context, family, kind, proposal) if is_draft else proposal
                context.begin(Setup())
                if not isinstance(line, Rejection):
                    if line.drafts[0].episode.id in seen:
                        continue
                    seen.add(line.drafts[0].episode.id)
                    kept += 1
                yield line
                if kept >= most:
                    break

    def _examine(self, context: HouseContext, family: Family, kind: str, proposal: Any) -> TaskDraft | Rejection:
        """Return a draft with final ids if the proposal is valid; else a rejection with the first rule it breaks."""
        house, secret = context.house, self._settings.secret
        sides, findings = self._check(proposal, house)
        if findings:
            return context.rejection(family, kind, findings[0].rule, findings[0].message, proposal.instruction)
        facts = (self._settings.grammar.facts_of or facts_of)(context, sides[0])
        drafts = tuple(named_draft(kind, side, facts, house, secret) for side in sides)
        answers: list[Any] = [side.answer for side in sides]
        if answers[0] is None:
            return drafts[0]
        pair = {"pair": f"pair:{drafts[0].episode.id}"} if len(drafts) > 1 else {}
        named = tuple(
            answer.model_copy(update={"episode_id": draft.episode.id, **pair})
            for answer, draft in zip(answers, drafts, strict=True)
        )
        suite_draft = ListDraft if isinstance(answers[0], ListAnswer) else ClosureDraft
        return suite_draft(kind=answers[0].kind, drafts=drafts, answers=named)


def named_draft(kind: str, side: SolvedSide, facts: DraftFacts, house: House, secret: int | None) -> Draft:
    """Return the draft of a side with its final id. The ids of twins have the same form and do not reveal the side."""
    name = draft_id(side.episode, facts.category, house, secret)
    shown = {"validated": True, "solution_steps": len(side.actions)}
    provenance = side.episode.provenance.model_copy(update=shown)
    episode = side.episode.model_copy(update={"id": name, "provenance": provenance})
    return Draft(kind=kind, episode=episode, actions=side.actions, facts=facts)


def facts_of(context: HouseContext, side: SolvedSide) -> DraftFacts:
    """Return the facts that are used to balance packs. The simulator is reset to the episode's start."""
    episode, last = side.episode, side.actions[-1]
    context.simulator.reset(episode.start, episode.setup)
    target = context.thing(episode.goal.object_id)
    rooms = context.simulator.scene().rooms
    label = last.status if isinstance(episode.goal, ReportStatus) and isinstance(last, Report) else None
    return DraftFacts(
        category=target.category,
        rooms=len(rooms),
        area_m2=round(sum(room_floor(room).area for room in rooms), 1),
        distance_m=round(context.view.state_of(target.id).box_distance_m, 2),
        is_seen_by_turning=context.is_visible_from(episode.start.position, target),
        label=label if label in ("on", "off", "open", "closed") else None,
    )


def _done(family: Family, house: str, found: Sequence[DraftLine], begun: float) -> FamilyDone:
    """Return the line that says that a family in a house is finished; `begun` is the time (s) when this work began."""
    rules = Counter(line.rule for line in found if isinstance(line, Rejection))
    kept = sum(isinstance(line, TaskDraft) for line in found)
    seconds = round(time.monotonic() - begun, 2)
    return FamilyDone(family=family, house=house, kept=kept, rejected=dict(sorted(rules.items())), seconds=seconds)
