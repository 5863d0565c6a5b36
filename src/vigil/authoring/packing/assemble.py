"""Assembly of a pack: the selected tasks are checked, then frozen with their houses, facts and card."""

import hashlib
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import vigil
from vigil.authoring.drafting.drafts import DraftsContent, DraftsFile, Header, house_in
from vigil.authoring.packing.balance import count_strata, text_guess
from vigil.authoring.packing.dataset_card import write_card
from vigil.authoring.packing.requests import PackRequest
from vigil.authoring.packing.selection import Candidate, CandidateCheck, candidates, select_valid
from vigil.authoring.packing.suites import SUITES
from vigil.authoring.review.reviews import Review, apply_reviews
from vigil.authoring.review.validate import Finding
from vigil.errors import EpisodeError
from vigil.housegen.document import generators_of
from vigil.packs.freeze import check_can_freeze, dump_rows, freeze
from vigil.packs.pack import CHORES_SUITE, Pack
from vigil.packs.private import SEED_SHA256, is_secret, seed_sha256
from vigil.scoring.levels import LEVELS_FILE, EpisodeLevel, dump_levels

FACTS = "facts.jsonl"
"""File with the facts over which a pack is balanced."""


def assemble(
    out: Path,
    files: Sequence[DraftsFile],
    reviews: Sequence[Review],
    request: PackRequest,
    check: CandidateCheck,
    *,
    previous: DraftsFile | None = None,
    levels: Mapping[str, EpisodeLevel] | None = None,
) -> tuple[Pack, dict[str, list[Finding]]]:
    """Freeze a pack into `out`. Return the pack, and the findings about candidates that were left out, by id.

    `previous` is one of `files`; its episodes are selected first. `levels` has the drafts' difficulty levels by id;
    they are required if the request sets levels, and the pack stores those of its episodes. Raises TooFewDrafts if
    there are fewer drafts than requested, and EpisodeError if levels are missing. Raises SettingError if a drafts file
    is invalid, the folder is not empty or the name is invalid.
    """
    check_can_freeze(out, request.name)
    for file in files:
        file.check_assets(request.asset_database_sha256)
    found = candidates(files, reviews, previous, levels)
    pool = [each for each in found if request.admits(each.task.drafts[0].episode.family, each.task.kind)]
    _check_levels(pool, request)
    chosen, bad, tried = select_valid(pool, request, check)
    read = [file.read() for file in files]
    meta, extra = _common_facts(chosen, read, request), dict[str, bytes]()
    if request.suite:
        facts, extra = SUITES[request.suite].contents(answer for each in chosen for answer in each.task.answers)
        meta |= {**facts, "reviews": {**meta["reviews"], "rejected": _count_rejected(read, reviews)}}
        if request.suite == CHORES_SUITE:
            meta |= {"rejected": rejected_by_rule(read, request, bad, tried)}
    else:
        chosen.sort(key=lambda candidate: candidate.episode.id)
        meta |= _family_facts(chosen, read, request)
    if request.is_robust:
        meta |= {"is_robust": True, "rejected": rejected_by_rule(read, request, bad, tried)}
    if levels is not None:
        extra[LEVELS_FILE] = dump_levels(levels[candidate.episode.id] for candidate in chosen)
    drafts = [draft for candidate in chosen for draft in candidate.task.drafts]
    houses = [house_in(files, name) for name in sorted({draft.episode.house.name for draft in drafts})]
    rows = [
        {"episode_id": draft.episode.id, **draft.facts.model_dump(mode="json"), **_requested_facts(candidate, request)}
        for candidate in chosen
        for draft in candidate.task.drafts
    ]
    pack = freeze(
        out,
        [draft.episode for draft in drafts],
        [draft.solution for draft in drafts],
        houses,
        name=request.name,
        version=request.version,
        description=request.description or (SUITES[request.suite].description if request.suite else ""),
        meta=meta | {"house_generator": generators_of(houses)},
        extra={FACTS: dump_rows(rows), **extra},
    )
    write_card(pack)
    return pack, bad


def _check_levels(pool: Sequence[Candidate], request: PackRequest) -> None:
    """Raise EpisodeError if the request has levels, and some drafts of the requested families do not have one."""
    own = [candidate for candidate in pool if candidate.task.group in request.quotas]
    without = [candidate.episode.id for candidate in own if candidate.level is None]
    if request.levels and without:
        raise EpisodeError(
            f"Pack {request.name!r} asks for levels of difficulty, but {len(without)} of its {len(own)} drafts do "
            f"not have a level (e.g. {without[0]!r}). Measure all drafts first, as `vigil pack build --level` "
            "does."
        )


def _requested_facts(candidate: Candidate, request: PackRequest) -> dict[str, Any]:
    """Return those facts about an episode that are stored only because of options of the request."""
    level = {"level": candidate.level} if request.levels else {}
    return {**level, **({"is_robust": True} if request.is_robust else {})}


