"""Packs of the suite: selection of tasks from drafts, freezing, and the expected score of guessing.

Source: `protocol.md` section 8, decision 30.
"""

import zlib
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import vigil
from vigil.authoring.drafting.drafts import ClosureDraft, Draft, DraftsContent, DraftsFile, house_in
from vigil.authoring.packing.assemble import FACTS, seed_facts
from vigil.authoring.packing.dataset_card import write_card
from vigil.authoring.review.reviews import Review, apply_reviews, decisions
from vigil.authoring.review.validate import Finding
from vigil.errors import EpisodeError
from vigil.housegen.document import generators_of
from vigil.packs.freeze import check_can_freeze, freeze
from vigil.packs.pack import ANSWERS, Pack
from vigil.protocol.actions import Status
from vigil.protocol.episode import Solution
from vigil.protocol.house import canonical_json
from vigil.scoring.closure import KINDS, PAIRED, SUITE, ClosureAnswer, Kind, check_pairs

BLIND: dict[str, tuple[Status | None, ...]] = {
    "nothing": (None,),
    "always_success": ("success",),
    "always_fail": ("fail",),
    "always_invalid": ("invalid",),
    "coin": ("success", "fail"),
}
"""Name of an agent that reports without looking -> the statuses from which it draws; None means no report."""


@dataclass(frozen=True, slots=True)
class ClosureRequest:
    """Settings of a pack of the suite."""

    name: str
    per_kind: int
    """Number of tasks of a kind that `quotas` does not list; kinds that come as twins are counted in pairs."""
    seed: int = 0
    """Seed that breaks ties."""
    max_per_house: int = 3
    """Greatest number of tasks of a kind in one house."""
    kinds: tuple[Kind, ...] = KINDS
    quotas: Mapping[Kind, int] = field(default_factory=dict)
    """Kind -> number of tasks, if it differs from `per_kind`."""
    version: str = "1"
    description: str = ""
    aliases: tuple[str, ...] = ()
    is_seed_secret: bool = False
    asset_database_sha256: str | None = None
    """Hash of the asset database from which things get their sizes; None if they have typical sizes."""

    def asked(self, kind: Kind) -> int:
        """Return the requested number of tasks of a kind."""
        return self.quotas.get(kind, self.per_kind)


TaskCheck = Callable[[ClosureDraft], list[Finding]]
"""A function that certifies a task again and returns its findings."""


def reviewed_tasks(
    pool: Sequence[ClosureDraft], reviews: Sequence[Review], check: TaskCheck
) -> tuple[list[ClosureDraft], list[Finding]]:
    """Return the tasks with the reviews applied, and the findings about reworded tasks.

    A task is left out if a side is rejected or its new wording has findings. A new wording of one side applies to both.
    """
    by_id: dict[str, list[Review]] = {}
    for review in reviews:
        by_id.setdefault(review.episode_id, []).append(review)
    kept: list[ClosureDraft] = []
    bad: list[Finding] = []
    for task in pool:
        mine = [review for draft in task.drafts for review in by_id.get(draft.episode.id, [])]
        judged = _with_reviews(task, mine) if mine else task
        found = check(judged) if judged is not None and _instruction_of(judged) != _instruction_of(task) else []
        bad += found
        if judged is not None and not found:
            kept.append(judged)
    return kept, bad


def _with_reviews(task: ClosureDraft, reviews: Sequence[Review]) -> ClosureDraft | None:
    """Return a task with the reviews applied; None if one of its sides is rejected."""
    episodes = [apply_reviews(draft.episode, reviews) for draft in task.drafts]
    if any(episode.provenance.reviewed == "rejected" for episode in episodes):
        return None
    reworded = [now.instruction for now, draft in zip(episodes, task.drafts, strict=True)
                if now.instruction != draft.episode.instruction]  # fmt: skip
    if reworded:
        episodes = [episode.model_copy(update={"instruction": reworded[-1]}) for episode in episodes]
    drafts = [draft.model_copy(update={"episode": now}) for draft, now in zip(task.drafts, episodes, strict=True)]
    return task.model_copy(update={"drafts": tuple(drafts)})


def _instruction_of(task: ClosureDraft) -> str:
    return task.drafts[0].episode.instruction


