"""Selection of a pack's tasks from drafts and reviews: deterministic, and balanced over the pack's strata.

Within a stratum, tasks that a reviewer approved are selected before tasks without a review. Rejected tasks are never
selected. For a new version of a pack, episodes of the previous version are selected before all others.
"""

import zlib
from abc import ABC, abstractmethod
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

from vigil.authoring.drafting.drafts import Draft, DraftsFile, TaskDraft
from vigil.authoring.packing.balance import stratum_of
from vigil.authoring.packing.requests import PackRequest
from vigil.authoring.review.reviews import Review, apply_reviews, decisions
from vigil.authoring.review.validate import Finding
from vigil.errors import EpisodeError
from vigil.packs.pack import CHORES_SUITE
from vigil.protocol.episode import Episode
from vigil.protocol.families import FAMILIES
from vigil.protocol.goals import OTHER_LABEL
from vigil.scoring.chore_answers import ListAnswer
from vigil.scoring.closure import SUITE, ClosureAnswer
from vigil.scoring.levels import EpisodeLevel, Level

FOUND_BY_TURNING = 0.4
"""Maximum share of searches (VS, SI) in which the target can be found by turning at the start."""
UPPER_LEVELS: tuple[Level, ...] = ("hard", "extreme")
CLEAR_PX = 400
"""A target counts as clear if the first frame that shows it has more than this number of its pixels."""


@dataclass(frozen=True, slots=True)
class Candidate:
    """A task from a drafts file that may be selected."""

    task: TaskDraft
    """The task after the reviews were applied to it."""
    reviewer_kinds: tuple[frozenset[str], ...] = ()
    """For each side, the kinds of the reviewers who judged it."""
    is_reworded: bool = False
    """Whether a reviewer changed the instruction."""
    is_from_previous: bool = False
    """Whether the task was in the previous version of the pack."""
    level: Level | None = None
    """Level of difficulty; None if the level was not measured."""
    target_px: int = 0
    """Visible pixels of the target in the first frame that shows it; 0 if the level was not measured."""

    @property
    def draft(self) -> Draft:
        """The draft of the task's first side."""
        return self.task.drafts[0]

    @property
    def episode(self) -> Episode:
        """The episode of the task's first side, after the reviews were applied."""
        return self.draft.episode

    @property
    def stratum(self) -> str:
        """The stratum of the episode within its family."""
        return stratum_of(self.episode, self.draft.facts)

    @property
    def is_approved(self) -> bool:
        """Whether a reviewer approved a side of the task, and no reviewer rejected a side."""
        return any(draft.episode.provenance.reviewed == "approved" for draft in self.task.drafts)

    @property
    def is_clear(self) -> bool:
        """Whether the level is hard or extreme, but the start shows a large target. Other candidates are preferred."""
        is_upper = self.level in UPPER_LEVELS and FAMILIES[self.episode.family].visible_at_start
        return is_upper and self.target_px > CLEAR_PX


CandidateCheck = Callable[[Sequence[Candidate]], dict[str, list[Finding]]]
"""Function that replays candidates. For those with findings, it returns id of the first side -> findings."""


@dataclass(frozen=True, slots=True)
class Missing:
    """A group for which the drafts have fewer episodes or tasks than the pack needs."""

    group: str
    """The family; in a suite, the kind."""
    found: int
    asked: int
    offered: int
    """Number of drafts of this group."""
    level: Level | None = None
    """Level of difficulty of the episodes; None if levels do not matter."""

    def __str__(self) -> str:
        name = " ".join(filter(None, (self.group, self.level)))
        return f"{name} {self.found} of {self.asked} (of {self.offered} drafts)"


class TooFewDrafts(EpisodeError):
    """Error for drafts from which the requested pack cannot be selected."""

    def __init__(self, message: str, missing: Sequence[Missing]) -> None:
        super().__init__(message)
        self.missing = tuple(missing)


