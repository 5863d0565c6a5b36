"""What closes an episode of the suite rightly, in words for whoever reviews it; never for whoever plays it."""

from vigil.authoring.drafting.drafts import Proposed
from vigil.packs.pack import Pack
from vigil.scoring.closure import SUITE, ClosureAnswer, answers_of


def closings_of_pack(pack: Pack) -> dict[str, str]:
    """Returns the words by episode id; none for a pack that is not of the suite. Raises PackMismatch."""
    if pack.manifest.suite != SUITE:
        return {}
    return {name: closing_words(answer) for name, answer in answers_of(pack.folder).items()}


def closings_of_drafts(proposed: Proposed) -> dict[str, str]:
    """Returns the words by episode id, of all that is of the suite in a drafts file."""
    return {answer.episode_id: closing_words(answer) for task in proposed.closures for answer in task.answers}


def closing_words(answer: ClosureAnswer) -> str:
    """Returns the kind of an episode, what its twin is about, and what report is right at its end."""
    facts = ", ".join(filter(None, (answer.kind, answer.side, answer.reason, answer.form)))
    right = " or ".join(answer.accepted)
    told = f"{facts}: right is {right}"
    return told if answer.pair is None else f"{told}. Whoever rejects it rejects its twin with it"