def select_tasks(pool: Sequence[ClosureDraft], request: ClosureRequest) -> list[ClosureDraft]:
    """Return exactly the requested number of tasks of each kind, balanced over reasons, acts, categories and houses.

    Raises EpisodeError if there are too few.
    """
    chosen: list[ClosureDraft] = []
    short: list[str] = []
    for kind in request.kinds:
        left = {task.drafts[0].episode.id: task for task in pool if task.kind == kind}
        offered, uses = len(left), Counter[tuple[str, str]]()
        for number in range(request.asked(kind)):
            free = [task for task in left.values() if uses["house", _house_name(task)] < request.max_per_house]
            if not free:
                short.append(f"{kind} {number} of {request.asked(kind)} (of {offered} drafts)")
                break
            best = min(free, key=lambda task: _cost(task, uses, request.seed))
            del left[best.drafts[0].episode.id]
            uses.update(_balance_keys(best))
            chosen.append(best)
    if short:
        raise EpisodeError(
            f"Pack {request.name!r} asks for more tasks than the drafts hold: {', '.join(short)}. Propose in more "
            "houses (more seeds, a larger --count), or ask for fewer."
        )
    return chosen


def _balance_keys(task: ClosureDraft) -> list[tuple[str, str]]:
    draft = task.drafts[0]
    return [
        ("form", task.answers[-1].reason or task.answers[0].form),
        ("thing", f"{_house_name(task)} {draft.episode.goal.object_id}"),
        ("what", f"{task.answers[-1].reason} {draft.episode.provenance.template}"),
        ("category", draft.facts.category),
        ("house", _house_name(task)),
    ]


def _house_name(task: ClosureDraft) -> str:
    return task.drafts[0].episode.house.name


def _cost(task: ClosureDraft, uses: Counter[tuple[str, str]], seed: int) -> tuple:
    name = task.drafts[0].episode.id
    is_approved = any(draft.episode.provenance.reviewed == "approved" for draft in task.drafts)
    used = [uses[key] for key in _balance_keys(task)]
    return (used[0], not is_approved, *used[1:], zlib.crc32(f"{seed} {name}".encode()), name)


def freeze_closure(
    out: Path,
    files: Sequence[DraftsFile],
    request: ClosureRequest,
    reviews: Sequence[Review] = (),
    check: TaskCheck = lambda task: [],
) -> tuple[Pack, list[Finding]]:
    """Freeze a pack of the suite into `out`, and return it with the findings about reworded tasks that were left out.

    Raises EpisodeError if there are too few drafts, SettingError if a drafts file is invalid, the folder is not empty
    or the name is invalid.
    """
    check_can_freeze(out, request.name)
    for file in files:
        file.check_assets(request.asset_database_sha256)
    read = [file.read() for file in files]
    offered = [task for proposed in read for task in proposed.closures]
    pool, bad = reviewed_tasks(offered, reviews, check)
    chosen = select_tasks(pool, request)
    drafts = [draft for task in chosen for draft in task.drafts]
    answers = sorted((each for task in chosen for each in task.answers), key=lambda each: each.episode_id)
    check_pairs(answers)
    names = sorted({draft.episode.house.name for draft in drafts})
    houses = [house_in(files, name) for name in names]
    facts = [{"episode_id": d.episode.id, **d.facts.model_dump(mode="json")} for d in drafts]
    meta: dict[str, Any] = {
        "suite": SUITE,
        "aliases": list(request.aliases),
        "blind": guessing(answers),
        "house_generator": generators_of(houses),
        **_house_facts(read, names, request),
        "kinds": kind_counts(answers),
        "reviews": _review_counts(chosen, offered, reviews),
        **seed_facts(request.name, request.seed, [each.header for each in read], is_seed_secret=request.is_seed_secret),
        "simulator": sorted({proposed.header.simulator for proposed in read}),
        "vigil": vigil.__version__,
    }
    pack = freeze(
        out,
        [draft.episode for draft in drafts],
        [solution_of(draft) for draft in drafts],
        houses,
        name=request.name,
        version=request.version,
        description=request.description or "Closure stress: reaching is easy, knowing is hard; the measure is C.",
        meta=meta,
        extra={ANSWERS: _rows(each.model_dump(mode="json") for each in answers), FACTS: _rows(facts)},
    )
    write_card(pack)
    return pack, bad


