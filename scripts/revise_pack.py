"""Takes a frozen pack's episodes up again as drafts, for a new version of the pack under changed rules.

    python scripts/revise_pack.py OLD_PACK_FOLDER --out kept.jsonl --workers 2
    vigil pack build --earlier-drafts kept.jsonl --drafts fresh.jsonl ...

Every episode is validated again by all current rules, with its recorded solution where that still holds, otherwise with
a new one. An episode that no longer holds is listed with the rule that it breaks. A goal that does not say whether
inside is meant (packs from before rules version 2) gets the meaning of the instruction.
"""

import argparse
import json
import time
from collections import Counter, defaultdict
from concurrent.futures import ProcessPoolExecutor
from functools import cache
from multiprocessing import get_context
from pathlib import Path

from vigil.assets.database import AssetDatabase
from vigil.authoring.drafting.drafts import (
    Draft,
    DraftFacts,
    DraftLine,
    DraftsFile,
    FamilyDone,
    Header,
    Rejection,
    draft_id,
)
from vigil.authoring.drafting.generation import PER_HOUSE, TRIED
from vigil.authoring.drafting.house_context import AUTHOR
from vigil.authoring.language.wording import asks_inside
from vigil.authoring.packing.assemble import FACTS
from vigil.authoring.review.validate import Validator
from vigil.cli.progress import progress
from vigil.packs.pack import Pack
from vigil.protocol.episode import Episode
from vigil.protocol.families import FAMILIES
from vigil.protocol.goals import ObjectAtReceptacle
from vigil.protocol.house import House
from vigil.sim import make_simulator


def main() -> None:
    """Revise the pack that is named on the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("pack", type=Path, help="folder of the frozen pack")
    parser.add_argument("--out", type=Path, required=True, help="drafts file; the same command continues it")
    parser.add_argument("--workers", type=int, default=1)
    wanted = parser.parse_args()
    pack, file = Pack.load(wanted.pack), DraftsFile(wanted.out)
    by_house: dict[str, list[Episode]] = defaultdict(list)
    for episode in pack.episodes:
        by_house[episode.house.name].append(episode)
    with (
        file.writing(_header(pack)) as writer,
        ProcessPoolExecutor(wanted.workers, get_context("spawn")) as pool,
    ):
        done = {name for name, _ in writer.done}
        names = [name for name in sorted(by_house) if name not in done]
        work = [pool.submit(revised, wanted.pack, by_house[name]) for name in names]
        with progress("houses") as show:
            for number, found in enumerate(work, start=1):
                house, lines = found.result()
                writer.add(house, lines)
                show(number, len(names))
    read = file.read()
    print(f"{len(read.drafts)} of {len(pack.episodes)} episodes hold")
    for rejection in read.rejections:
        print(f"{rejection.family} {rejection.house}: {rejection.rule}: {rejection.message} ({rejection.instruction})")


def _header(pack: Pack) -> Header:
    return Header(author=AUTHOR, seed=pack.manifest.meta["seed"], simulator="mujoco", per_house=PER_HOUSE, tried=TRIED)


@cache
def _validator() -> Validator:
    return Validator(make_simulator("mujoco", assets=AssetDatabase.default()))


@cache
def _pack(folder: Path) -> tuple[Pack, dict[str, DraftFacts]]:
    rows = [json.loads(line) for line in (folder / FACTS).read_text(encoding="utf-8").splitlines()]
    return Pack.load(folder), {row.pop("episode_id"): DraftFacts.model_validate(row) for row in rows}


def revised(folder: Path, episodes: list[Episode]) -> tuple[House, list[DraftLine]]:
    """Return a house and what becomes of its episodes."""
    pack, facts = _pack(folder)
    house = pack.house_of(episodes[0])
    lines: list[DraftLine] = []
    for family in FAMILIES:
        begun = time.monotonic()
        found = [_line(pack, house, episode, facts[episode.id]) for episode in episodes if episode.family == family]
        rules = Counter(line.rule for line in found if isinstance(line, Rejection))
        kept = sum(isinstance(line, Draft) for line in found)
        seconds = round(time.monotonic() - begun, 2)
        lines += [*found, FamilyDone(family=family, house=house.name, kept=kept, rejected=dict(rules), seconds=seconds)]
    return house, lines


def _line(pack: Pack, house: House, old: Episode, facts: DraftFacts) -> Draft | Rejection:
    """Return an episode as a draft, or the rule that it breaks today."""
    episode, kind = _saying_inside(old, facts, house), old.provenance.template or old.target_size or ""
    verdict = _validator().validate(episode, house, pack.solutions[old.id].actions)
    if not verdict.is_valid:
        verdict = _validator().validate(episode, house)
    if not verdict.is_valid:
        fault = verdict.findings[0]
        return Rejection(
            family=episode.family,
            kind=kind,
            house=house.name,
            rule=fault.rule,
            message=fault.message,
            instruction=episode.instruction,
        )
    provenance = episode.provenance.model_copy(update={"reviewed": None, "solution_steps": len(verdict.actions)})
    episode = episode.model_copy(update={"provenance": provenance})
    return Draft(kind=kind, episode=episode, actions=verdict.actions, facts=facts)


def _saying_inside(episode: Episode, facts: DraftFacts, house: House) -> Episode:
    """Return an episode whose goal means inside where its instruction does, under an id of its own if that is new."""
    goal = episode.goal
    if not isinstance(goal, ObjectAtReceptacle) or goal.inside == asks_inside(episode.instruction):
        return episode
    changed = episode.model_copy(update={"goal": goal.model_copy(update={"inside": not goal.inside})})
    return changed.model_copy(update={"id": draft_id(changed, facts.category, house)})


if __name__ == "__main__":
    main()
