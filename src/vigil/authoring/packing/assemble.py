"""Assembly of a pack from drafts and reviews: a deterministic selection, balanced over the pack's strata.

Within a kind, episodes that a reviewer approved are selected before unreviewed ones; rejected ones are never selected.
For a new version of a pack, episodes of the previous version are selected before all others.
"""

import hashlib
import zlib
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import vigil
from vigil.authoring.drafting.drafts import Draft, DraftsFile, Header, HouseOrigin, house_in
from vigil.authoring.language.sentences import Forms
from vigil.authoring.packing.balance import count_strata, stratum_of, text_guess
from vigil.authoring.packing.dataset_card import write_card
from vigil.authoring.packing.rejections import rejected_by_rule
from vigil.authoring.review.reviews import Review, apply_reviews, decisions
from vigil.authoring.review.validate import Finding
from vigil.errors import EpisodeError
from vigil.housegen.document import generators_of
from vigil.packs.freeze import check_can_freeze, freeze
from vigil.packs.pack import Pack
from vigil.packs.private import SEED_SHA256, is_secret, seed_sha256
from vigil.protocol.episode import Episode, Solution
from vigil.protocol.families import FAMILIES, Family
from vigil.protocol.house import canonical_json
from vigil.scoring.levels import LEVELS_FILE, EpisodeLevel, Level, dump_levels

MAX_PER_HOUSE = 3
"""Greatest number of episodes of one family in one house."""
PER_FAMILY = 125
FOUND_BY_TURNING = 0.4
"""Greatest share of searches (VS, SI) whose target can be found by turning at the start."""
FACTS = "facts.jsonl"
"""File with the facts over which a pack is balanced."""
UPPER_LEVELS: tuple[Level, ...] = ("hard", "extreme")
CLEAR_PX = 400
"""Visible pixels of a target at first sight above which it counts as clear."""


@dataclass(frozen=True, slots=True)
class Candidate:
    """A draft with the reviews applied."""

    draft: Draft
    episode: Episode
    """The draft's episode with the reviews applied."""
    reviewer_kinds: tuple[str, ...] = ()
    """Kinds of the reviewers who judged it, sorted."""
    is_from_previous: bool = False
    """Whether it comes from the previous version of the pack."""
    level: Level | None = None
    """Level of difficulty; None if it was not measured."""
    target_px: int = 0
    """Visible pixels of the target at first sight; 0 if the level was not measured."""

    @property
    def stratum(self) -> str:
        """The stratum of the episode within its family."""
        return stratum_of(self.episode, self.draft.facts)

    @property
    def is_approved(self) -> bool:
        """Whether a reviewer approved it and none rejected it."""
        return self.episode.provenance.reviewed == "approved"

    @property
    def is_clear(self) -> bool:
        """Whether its level is an upper one although its target is clearly in view at the start."""
        is_upper = self.level in UPPER_LEVELS and FAMILIES[self.episode.family].visible_at_start
        return is_upper and self.target_px > CLEAR_PX

    @property
    def solution(self) -> Solution:
        """The recorded solution."""
        return Solution(episode_id=self.episode.id, actions=self.draft.actions)


@dataclass(frozen=True, slots=True)
class PackRequest:
    """Settings of a pack to assemble."""

    name: str
    per_family: int = PER_FAMILY
    seed: int = 0
    """Seed that breaks ties."""
    max_per_house: int = MAX_PER_HOUSE
    """Greatest number of episodes of one family in one house."""
    version: str = "1"
    description: str = ""
    aliases: tuple[str, ...] = ()
    families: tuple[Family, ...] = tuple(FAMILIES)
    is_seed_secret: bool = False
    """Whether the pack reveals only the hash of its seed."""
    asset_database_sha256: str | None = None
    """Hash of the asset database from which things get their sizes; None if they have typical sizes."""
    levels: tuple[Level, ...] = ()
    """Levels of difficulty over which each family is divided evenly; empty if levels do not matter."""
    is_robust: bool = False
    """Whether episodes must also satisfy the robustness rules; the check of candidates must then include them."""
    forms: Forms = "public"
    """Half of the sentence forms from which new drafts are made, or all."""

    @property
    def quotas(self) -> dict[Level, int]:
        """Level -> number of episodes of each family; a remainder goes to the first levels."""
        each, left = divmod(self.per_family, max(len(self.levels), 1))
        return {level: each + (place < left) for place, level in enumerate(self.levels)}


CandidateCheck = Callable[[Sequence[Candidate]], dict[str, list[Finding]]]
"""A function that replays candidates and returns episode id -> findings, for those that have findings."""