def _review_counts(
    chosen: Sequence[ClosureDraft], offered: Sequence[ClosureDraft], reviews: Sequence[Review]
) -> dict[str, int]:
    """Return the numbers of chosen episodes judged by a person, by models only and by nobody, and of rejected ones.

    The twins of rejected episodes count as rejected.
    """
    versions = {draft.episode.id: draft.episode for task in offered for draft in task.drafts}
    kinds: dict[str, set[str]] = {}
    rejected: set[str] = set()
    for name, episode in versions.items():
        mine = [review for review in reviews if review.episode_id == name]
        judged = {who for who, decision in decisions(episode, mine).items() if decision.judgement}
        kinds[name] = {review.reviewer_kind for review in mine if review.reviewer in judged}
        if apply_reviews(episode, mine).provenance.reviewed == "rejected":
            rejected.add(name)
    of = [kinds[draft.episode.id] for task in chosen for draft in task.drafts]
    left_out = [task for task in offered if any(draft.episode.id in rejected for draft in task.drafts)]
    return {
        "person": sum("person" in each for each in of),
        "model": sum(each == {"model"} for each in of),
        "none": sum(not each for each in of),
        "rejected": sum(len(task.drafts) for task in left_out),
    }


def _house_facts(read: Sequence[DraftsContent], names: Sequence[str], request: ClosureRequest) -> dict[str, Any]:
    """Return the manifest's entries about houses that were not generated and about an asset database, if any."""
    origins = {origin.name: origin for proposed in read for origin in proposed.origins}
    sources = {
        name: origins[name].model_dump(exclude={"line", "name"}, exclude_none=True) for name in names if name in origins
    }
    facts = {"asset_database_sha256": request.asset_database_sha256, "house_sources": sources}
    return {name: fact for name, fact in facts.items() if fact}


def solution_of(draft: Draft) -> Solution:
    """Return a draft's recorded solution."""
    return Solution(episode_id=draft.episode.id, actions=draft.actions)


def kind_counts(answers: Sequence[ClosureAnswer]) -> dict[str, int]:
    """Return the number of episodes of each kind, side and reason, which are joined by spaces; sorted."""
    names = [" ".join(filter(None, (each.kind, each.side, each.reason))) for each in answers]
    return dict(sorted(Counter(names).items()))


def guessing(answers: Sequence[ClosureAnswer]) -> dict[str, dict[str, float]]:
    """Return agent without sight -> its expected C (%) and share of correct pairs (%) by kind.

    These agents never act, so that a goal holds at the end exactly if it holds at the reset.
    """
    kinds = [kind for kind in KINDS if any(each.kind == kind for each in answers)]
    return {
        name: {
            **{f"C {kind}": _mean([_chance(each, drawn) for each in answers if each.kind == kind]) for kind in kinds},
            **{f"pairs {kind}": _mean(_pair_chances(answers, kind, drawn)) for kind in kinds if kind in PAIRED},
        }
        for name, drawn in BLIND.items()
    }


def _pair_chances(answers: Sequence[ClosureAnswer], kind: Kind, drawn: tuple[Status | None, ...]) -> list[float]:
    pairs: dict[str, float] = {}
    for each in answers:
        if each.kind == kind and each.pair is not None:
            pairs[each.pair] = pairs.get(each.pair, 1.0) * _chance(each, drawn)
    return list(pairs.values())


def _chance(answer: ClosureAnswer, drawn: tuple[Status | None, ...]) -> float:
    """Return the probability that a status drawn from some, reported at once, closes an episode correctly."""
    if answer.is_impossible:
        right: tuple[Status, ...] = answer.accepted
    else:
        right = ("success",) if answer.side == "already" else ()
    return sum(status in right for status in drawn) / len(drawn)


def _mean(chances: Sequence[float]) -> float:
    return round(100 * sum(chances) / len(chances), 1)


def _rows(rows: Iterable[dict[str, Any]]) -> bytes:
    return b"".join(canonical_json(row) + b"\n" for row in rows)
