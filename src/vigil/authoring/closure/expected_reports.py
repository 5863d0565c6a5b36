"""Texts for reviewers that say how each episode of the suite must be closed; players must not see them."""

from vigil.authoring.drafting.drafts import DraftsContent
from vigil.packs.pack import Pack
from vigil.scoring.closure import SUITE, ClosureAnswer, closure_answers


def expected_reports_of_pack(pack: Pack) -> dict[str, str]:
    """Return episode id -> text; empty if the pack is not of the suite. Raises PackMismatch if answers were changed."""
    if pack.manifest.suite != SUITE:
        return {}
    return {name: expected_report(answer) for name, answer in closure_answers(pack.folder).items()}


def expected_reports_of_drafts(proposed: DraftsContent) -> dict[str, str]:
    """Return episode id -> text for all tasks of the suite in a drafts file."""
    return {answer.episode_id: expected_report(answer) for task in proposed.tasks for answer in task.answers}


def expected_report(answer: ClosureAnswer) -> str:
    """Return a text that states an episode's kind, side, reason and form, and the statuses that close it correctly."""
    facts = ", ".join(filter(None, (answer.kind, answer.side, answer.reason, answer.form)))
    right = " or ".join(answer.accepted)
    text = f"{facts}: the correct report is {right}"
    return text if answer.pair is None else f"{text}. Rejecting it also rejects its twin"
