"""The check of candidates for a pack: each is replayed, and tried by a body that errs where a pack is to be robust.

Only what a selection wants is checked, house by house in worker processes. The tries of a body that errs take a second
or more an episode, so what came of them is kept beside the drafts: the same candidate is not tried twice.
"""

from collections.abc import Callable, Sequence
from pathlib import Path

from vigil.authoring.drafting.drafts import DraftsFile
from vigil.authoring.packing.assemble import Candidate, CandidateCheck
from vigil.authoring.packing.verify import OnVerified, VerificationSettings, findings_of
from vigil.authoring.review.validate import Finding
from vigil.protocol.episode import Episode
from vigil.protocol.house import House


def check_log_of(file: DraftsFile) -> Path:
    """Return the log of what robustness checks found about drafts; whoever removes it has them checked anew."""
    return file.path.with_name(f"{file.path.stem}.checks.jsonl")


def candidate_checker(
    files: Sequence[DraftsFile], settings: VerificationSettings, on_verified: OnVerified = lambda standing: None
) -> CandidateCheck:
    """Return the function that checks candidates out of some drafts files, and gives back what does not hold.

    Where robustness is checked, it raises RecordError when the log beside the first file cannot be read or written.
    """
    house_of = house_finder(files)
    log = check_log_of(files[0]) if settings.is_robust else None

    def check(chosen: Sequence[Candidate]) -> dict[str, list[Finding]]:
        episodes = [candidate.episode for candidate in chosen]
        solved = {candidate.episode.id: candidate.draft.actions for candidate in chosen}
        results = findings_of(episodes, solved, house_of, settings, log, on_verified)
        return {result.episode_id: result.faults for result in results if result.findings}

    return check


def house_finder(files: Sequence[DraftsFile]) -> Callable[[Episode], House]:
    """Return the function that finds an episode's house beside one of some drafts files."""

    def house_of(episode: Episode) -> House:
        name = episode.house.name
        return next((file for file in files if (file.houses / f"{name}.json").is_file()), files[0]).house(name)

    return house_of