def candidates(
    files: Iterable[DraftsFile],
    reviews: Sequence[Review],
    previous: DraftsFile | None = None,
    levels: Mapping[str, EpisodeLevel] | None = None,
) -> list[Candidate]:
    """Return all drafts that no reviewer rejects, each id once, sorted by id.

    `previous` is that of `files` with the drafts of the previous version; `levels` are the drafts' levels by id, if
    measured. Raises EpisodeError if two different drafts have one id, SettingError if a file is invalid.
    """
    by_id: dict[str, list[Review]] = defaultdict(list)
    for review in reviews:
        by_id[review.episode_id].append(review)
    found: dict[str, Draft] = {}
    for file in files:
        for draft in file.read().drafts:
            if found.setdefault(draft.episode.id, draft).episode != draft.episode:
                raise EpisodeError(f"Two different drafts have the id {draft.episode.id!r}; leave out one file.")
    old = {draft.episode.id for draft in previous.read().drafts} if previous else set()
    wanted = [_candidate(draft, by_id[name], is_from_previous=name in old) for name, draft in sorted(found.items())]
    return [
        _with_level(candidate, (levels or {}).get(candidate.episode.id))
        for candidate in wanted
        if candidate.episode.provenance.reviewed != "rejected"
    ]


def _with_level(candidate: Candidate, found: EpisodeLevel | None) -> Candidate:
    if found is None:
        return candidate
    return replace(candidate, level=found.level, target_px=found.measures.target_px)


def _candidate(draft: Draft, reviews: Sequence[Review], *, is_from_previous: bool) -> Candidate:
    judged = {name for name, decision in decisions(draft.episode, reviews).items() if decision.judgement}
    kinds = {review.reviewer_kind for review in reviews if review.reviewer in judged}
    return Candidate(draft, apply_reviews(draft.episode, reviews), tuple(sorted(kinds)), is_from_previous)


@dataclass(slots=True)
class _SelectionCounts:
    """The candidates chosen so far, with counts over all families."""

    chosen: list[Candidate] = field(default_factory=list)
    categories: Counter[str] = field(default_factory=Counter)
    houses: Counter[str] = field(default_factory=Counter)
    rooms: Counter[int] = field(default_factory=Counter)
    of_family: Counter[tuple[str, ...]] = field(default_factory=Counter)
    even_share: int = 0
    """Equal share of episodes for each stratum of the family that is being chosen."""

    def add(self, candidate: Candidate) -> None:
        episode, facts = candidate.episode, candidate.draft.facts
        self.chosen.append(candidate)
        self.categories[facts.category] += 1
        self.houses[episode.house.name] += 1
        self.rooms[facts.rooms] += 1
        keys = [("stratum", candidate.stratum), ("category", facts.category), ("house", episode.house.name)]
        keys += [("turn", str(facts.is_seen_by_turning)), ("label", facts.category, facts.label or "")]
        keys += [("thing", episode.house.name, episode.goal.object_id), ("level", candidate.level or "")]
        self.of_family.update((episode.family, *key) for key in keys)

    def takes(self, candidate: Candidate, pack_request: PackRequest) -> bool:
        """Return whether the pack's limits allow a candidate."""
        episode, family = candidate.episode, candidate.episode.family
        if self.of_family[family, "house", episode.house.name] >= pack_request.max_per_house:
            return False
        level, quotas = candidate.level, pack_request.quotas
        if quotas and (level is None or self.of_family[family, "level", level] >= quotas.get(level, 0)):
            return False
        turned = self.of_family[family, "turn", "True"]
        is_search = not FAMILIES[family].visible_at_start and candidate.draft.facts.is_seen_by_turning
        return not is_search or turned < int(FOUND_BY_TURNING * pack_request.per_family)

    def cost(self, candidate: Candidate, seed: int) -> tuple:
        """Return the sort key of a candidate; the smallest is chosen first."""
        episode, facts, family = candidate.episode, candidate.draft.facts, candidate.episode.family
        opposite = {"on": "off", "off": "on", "open": "closed", "closed": "open"}.get(facts.label or "", "")
        lead = self.of_family[family, "label", facts.category, facts.label or ""]
        turned, walked = (self.of_family[family, "turn", value] for value in ("True", "False"))
        is_ahead = not FAMILIES[family].visible_at_start and turned >= FOUND_BY_TURNING * (turned + walked + 1)
        return (
            is_ahead and facts.is_seen_by_turning,  # limits that would otherwise be missed come first
            0 if candidate.level is None else self.of_family[family, "level", candidate.level],
            self.of_family[family, "stratum", candidate.stratum] >= self.even_share,
            lead - self.of_family[family, "label", facts.category, opposite] if opposite else 0,
            candidate.is_clear,
            self.of_family[family, "stratum", candidate.stratum],
            candidate.stratum,
            not candidate.is_from_previous,
            not candidate.is_approved,
            self.of_family[family, "thing", episode.house.name, episode.goal.object_id],  # then variety
            self.of_family[family, "category", facts.category],
            self.of_family[family, "house", episode.house.name],
            self.categories[facts.category],
            self.houses[episode.house.name],
            self.rooms[facts.rooms],
            zlib.crc32(f"{seed} {episode.id}".encode()),  # then chance
            episode.id,
        )


