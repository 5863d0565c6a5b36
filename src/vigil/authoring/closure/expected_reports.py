"""Expected closing reports of the suites' episodes, in words for reviewers; players must not see them."""

from vigil.authoring.drafting.drafts import DraftsContent
from vigil.packs.pack import CHORES_SUITE, Pack
from vigil.scoring.chore_answers import ListAnswer, list_answers
from vigil.scoring.closure import SUITE, ClosureAnswer, closure_answers


def expected_reports_of_pack(pack: Pack) -> dict[str, str]:
    """Return episode id -> text; empty for a pack that is not of a suite. Raises PackMismatch if a file has changed."""
    if pack.manifest.suite == CHORES_SUITE:
        return {name: expected_claims(answer) for name, answer in list_answers(pack.folder).items()}
    if pack.manifest.suite != SUITE:
        return {}
    return {name: expected_report_text(answer) for name, answer in closure_answers(pack.folder).items()}


def expected_reports_of_drafts(proposed: DraftsContent) -> dict[str, str]:
    """Return episode id -> text for all tasks of a suite in a drafts file."""
    return {
        answer.episode_id: expected_claims(answer) if isinstance(answer, ListAnswer) else expected_report_text(answer)
        for task in proposed.tasks
        for answer in task.answers
    }


def expected_claims(answer: ListAnswer) -> str:
    """Return a text with the kind of each chore of a list, the reason why it cannot be met, and the true claims."""
    lines = [
        f"{number}. {', '.join(filter(None, (chore.kind, chore.reason)))}: {' or '.join(chore.accepted)}"
        for number, chore in enumerate(answer.chores, start=1)
    ]
    return f"the correct claims are {'; '.join(lines)}"


def expected_report_text(answer: ClosureAnswer) -> str:
    """Return a text that states an episode's kind, side, reason and form, and the statuses that close it correctly."""
    facts = ", ".join(filter(None, (answer.kind, answer.side, answer.reason, answer.form)))
    right = " or ".join(answer.accepted)
    text = f"{facts}: the correct report is {right}"
    return text if answer.pair is None else f"{text}. Rejecting it also rejects its twin"