def candidates(
    files: Iterable[DraftsFile],
    reviews: Sequence[Review],
    previous: DraftsFile | None = None,
    levels: Mapping[str, EpisodeLevel] | None = None,
) -> list[Candidate]:
    """Return all tasks, each id once, sorted by id, except tasks with a side that a reviewer rejected.

    `previous` is the one of `files` that has the drafts of the pack's previous version. `levels` has the measured
    levels of difficulty by id. Raises EpisodeError if two different drafts have the same id, SettingError if a file is
    invalid.
    """
    by_id: dict[str, list[Review]] = defaultdict(list)
    for review in reviews:
        by_id[review.episode_id].append(review)
    found: dict[str, TaskDraft] = {}
    for file in files:
        for task in file.read().tasks:
            name = task.drafts[0].episode.id
            if [d.episode for d in found.setdefault(name, task).drafts] != [d.episode for d in task.drafts]:
                raise EpisodeError(f"Two different drafts have the id {name!r}; leave out one file.")
    old = {draft.episode.id for draft in previous.read().drafts} if previous else set()
    judged = [_judged(task, by_id) for _, task in sorted(found.items())]
    return [_with_facts(each, old, levels or {}) for each in judged if each is not None]


def _judged(task: TaskDraft, reviews: Mapping[str, Sequence[Review]]) -> Candidate | None:
    """Return a task with its reviews (by episode id) applied; None if one of its sides is rejected.

    If one side gets a new instruction, both sides get it.
    """
    own = [reviews.get(draft.episode.id, ()) for draft in task.drafts]
    episodes = [apply_reviews(draft.episode, mine) for draft, mine in zip(task.drafts, own, strict=True)]
    if any(episode.provenance.reviewed == "rejected" for episode in episodes):
        return None
    before = task.drafts[0].episode.instruction
    instruction = next((each.instruction for each in episodes[::-1] if each.instruction != before), before)
    drafts = [
        draft.model_copy(update={"episode": episode.model_copy(update={"instruction": instruction})})
        for draft, episode in zip(task.drafts, episodes, strict=True)
    ]
    kinds = tuple(kinds_of_reviewers(draft.episode, mine) for draft, mine in zip(task.drafts, own, strict=True))
    judged = drafts[0] if isinstance(task, Draft) else task.model_copy(update={"drafts": tuple(drafts)})
    return Candidate(judged, kinds, is_reworded=instruction != before)


def kinds_of_reviewers(episode: Episode, reviews: Sequence[Review]) -> frozenset[str]:
    """Return the kinds (person, model) of the reviewers who approved or rejected this version of an episode."""
    judged = {name for name, decision in decisions(episode, reviews).items() if decision.judgement}
    return frozenset(review.reviewer_kind for review in reviews if review.reviewer in judged)


def _with_facts(candidate: Candidate, old: set[str], levels: Mapping[str, EpisodeLevel]) -> Candidate:
    known = replace(candidate, is_from_previous=candidate.episode.id in old)
    found = levels.get(candidate.episode.id)
    return known if found is None else replace(known, level=found.level, target_px=found.measures.target_px)


class Balance(ABC):
    """Counts of the tasks chosen so far. They determine which task is chosen next."""

    def __init__(self, pool: Sequence[Candidate], request: PackRequest) -> None:
        del pool
        self._request = request
        self._uses: Counter[tuple[str, ...]] = Counter()
        """Family or kind ("" for the whole pack), feature and its value -> number of chosen tasks."""

    def add(self, candidate: Candidate) -> None:
        """Add a chosen candidate to the counts."""
        self._uses.update(self._keys(candidate))

    def takes(self, candidate: Candidate) -> bool:
        """Return whether the pack's limits still allow this candidate."""
        return self._uses[candidate.task.group, "house", candidate.episode.house.name] < self._request.max_per_house

    @abstractmethod
    def cost(self, candidate: Candidate) -> tuple:
        """Return the sort key of a candidate. The candidate with the smallest key is chosen next."""

    @abstractmethod
    def _keys(self, candidate: Candidate) -> list[tuple[str, ...]]:
        """Return the keys under which a candidate is counted."""


