"""Packs of the suite: from drafts to a frozen pack, evenly over kinds and what is in them; and what guessing achieves.

Source: `protocol.md` section 8, decision 30.
"""

import zlib
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import vigil
from vigil.actions import Status
from vigil.authoring.drafting.drafts import ClosureDraft, Draft, DraftsFile
from vigil.authoring.packing.assemble import FACTS, seed_sha256
from vigil.authoring.packing.dataset_card import write_card
from vigil.closure import ANSWERS, KINDS, PAIRED, SUITE, ClosureAnswer, Kind, check_pairs
from vigil.episode import Solution
from vigil.errors import EpisodeError
from vigil.freezing import check_free, freeze
from vigil.house import canonical_json
from vigil.housegen.document import generators_of
from vigil.pack import Pack

BLIND: dict[str, tuple[Status | None, ...]] = {
    "nothing": (None,),
    "always_success": ("success",),
    "always_fail": ("fail",),
    "always_invalid": ("invalid",),
    "coin": ("success", "fail"),
}
"""Agents that report without looking: the statuses that each draws from, None for no report."""


@dataclass(frozen=True, slots=True)
class ClosureRequest:
    """Which pack of the suite to freeze."""

    name: str
    per_kind: int
    """Tasks of each kind: pairs, of kinds that come as twins."""
    seed: int = 0
    """Breaks ties."""
    house_uses: int = 3
    """Tasks of a kind in a house, at most."""
    kinds: tuple[Kind, ...] = KINDS
    version: str = "1"
    description: str = ""
    aliases: tuple[str, ...] = ()
    is_seed_secret: bool = False


def select_tasks(pool: Sequence[ClosureDraft], request: ClosureRequest) -> list[ClosureDraft]:
    """Returns exactly so many tasks of each kind, evenly over reasons, acts, categories and houses.

    Raises EpisodeError when there are too few.
    """
    chosen: list[ClosureDraft] = []
    short: list[str] = []
    for kind in request.kinds:
        left = {task.drafts[0].episode.id: task for task in pool if task.kind == kind}
        offered, uses = len(left), Counter[tuple[str, str]]()
        for number in range(request.per_kind):
            free = [task for task in left.values() if uses["house", _house(task)] < request.house_uses]
            if not free:
                short.append(f"{kind} {number} (of {offered} drafts)")
                break
            best = min(free, key=lambda task: _cost(task, uses, request.seed))
            del left[best.drafts[0].episode.id]
            uses.update(_keys(best))
            chosen.append(best)
    if short:
        raise EpisodeError(
            f"Pack {request.name!r} asks for {request.per_kind} tasks of each kind; the drafts hold only "
            f"{', '.join(short)}. Propose in more houses (more seeds, a larger --count), or ask for fewer."
        )
    return chosen


def _keys(task: ClosureDraft) -> list[tuple[str, str]]:
    draft = task.drafts[0]
    return [
        ("what", f"{task.answers[-1].reason} {draft.episode.provenance.template}"),
        ("category", draft.facts.category),
        ("house", _house(task)),
    ]


def _house(task: ClosureDraft) -> str:
    return task.drafts[0].episode.house.name


def _cost(task: ClosureDraft, uses: Counter[tuple[str, str]], seed: int) -> tuple:
    name = task.drafts[0].episode.id
    return (*(uses[key] for key in _keys(task)), zlib.crc32(f"{seed} {name}".encode()), name)


def freeze_closure(out: Path, files: Sequence[DraftsFile], request: ClosureRequest) -> Pack:
    """Freezes a pack of the suite into `out`.

    Raises EpisodeError when the drafts are too few, SettingError when the folder is not empty or the name unfit.
    """
    check_free(out, request.name)
    read = [file.read() for file in files]
    chosen = select_tasks([task for proposed in read for task in proposed.closures], request)
    drafts = [draft for task in chosen for draft in task.drafts]
    answers = sorted((each for task in chosen for each in task.answers), key=lambda each: each.episode_id)
    check_pairs(answers)
    names = sorted({draft.episode.house.name for draft in drafts})
    houses = [next(file for file in files if (file.houses / f"{name}.json").is_file()).house(name) for name in names]
    facts = [{"episode_id": d.episode.id, **d.facts.model_dump(mode="json")} for d in drafts]
    meta: dict[str, Any] = {
        "suite": SUITE,
        "aliases": list(request.aliases),
        "blind": guessing(answers),
        "house_generator": generators_of(houses),
        "kinds": kind_counts(answers),
        "seed_sha256" if request.is_seed_secret else "seed": (
            seed_sha256(request.name, request.seed) if request.is_seed_secret else request.seed
        ),
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
    return pack


def solution_of(draft: Draft) -> Solution:
    """Returns a draft's recorded solution: what closes its episode rightly."""
    return Solution(episode_id=draft.episode.id, actions=draft.actions)


def kind_counts(answers: Sequence[ClosureAnswer]) -> dict[str, int]:
    """Returns how many episodes there are of each kind, side and reason."""
    names = [" ".join(filter(None, (each.kind, each.side, each.reason))) for each in answers]
    return dict(sorted(Counter(names).items()))


def guessing(answers: Sequence[ClosureAnswer]) -> dict[str, dict[str, float]]:
    """Returns C and the share of pairs (%) that agents without sight come to, in expectation, by kind.

    They act on nothing, so that a goal holds at the end just where it holds at the reset.
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
    """Returns how likely one of some statuses, reported at once, closes an episode rightly."""
    if answer.is_impossible:
        right: tuple[Status, ...] = answer.accepted
    else:
        right = ("success",) if answer.side == "already" else ()
    return sum(status in right for status in drawn) / len(drawn)


def _mean(chances: Sequence[float]) -> float:
    return round(100 * sum(chances) / len(chances), 1)


def _rows(rows: Iterable[dict[str, Any]]) -> bytes:
    return b"".join(canonical_json(row) + b"\n" for row in rows)