def select(pool: Sequence[Candidate], pack_request: PackRequest) -> list[Candidate]:
    """Return exactly the requested number of candidates of each family, sorted by id.

    Raises EpisodeError if there are too few.
    """
    tally = _SelectionCounts()
    short: list[str] = []
    for family in pack_request.families:
        left = [candidate for candidate in pool if candidate.episode.family == family]
        offered = len(left)
        kinds = len({candidate.stratum for candidate in left})
        tally.even_share = pack_request.per_family // max(kinds, 1)
        for number in range(pack_request.per_family):
            left = [candidate for candidate in left if tally.takes(candidate, pack_request)]
            if not left:
                short += _missing(tally, family, pack_request, pool) or [f"{family} {number} (of {offered} drafts)"]
                break
            best = min(left, key=lambda candidate: tally.cost(candidate, pack_request.seed))
            tally.add(best)
            left.remove(best)
    if short:
        raise EpisodeError(
            f"Pack {pack_request.name!r} asks for {pack_request.per_family} episodes of each family; within its limits "
            f"the drafts hold only {', '.join(short)}. Propose in more houses (more seeds, a larger --count), or ask "
            "for fewer."
        )
    return sorted(tally.chosen, key=lambda candidate: candidate.episode.id)


def _missing(
    tally: _SelectionCounts, family: Family, pack_request: PackRequest, pool: Sequence[Candidate]
) -> list[str]:
    """Return texts about the levels of a family that cannot be filled; empty if levels do not matter."""
    offered = Counter(candidate.level for candidate in pool if candidate.episode.family == family)
    chosen = {level: tally.of_family[family, "level", level] for level in pack_request.levels}
    return [
        f"{family} {level} {chosen[level]} of {quota} (of {offered[level]} drafts)"
        for level, quota in pack_request.quotas.items()
        if chosen[level] < quota
    ]


def select_valid(
    pool: Sequence[Candidate], pack_request: PackRequest, check: CandidateCheck
) -> tuple[list[Candidate], dict[str, list[Finding]]]:
    """Return a selection of candidates without findings, and the findings of those that were left out, by id.

    Raises EpisodeError if there are too few candidates.
    """
    left, bad = list(pool), dict[str, list[Finding]]()
    valid: set[str] = set()
    while True:
        chosen = select(left, pack_request)
        unchecked = [candidate for candidate in chosen if candidate.episode.id not in valid]
        found = check(unchecked) if unchecked else {}
        if not found:
            return chosen, bad
        bad |= found
        valid |= {candidate.episode.id for candidate in unchecked} - found.keys()
        left = [candidate for candidate in left if candidate.episode.id not in bad]


def assemble(
    out: Path,
    files: Sequence[DraftsFile],
    reviews: Sequence[Review],
    pack_request: PackRequest,
    check: CandidateCheck,
    *,
    previous: DraftsFile | None = None,
    levels: Mapping[str, EpisodeLevel] | None = None,
) -> tuple[Pack, dict[str, list[Finding]]]:
    """Freeze a pack into `out`, and return it with the findings of candidates that were left out, by id.

    Episodes of `previous`, one of `files`, are selected first. `levels` are the drafts' levels by id, which a request
    for levels needs; the pack then stores those of its episodes. Raises EpisodeError if there are too few drafts or
    levels are missing, SettingError if a drafts file is invalid, the folder is not empty or the name is invalid.
    """
    check_can_freeze(out, pack_request.name)
    for file in files:
        file.check_assets(pack_request.asset_database_sha256)
    pool = candidates(files, reviews, previous, levels)
    _check_levels(pool, pack_request)
    tried: list[str] = []

    def check_counted(fresh: Sequence[Candidate]) -> dict[str, list[Finding]]:
        tried.extend(candidate.episode.id for candidate in fresh)
        return check(fresh)

    chosen, bad = select_valid(pool, pack_request, check_counted)
    houses = [house_in(files, name) for name in sorted({candidate.episode.house.name for candidate in chosen})]
    meta = _meta(chosen, files, pack_request) | {"house_generator": generators_of(houses)}
    if pack_request.is_robust:
        meta["rejected"] = rejected_by_rule([file.read() for file in files], pack_request.families, bad, len(tried))
    facts = [
        {"episode_id": c.episode.id, **c.draft.facts.model_dump(mode="json"), **_requested_facts(c, pack_request)}
        for c in chosen
    ]
    extra = {FACTS: b"".join(canonical_json(row) + b"\n" for row in facts)}
    if levels is not None:
        extra[LEVELS_FILE] = dump_levels(levels[candidate.episode.id] for candidate in chosen)
    pack = freeze(
        out,
        [candidate.episode for candidate in chosen],
        [candidate.solution for candidate in chosen],
        houses,
        name=pack_request.name,
        version=pack_request.version,
        description=pack_request.description,
        meta=meta,
        extra=extra,
    )
    write_card(pack)
    return pack, bad


