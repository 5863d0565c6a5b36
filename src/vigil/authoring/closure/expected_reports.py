"""Expected closing reports of the suite's episodes, for reviewers only, never for players."""

from vigil.authoring.drafting.drafts import DraftsContent
from vigil.packs.pack import Pack
from vigil.scoring.closure import SUITE, ClosureAnswer, closure_answers


def expected_reports_of_pack(pack: Pack) -> dict[str, str]:
    """Return the reports by episode id; empty for a pack that is not of the suite. Raises PackMismatch."""
    if pack.manifest.suite != SUITE:
        return {}
    return {name: expected_report(answer) for name, answer in closure_answers(pack.folder).items()}


def expected_reports_of_drafts(proposed: DraftsContent) -> dict[str, str]:
    """Return the reports by episode id for all tasks of the suite in a drafts file."""
    return {answer.episode_id: expected_report(answer) for task in proposed.closures for answer in task.answers}


def expected_report(answer: ClosureAnswer) -> str:
    """Return the kind of an episode, what its twin is about, and which report is correct at its end."""
    facts = ", ".join(filter(None, (answer.kind, answer.side, answer.reason, answer.form)))
    right = " or ".join(answer.accepted)
    text = f"{facts}: right is {right}"
    return text if answer.pair is None else f"{text}. Whoever rejects it rejects its twin with it"
