"""Check of candidates for a pack: each is replayed and, for a robust pack, played with a noisy body.

Only selected candidates are checked, house by house in worker processes. Trials with a noisy body take a second or more
per episode, so their results are stored next to the drafts and no candidate is tried twice.
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
    """Return the log of robustness results for drafts; removing it makes the next run check them again."""
    return file.path.with_name(f"{file.path.stem}.checks.jsonl")


def candidate_checker(
    files: Sequence[DraftsFile], settings: VerificationSettings, on_verified: OnVerified = lambda standing: None
) -> CandidateCheck:
    """Return the function that checks candidates from some drafts files and returns the findings of those that fail.

    Where robustness is checked, it raises RecordError when the log next to the first file cannot be read or written.
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
    """Return the function that finds an episode's house next to one of some drafts files."""

    def house_of(episode: Episode) -> House:
        name = episode.house.name
        return next((file for file in files if (file.houses / f"{name}.json").is_file()), files[0]).house(name)

    return house_of
