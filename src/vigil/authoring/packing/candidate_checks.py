"""Check of candidates for a pack: each is replayed and, for a robust pack, played by the noisy solver.

Only selected candidates are checked, house by house in worker processes. The noisy solver takes a second or more per
episode; results are therefore stored next to the drafts, so that each candidate is tried only once.
"""

from collections.abc import Callable, Sequence
from pathlib import Path

from vigil.authoring.drafting.drafts import DraftsFile, house_in
from vigil.authoring.packing.assemble import Candidate, CandidateCheck
from vigil.authoring.packing.verify import OnVerified, VerificationSettings, episode_tasks, findings_of
from vigil.authoring.review.validate import Finding
from vigil.protocol.episode import Episode
from vigil.protocol.house import House


def check_log_of(file: DraftsFile) -> Path:
    """Return the path of the log with the robustness results of drafts; without it, drafts are checked again."""
    return file.path.with_name(f"{file.path.stem}.checks.jsonl")


def candidate_checker(
    files: Sequence[DraftsFile], settings: VerificationSettings, on_verified: OnVerified = lambda progress: None
) -> CandidateCheck:
    """Return the function that checks candidates from some drafts files and returns the findings of those that fail.

    If robustness is checked, it raises RecordError if the log next to the first file cannot be read or written.
    """
    house_of = house_finder(files)
    log = check_log_of(files[0]) if settings.is_robust else None

    def check(chosen: Sequence[Candidate]) -> dict[str, list[Finding]]:
        episodes = [candidate.episode for candidate in chosen]
        solved = {candidate.episode.id: candidate.draft.actions for candidate in chosen}
        results = findings_of(episode_tasks(episodes, solved), house_of, settings, log, on_verified)
        return {result.episode_id: result.faults for result in results if result.findings}

    return check


def house_finder(files: Sequence[DraftsFile]) -> Callable[[Episode], House]:
    """Return the function that finds an episode's house next to one of some drafts files."""
    return lambda episode: house_in(files, episode.house.name)
