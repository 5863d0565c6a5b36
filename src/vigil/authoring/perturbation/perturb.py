"""Perturbation of a pack: every episode with other words, another start near by, or other light, and certified again.

A perturbed episode has the id of its original, so that runs on both packs can be compared episode by episode. Twins
change together. An episode that cannot be perturbed is left out, and counted under the reason.

A file next to the new folder holds the houses that are finished, so the same command continues after an interruption.
It is removed when the pack is written.
"""

import hashlib
import zlib
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import BaseModel, ConfigDict

import vigil
from vigil.authoring.closure.twins import BrokenRule
from vigil.authoring.language.referring import items_as_seen, without_repeats
from vigil.authoring.packing.dataset_card import write_card
from vigil.authoring.packing.suites import SUITES
from vigil.authoring.packing.verify import (
    HouseBatch,
    VerificationSettings,
    VerificationTask,
    Verifier,
    house_batches,
    key_of,
    pack_tasks,
)
from vigil.authoring.perturbation.places import near_starts, relit
from vigil.authoring.perturbation.wording import other_instructions
from vigil.authoring.review.wording_rules import worded_badly
from vigil.base.json_lines import AppendFile, dump_line, parse_line
from vigil.base.processes.group import map_in_workers
from vigil.errors import EpisodeError, SettingError
from vigil.packs.files import Change, Perturbation
from vigil.packs.freeze import check_can_freeze, freeze
from vigil.packs.pack import Pack
from vigil.packs.private import SEED_SHA256
from vigil.protocol.episode import Episode, HouseRef, Solution
from vigil.protocol.house import House, canonical_json

MAX_TRIED = 12
"""Maximum number of changes of one task that are tried. The first change that passes the certification is used."""
NO_OTHER: Mapping[Change, str] = {"wording": "no_other_form", "start": "no_near_start", "light": "no_lamp"}
"""Kind of change -> reason that is given for an episode for which there was nothing to try."""
_COPIED = ("seed", SEED_SHA256, "asset_database_sha256", "house_sources")
"""Keys of the original pack's manifest whose values also hold for the perturbed pack."""


@dataclass(frozen=True, slots=True)
class PerturbationSettings:
    """Settings of the perturbation of a pack."""

    change: Change
    seed: int
    suite: str | None
    checks: VerificationSettings

    def rng(self, name: str) -> np.random.Generator:
        """Return the random numbers for one house or task."""
        return np.random.default_rng([self.seed, zlib.crc32(f"{self.change} {name}".encode())])

    def key(self, batch: HouseBatch) -> str:
        """Return the hash of all on which the result for a house depends."""
        tasks = [key_of(task, self.checks) for task in batch.tasks]
        facts = [self.change, self.seed, self.suite, batch.name, batch.document, *tasks]
        return hashlib.sha256(canonical_json(facts)).hexdigest()