class FamilyBalance(Balance):
    """Balance of a pack of families, over levels, strata, labels, categories and houses."""

    def __init__(self, pool: Sequence[Candidate], request: PackRequest) -> None:
        super().__init__(pool, request)
        strata: dict[str, set[str]] = {family: set() for family in request.families}
        for candidate in pool:
            strata.setdefault(candidate.task.group, set()).add(candidate.stratum)
        self._even_share = {family: request.per_family // max(len(found), 1) for family, found in strata.items()}
        """Family -> number of episodes that each of its strata has if all have the same number."""

    def _keys(self, candidate: Candidate) -> list[tuple[str, ...]]:
        episode, facts = candidate.episode, candidate.draft.facts
        common = [("category", facts.category), ("house", episode.house.name)]
        keys = [("stratum", candidate.stratum), ("label", facts.category, facts.label or "")]
        keys += [("turn", str(facts.is_seen_by_turning)), ("level", candidate.level or "")]
        keys += [("thing", episode.house.name, episode.goal.object_id)]
        whole = [*common, ("rooms", str(facts.rooms))]
        return [*((episode.family, *key) for key in (*common, *keys)), *(("", *key) for key in whole)]

    def takes(self, candidate: Candidate) -> bool:
        """Return whether the pack's limits still allow this candidate."""
        family, level, quotas = candidate.episode.family, candidate.level, self._request.level_quotas
        if quotas and (level is None or self._uses[family, "level", level] >= quotas.get(level, 0)):
            return False
        is_search = not FAMILIES[family].visible_at_start and candidate.draft.facts.is_seen_by_turning
        most_turned = int(FOUND_BY_TURNING * self._request.per_family)
        return super().takes(candidate) and (not is_search or self._uses[family, "turn", "True"] < most_turned)

    def cost(self, candidate: Candidate) -> tuple:
        """Return the sort key of a candidate. The candidate with the smallest key is chosen next."""
        episode, facts, family, used = candidate.episode, candidate.draft.facts, candidate.episode.family, self._uses
        opposite = OTHER_LABEL.get(facts.label or "", "")
        lead = used[family, "label", facts.category, facts.label or ""]
        turned, walked = (used[family, "turn", value] for value in ("True", "False"))
        is_ahead = not FAMILIES[family].visible_at_start and turned >= FOUND_BY_TURNING * (turned + walked + 1)
        return (
            is_ahead and facts.is_seen_by_turning,  # limits that would otherwise be missed come first
            0 if candidate.level is None else used[family, "level", candidate.level],
            used[family, "stratum", candidate.stratum] >= self._even_share[family],
            lead - used[family, "label", facts.category, opposite] if opposite else 0,
            candidate.is_clear,
            used[family, "stratum", candidate.stratum],
            candidate.stratum,
            not candidate.is_from_previous,
            not candidate.is_approved,
            used[family, "thing", episode.house.name, episode.goal.object_id],  # then variety
            used[family, "category", facts.category],
            used[family, "house", episode.house.name],
            used["", "category", facts.category],
            used["", "house", episode.house.name],
            used["", "rooms", str(facts.rooms)],
            *_by_chance(candidate, self._request.seed),
        )


class SuiteBalance(Balance):
    """Balance of a pack of a suite: within each kind, over reasons and forms, acts, categories and houses."""

    def cost(self, candidate: Candidate) -> tuple:
        """Return the sort key of a candidate. The candidate with the smallest key is chosen next."""
        form, *variety = (self._uses[key] for key in self._keys(candidate))
        return (form, not candidate.is_approved, *variety, *_by_chance(candidate, self._request.seed))

    def _keys(self, candidate: Candidate) -> list[tuple[str, ...]]:
        episode, kind = candidate.episode, candidate.task.group
        answers = [answer for answer in candidate.task.answers if isinstance(answer, ClosureAnswer)]
        return [
            (kind, "form", answers[-1].reason or answers[0].form),
            (kind, "thing", f"{episode.house.name} {episode.goal.object_id}"),
            (kind, "what", f"{answers[-1].reason} {episode.provenance.template}"),
            (kind, "category", candidate.draft.facts.category),
            (kind, "house", episode.house.name),
        ]


class ListBalance(Balance):
    """Balance of a pack of lists of chores: the kinds and forms of their chores, houses and rooms."""

    def cost(self, candidate: Candidate) -> tuple:
        """Return the sort key of a candidate. The candidate with the smallest key is chosen next."""
        kinds = _chore_kinds(candidate)
        return (
            not candidate.is_approved,
            sum(self._uses["", "chore", kind] for kind in kinds) / len(kinds),
            self._uses["", "house", candidate.episode.house.name],
            *_by_chance(candidate, self._request.seed),
        )

    def _keys(self, candidate: Candidate) -> list[tuple[str, ...]]:
        house = candidate.episode.house.name
        chores = [("", "chore", kind) for kind in _chore_kinds(candidate)]
        return [(candidate.task.group, "house", house), ("", "house", house), *chores]


def _chore_kinds(candidate: Candidate) -> list[str]:
    """Return the kind of each chore of a list; for a chore that cannot be met, the reason instead."""
    chores = [chore for answer in candidate.task.answers if isinstance(answer, ListAnswer) for chore in answer.chores]
    return [chore.reason or chore.kind for chore in chores]


def _by_chance(candidate: Candidate, seed: int) -> tuple[int, str]:
    return zlib.crc32(f"{seed} {candidate.episode.id}".encode()), candidate.episode.id


def select(pool: Sequence[Candidate], request: PackRequest) -> list[Candidate]:
    """Return exactly the requested number of candidates of each family or kind, in the order in which they were chosen.

    Raises TooFewDrafts if there are too few candidates.
    """
    balance = {None: FamilyBalance, SUITE: SuiteBalance, CHORES_SUITE: ListBalance}[request.suite](pool, request)
    chosen: list[Candidate] = []
    missing: list[Missing] = []
    for group, quota in request.quotas.items():
        left = own = [candidate for candidate in pool if candidate.task.group == group]
        mine: list[Candidate] = []
        while len(mine) < quota and (left := [each for each in left if balance.takes(each)]):
            mine.append(min(left, key=balance.cost))
            balance.add(mine[-1])
            left.remove(mine[-1])
        chosen += mine
        missing += _missing(group, own, mine, request)
    if missing:
        raise TooFewDrafts(
            f"Pack {request.name!r} asks for more episodes than can be chosen from the drafts within the pack's "
            f"limits. The drafts have only {', '.join(map(str, missing))}. Propose in more houses (more seeds, a "
            "larger --count), or ask for fewer episodes.",
            missing,
        )
    return chosen


def _missing(
    group: str, pool: Sequence[Candidate], chosen: Sequence[Candidate], request: PackRequest
) -> Iterable[Missing]:
    """Yield what is missing of a family (by level if the request has levels) or of a kind."""
    parts = request.level_quotas or {None: request.quotas[group]}
    for level, quota in parts.items():
        found, offered = (sum(level in (None, each.level) for each in some) for some in (chosen, pool))
        if found < quota:
            yield Missing(group, found, quota, offered, level)


def select_valid(
    pool: Sequence[Candidate], request: PackRequest, check: CandidateCheck
) -> tuple[list[Candidate], dict[str, list[Finding]], int]:
    """Return three values: a selection without findings, the findings of the rejected candidates by id, and the number
    of checked candidates.

    Raises TooFewDrafts if there are too few candidates.
    """
    left, bad, valid = list(pool), dict[str, list[Finding]](), set[str]()
    while True:
        chosen = select(left, request)
        unchecked = [candidate for candidate in chosen if candidate.episode.id not in valid]
        found = check(unchecked) if unchecked else {}
        if not found:
            return chosen, bad, len(valid | {each.episode.id for each in unchecked}) + len(bad)
        bad |= found
        valid |= {candidate.episode.id for candidate in unchecked} - found.keys()
        left = [candidate for candidate in left if candidate.episode.id not in bad]