def _common_facts(chosen: Sequence[Candidate], read: Sequence[DraftsContent], request: PackRequest) -> dict[str, Any]:
    """Return the manifest's entries that every pack has, except the entry about the generators of its houses."""
    headers = [proposed.header for proposed in read]
    origins = {origin.name: origin for proposed in read for origin in proposed.origins}
    names = sorted({candidate.episode.house.name for candidate in chosen} & origins.keys())
    sources = {name: origins[name].model_dump(exclude={"line", "name"}, exclude_none=True) for name in names}
    found = {"asset_database_sha256": request.asset_database_sha256, "house_sources": sources}
    return {
        **{name: fact for name, fact in found.items() if fact},
        "aliases": list(request.aliases),
        "reviews": review_counts(chosen),
        **seed_facts(request.name, request.seed, headers, is_seed_secret=request.is_seed_secret),
        "simulator": sorted({header.simulator for header in headers}),
        "vigil": vigil.__version__,
    }


def _family_facts(chosen: Sequence[Candidate], read: Sequence[DraftsContent], request: PackRequest) -> dict[str, Any]:
    """Return the manifest's entries that only packs of families have."""
    members = [(candidate.episode, candidate.draft.facts) for candidate in chosen]
    headers = [proposed.header for proposed in read]
    offered = sorted({draft.episode.id for proposed in read for draft in proposed.drafts})
    steps = {
        family: [len(each.draft.actions) for each in chosen if each.task.group == family] for family in request.families
    }
    counts = Counter((candidate.task.group, candidate.level) for candidate in chosen)
    levels = {family: {level: counts[family, level] for level in request.levels} for family in request.families}
    return {
        "authors": sorted({header.author for header in headers}),
        **({"levels": levels} if request.levels else {}),
        "forms": sorted({header.forms for header in headers}),
        "drafts": {"count": len(offered), "sha256": hashlib.sha256("\n".join(offered).encode()).hexdigest()},
        "solution_steps": {
            family: {"mean": round(sum(found) / len(found), 2), "max": max(found)} for family, found in steps.items()
        },
        "strata": count_strata(members),
        "text_guess_sv": text_guess(members),
    }


def _count_rejected(read: Sequence[DraftsContent], reviews: Sequence[Review]) -> int:
    """Return the number of drafts that a reviewer rejected. If one twin is rejected, both twins count."""
    named = {review.episode_id for review in reviews}
    tasks = [task for each in read for task in each.tasks if any(draft.episode.id in named for draft in task.drafts)]
    judged = [{apply_reviews(draft.episode, reviews).provenance.reviewed for draft in task.drafts} for task in tasks]
    return sum(len(task.drafts) for task, found in zip(tasks, judged, strict=True) if "rejected" in found)


def review_counts(chosen: Sequence[Candidate]) -> dict[str, int]:
    """Return how many episodes were reviewed by a person, how many only by models, and how many by nobody."""
    judged = [
        "person" if "person" in kinds else "model" if kinds else "none"
        for candidate in chosen
        for kinds in candidate.reviewer_kinds
    ]
    return {kind: judged.count(kind) for kind in ("person", "model", "none")}


def rejected_by_rule(
    read: Sequence[DraftsContent], request: PackRequest, bad: Mapping[str, Sequence[Finding]], tried: int
) -> dict[str, Any]:
    """Return how many proposals and how many candidates were tried and rejected, and how many broke each rule.

    `bad` has the findings about rejected candidates by id; `tried` is the number of candidates that were checked. A
    proposal counts only under the first rule that it breaks, a candidate under each rule that it breaks.
    """
    rejections = [each for proposed in read for each in proposed.rejections if each.family in request.families]
    held = sum(draft.episode.family in request.families for proposed in read for draft in proposed.drafts)
    proposals = Counter(each.rule for each in rejections)
    candidate_rules = Counter(rule for findings in bad.values() for rule in {finding.rule for finding in findings})
    return {
        "proposals": {
            "tried": held + len(rejections),
            "rejected": len(rejections),
            "by_rule": dict(sorted(proposals.items())),
        },
        "candidates": {"tried": tried, "rejected": len(bad), "by_rule": dict(sorted(candidate_rules.items()))},
    }


def seed_facts(name: str, seed: int, headers: Iterable[Header], *, is_seed_secret: bool) -> dict[str, Any]:
    """Return the manifest's entry about a pack's seed: the seed itself, or only a hash if a seed is secret.

    If seeds of the drafts are secret, these are hashed; otherwise the pack's own secret seed is hashed.
    """
    secret = {each.seed for each in headers if each.is_seed_secret or (is_seed_secret and is_secret(each.seed))}
    if is_seed_secret and not secret:
        secret = {seed}
    return {SEED_SHA256: seed_sha256(name, *secret)} if secret else {"seed": seed}
