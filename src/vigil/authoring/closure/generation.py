"""Generation of the suite's drafts: propose tasks of each kind in a house, and certify each of them."""

import time
import zlib
from collections import Counter
from collections.abc import Callable, Iterator
from itertools import islice

import numpy as np

from vigil.authoring.closure.certify import Certified, Certifier
from vigil.authoring.closure.tasks import ClosureTask, Tasks
from vigil.authoring.drafting.drafts import (
    ClosureDraft,
    Draft,
    DraftFacts,
    DraftLine,
    FamilyDone,
    Rejection,
    draft_id,
)
from vigil.authoring.drafting.generation import GenerationSettings, HouseResult, facts_of, lines_without_house
from vigil.authoring.drafting.house_context import HouseContext
from vigil.authoring.drafting.sources import HouseSource
from vigil.base.exported import loaded
from vigil.errors import EpisodeError, HouseError, SettingError
from vigil.protocol.episode import Episode
from vigil.protocol.families import Family
from vigil.protocol.world import Setup
from vigil.scoring.closure import CLOSURE_KINDS, KINDS, Kind

PROPOSALS: dict[Kind, Callable[[HouseContext], Tasks]] = {
    name: loaded(kind.tasks) for name, kind in CLOSURE_KINDS.items()
}
"""Kind -> the function that proposes its tasks in a house."""
AUTHOR = "closure grammar"
FAMILY: Family = "SI"
"""Family under which a house is marked as done; episodes are of SI, and of CR where a constraint must be resolved."""


class ClosureGenerator:
    """A draft worker that proposes and certifies tasks of the suite."""

    def __init__(self, settings: GenerationSettings) -> None:
        self._settings = settings
        self._simulator = settings.simulator()
        self._certifier = Certifier(self._simulator)

    def work(self, source: HouseSource, families: tuple[Family, ...]) -> HouseResult:
        """Return the house, or None if it cannot be made, and the lines of proposing all kinds in it."""
        begun = time.monotonic()
        try:
            house = source.house()
            context = HouseContext(self._simulator, house, np.random.default_rng(self._settings.seed))
            context.forms = self._settings.forms
        except (HouseError, EpisodeError, SettingError) as error:
            return None, list(lines_without_house(source.name, families, str(error), time.monotonic() - begun))
        found = [line for kind in KINDS for line in self._lines_of_kind(context, kind)]
        rules = Counter(line.rule for line in found if isinstance(line, Rejection))
        done = FamilyDone(
            family=FAMILY,
            house=house.name,
            kept=sum(isinstance(line, ClosureDraft) for line in found),
            rejected=dict(sorted(rules.items())),
            seconds=round(time.monotonic() - begun, 2),
        )
        origin = source.origin(house)
        lines: list[DraftLine] = [*([] if origin is None else [origin]), *found, done]
        return house, lines

    def _lines_of_kind(self, context: HouseContext, kind: Kind) -> Iterator[ClosureDraft | Rejection]:
        context.rng = np.random.default_rng(
            [self._settings.seed, zlib.crc32(f"closure {kind} {context.house.name}".encode())]
        )
        context.begin(Setup())
        kept, seen = 0, set[str]()
        for proposal in islice(PROPOSALS[kind](context), self._settings.tried):
            line = proposal if isinstance(proposal, Rejection) else self._examine(context, proposal)
            context.begin(Setup())
            if isinstance(line, ClosureDraft):
                name = line.drafts[0].episode.id
                if name in seen:
                    continue
                seen.add(name)
                kept += 1
            yield line
            if kept >= self._settings.per_house:
                return

    def _examine(self, context: HouseContext, task: ClosureTask) -> ClosureDraft | Rejection:
        """Return the draft of a certified task, with its final ids; else a rejection with the first broken rule."""
        sides, findings = self._certifier.certify(task, context.house)
        if findings:
            return Rejection(
                family=FAMILY,
                kind=task.kind,
                house=context.house.name,
                rule=findings[0].rule,
                message=findings[0].message,
                instruction=task.episodes[0].instruction,
            )
        facts = facts_of(context, sides[0].episode, sides[0].actions)
        drafts = tuple(_draft_of(context, side, facts, self._settings.secret) for side in sides)
        pair = f"pair:{drafts[0].episode.id}" if len(drafts) > 1 else None
        answers = tuple(
            side.answer.model_copy(update={"episode_id": draft.episode.id, "pair": pair})
            for side, draft in zip(sides, drafts, strict=True)
        )
        return ClosureDraft(kind=task.kind, drafts=drafts, answers=answers)


def closure_worker(settings: GenerationSettings) -> ClosureGenerator:
    """Return a worker that proposes the suite's tasks on its own simulator."""
    return ClosureGenerator(settings)


def _draft_of(context: HouseContext, side: Certified, facts: DraftFacts, secret: int | None) -> Draft:
    """Return the draft of a side; ids have one form for both twins, so that they do not reveal the side."""
    episode: Episode = side.episode
    provenance = episode.provenance.model_copy(update={"validated": True, "solution_steps": len(side.actions)})
    name = draft_id(episode, facts.category, context.house, secret)
    named = episode.model_copy(update={"id": name, "provenance": provenance})
    return Draft(kind=side.answer.kind, episode=named, actions=side.actions, facts=facts)