def _check_levels(pool: Sequence[Candidate], pack_request: PackRequest) -> None:
    """Raise EpisodeError if a pack asks for levels and some drafts of its families do not have one."""
    own = [candidate for candidate in pool if candidate.episode.family in pack_request.families]
    without = [candidate.episode.id for candidate in own if candidate.level is None]
    if pack_request.levels and without:
        raise EpisodeError(
            f"Pack {pack_request.name!r} asks for levels of difficulty, but {len(without)} of its {len(own)} drafts "
            f"do not have one (e.g. {without[0]!r}): measure them all first, as `vigil pack build --level` does."
        )


def _requested_facts(candidate: Candidate, pack_request: PackRequest) -> dict[str, Any]:
    """Return the additional facts about an episode that the pack asked for."""
    level = {"level": candidate.level} if pack_request.levels else {}
    return {**level, **({"is_robust": True} if pack_request.is_robust else {})}


def review_counts(chosen: Sequence[Candidate]) -> dict[str, int]:
    """Return the numbers of episodes judged by a person, by models only, and by nobody."""
    kinds = ["person" if "person" in c.reviewer_kinds else "model" if c.reviewer_kinds else "none" for c in chosen]
    return {kind: kinds.count(kind) for kind in ("person", "model", "none")}


def _meta(chosen: Sequence[Candidate], files: Sequence[DraftsFile], pack_request: PackRequest) -> dict[str, Any]:
    members = [(candidate.episode, candidate.draft.facts) for candidate in chosen]
    read = [file.read() for file in files]
    headers = [proposed.header for proposed in read]
    offered = sorted({draft.episode.id for proposed in read for draft in proposed.drafts})
    origins = {origin.name: origin for proposed in read for origin in proposed.origins}
    return {
        **_house_facts(chosen, origins, pack_request),
        "aliases": list(pack_request.aliases),
        "authors": sorted({header.author for header in headers}),
        **_level_facts(chosen, pack_request),
        "forms": sorted({header.forms for header in headers}),
        "drafts": {"count": len(offered), "sha256": hashlib.sha256("\n".join(offered).encode()).hexdigest()},
        "reviews": review_counts(chosen),
        **seed_facts(pack_request.name, pack_request.seed, headers, is_seed_secret=pack_request.is_seed_secret),
        **({"is_robust": True} if pack_request.is_robust else {}),
        "simulator": sorted({header.simulator for header in headers}),
        "solution_steps": {
            family: {"mean": round(sum(steps) / len(steps), 2), "max": max(steps)}
            for family in pack_request.families
            if (steps := [len(c.draft.actions) for c in chosen if c.episode.family == family])
        },
        "strata": count_strata(members),
        "text_guess_sv": text_guess(members),
        "vigil": vigil.__version__,
    }


def _house_facts(
    chosen: Sequence[Candidate], origins: Mapping[str, HouseOrigin], pack_request: PackRequest
) -> dict[str, Any]:
    """Return the manifest's entries about houses that were not generated and about an asset database, if any."""
    names = sorted({candidate.episode.house.name for candidate in chosen} & origins.keys())
    sources = {name: origins[name].model_dump(exclude={"line", "name"}, exclude_none=True) for name in names}
    facts = {"asset_database_sha256": pack_request.asset_database_sha256, "house_sources": sources}
    return {name: fact for name, fact in facts.items() if fact}


def _level_facts(chosen: Sequence[Candidate], pack_request: PackRequest) -> dict[str, Any]:
    """Return the manifest's entry with the number of episodes of each family and level; empty without levels."""
    counts = Counter((candidate.episode.family, candidate.level) for candidate in chosen)
    levels = {
        family: {level: counts[family, level] for level in pack_request.levels} for family in pack_request.families
    }
    return {"levels": levels} if pack_request.levels else {}


def seed_facts(name: str, seed: int, headers: Iterable[Header], *, is_seed_secret: bool) -> dict[str, Any]:
    """Return the manifest's entry about a pack's seed: the seed itself, or only a hash if a seed is secret.

    The hash is that of the drafts' secret seeds, or of the seed that breaks ties if only that is secret.
    """
    secret = {each.seed for each in headers if each.is_seed_secret or (is_seed_secret and is_secret(each.seed))}
    if is_seed_secret and not secret:
        secret = {seed}
    return {SEED_SHA256: seed_sha256(name, *secret)} if secret else {"seed": seed}