class PerturbedHouse(BaseModel):
    """A house with its perturbed tasks; a line of the file of finished houses."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    key: str
    """Key of the original house and its tasks (`PerturbationSettings.key`)."""
    name: str
    document: dict[str, Any]
    """Document of the house, with other light if the change is light."""
    tasks: tuple[VerificationTask, ...]
    left_out: tuple[str, ...]
    """For each episode that could not be perturbed, the rule that its last change broke, or a value of `NO_OTHER`."""


class Perturber:
    """Changes tasks and certifies them again, on its own simulator."""

    def __init__(self, settings: PerturbationSettings) -> None:
        self._settings = settings
        self._verifier = Verifier(settings.checks)

    def work(self, batch: HouseBatch) -> PerturbedHouse:
        """Return a house with its perturbed tasks. If the change is light, the house has other light."""
        house = House(batch.name, batch.document)
        other = relit(house, self._settings.rng(batch.name)) if self._settings.change == "light" else house
        tasks, left_out = list[VerificationTask](), list[str]()
        for task in batch.tasks:
            made = NO_OTHER["light"] if other is None else self._perturbed(task, other)
            if isinstance(made, str):
                left_out += [made] * len(task.episodes)
            else:
                tasks.append(made)
        return PerturbedHouse(
            key=self._settings.key(batch),
            name=batch.name,
            document=(other or house).data,
            tasks=tuple(tasks),
            left_out=tuple(left_out),
        )

    def _perturbed(self, task: VerificationTask, house: House) -> VerificationTask | str:
        """Return a perturbed task, or the reason why there is none."""
        try:
            reason = NO_OTHER[self._settings.change]
            for changed in islice(self._changed(task, house), MAX_TRIED):
                done, broken = self._certified(changed, house)
                if broken is None:
                    return done
                reason = broken
        except BrokenRule as broken:
            reason = broken.rule
        return reason

    def _certified(self, task: VerificationTask, house: House) -> tuple[VerificationTask, str | None]:
        """Return a task with its solutions, and the first rule that it breaks; None if it breaks no rule."""
        if self._settings.change == "start":
            task, findings = self._verifier.solve(task, house)
            if findings:
                return task, findings[0].rule
        faults = self._verifier.faults(task, house)
        return task, faults[0].rule if faults else None

    def _changed(self, task: VerificationTask, house: House) -> list[VerificationTask]:
        """Return the task with each change that may be tried. Raises BrokenRule if the original is not valid."""
        first, rng = task.episodes[0], self._settings.rng(task.episodes[0].id)
        match self._settings.change:
            case "light":
                return [_with(task, house=HouseRef(name=house.name, sha256=house.sha256))]
            case "start":
                view = self._verifier.begin(first, house).view
                return [_with(task, start=pose) for pose in islice(near_starts(view, first.start, rng), MAX_TRIED)]
            case "wording":
                texts = other_instructions(first.instruction, first.family, self._settings.suite, rng)
                return [_with(task, instruction=text) for text in self._well_worded(first, house, texts)]

    def _well_worded(self, episode: Episode, house: House, texts: Iterator[str]) -> list[str]:
        """Return the instructions in `texts` that obey every rule about wording that the original obeys."""
        start = self._verifier.begin(episode, house)
        names = [item.name for item in items_as_seen(start.view.scene).values()]
        broken = {rule for rule, _ in worded_badly(start)}
        said = dict.fromkeys(without_repeats(text, names) for text in texts)
        begun = {text: replace(start, episode=episode.model_copy(update={"instruction": text})) for text in said}
        return [text for text, each in begun.items() if {rule for rule, _ in worded_badly(each)} <= broken]


def perturb_pack(
    pack: Pack,
    out: Path,
    name: str,
    settings: PerturbationSettings,
    on_progress: Callable[[int, int], None] = lambda done, of: None,
) -> Pack:
    """Freeze a perturbed pack into `out` and return it.

    Raises SettingError if the folder is not empty, the pack is itself perturbed or the file of finished houses is
    invalid, RecordError if this file cannot be written, EpisodeError if no episode is left.
    """
    check_can_freeze(out, name)
    if pack.manifest.perturbation is not None:
        raise SettingError(
            f"Pack {pack.name!r} is itself a perturbation of {pack.manifest.perturbation.of!r}. Give the original."
        )
    log = out.with_name(f"{out.name}.perturb.jsonl")
    found = _perturbed_houses(log, house_batches(pack_tasks(pack), pack.house_of), settings, on_progress)
    left_out = dict(sorted(Counter(reason for each in found for reason in each.left_out).items()))
    if not any(each.tasks for each in found):
        reasons = ", ".join(f"{reason} {count}" for reason, count in left_out.items())
        raise EpisodeError(f"Pack {pack.name!r}: no episode could be perturbed ({reasons}).")
    perturbation = Perturbation(
        of=pack.name, sha256=pack.sha256, change=settings.change, seed=settings.seed, left_out=left_out
    )
    made = _freeze(pack, out, name, found, perturbation, settings)
    log.unlink()
    return made


def _perturbed_houses(
    log: Path,
    batches: Sequence[HouseBatch],
    settings: PerturbationSettings,
    on_progress: Callable[[int, int], None],
) -> list[PerturbedHouse]:
    """Return the perturbed houses: those in the file `log`, then the others, each of which is added to the file."""
    log.parent.mkdir(parents=True, exist_ok=True)
    with AppendFile(log) as file:
        missing = {settings.key(batch): batch for batch in batches}
        rows = (
            parse_line(line, PerturbedHouse, str(log), "Remove the file; it is made again.", SettingError)
            for line in file.lines.complete
        )
        found = [row for row in rows if missing.pop(row.key, None) is not None]
        make, workers = partial(Perturber, settings), settings.checks.workers
        for row in map_in_workers(make, Perturber.work, tuple(missing.values()), workers):
            file.append(dump_line(row))
            found.append(row)
            on_progress(len(found), len(batches))
    return found


def _freeze(
    pack: Pack,
    out: Path,
    name: str,
    found: Sequence[PerturbedHouse],
    perturbation: Perturbation,
    settings: PerturbationSettings,
) -> Pack:
    tasks = [task for each in found for task in each.tasks]
    answers = [each for task in tasks for each in task.answers or ()]
    suite = next((each for each in SUITES.values() if each.name == pack.manifest.suite), None)
    suite_facts, extra = ({}, {}) if suite is None else suite.contents(answers)
    meta: dict[str, Any] = {key: pack.manifest.meta[key] for key in _COPIED if key in pack.manifest.meta}
    if settings.change == "light":
        meta.pop("house_sources", None)  # these have the hashes of the houses in their original light
    meta |= {
        "simulator": [settings.checks.backend],
        "vigil": vigil.__version__,
        **({"is_robust": True} if settings.checks.is_robust else {}),
    }
    meta |= {"perturbation": perturbation.model_dump(), **suite_facts}
    members = [
        (_unreviewed(episode, len(actions or ())), Solution(episode_id=episode.id, actions=actions or ()))
        for task in tasks
        for episode, actions in zip(task.episodes, task.solutions, strict=True)
    ]
    frozen = freeze(
        out,
        [episode for episode, _ in members],
        [solution for _, solution in members],
        [House(each.name, each.document) for each in found],
        name=name,
        version=pack.manifest.version,
        description=f"{pack.name} with {WORDS[perturbation.change]} (seed {perturbation.seed}).",
        meta=meta,
        extra=extra,
    )
    write_card(frozen)
    return frozen


WORDS: Mapping[Change, str] = {
    "wording": "every instruction in another sentence form",
    "start": "every start moved by at most one metre",
    "light": "other light in every house",
}
"""Kind of change -> what has changed in the perturbed pack, in words."""


def _with(task: VerificationTask, **facts: Any) -> VerificationTask:
    return replace(task, episodes=tuple(each.model_copy(update=facts) for each in task.episodes))


def _unreviewed(episode: Episode, steps: int) -> Episode:
    provenance = episode.provenance.model_copy(update={"reviewed": None, "solution_steps": steps})
    return episode.model_copy(update={"provenance": provenance})
