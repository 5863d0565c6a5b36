"""Facts about a pack of lists: its chores by kind and form, and the length of its lists."""

from collections import Counter
from collections.abc import Sequence
from typing import Any

from vigil.scoring.chore_answers import CHORE_KINDS, ListAnswer


def chore_facts(answers: Sequence[ListAnswer]) -> dict[str, Any]:
    """Return the entries about a pack's lists for its manifest: numbers of lists and chores, steps, and rooms."""
    chores = [chore for answer in answers for chore in answer.chores]
    of_kind = Counter(chore.kind for chore in chores)
    forms = {kind: Counter(chore.form for chore in chores if chore.kind == kind) for kind in CHORE_KINDS}
    steps = [answer.solver_steps or 0 for answer in answers]
    return {
        "kinds": dict(sorted(Counter(answer.kind for answer in answers).items())),
        "chores": {kind: of_kind[kind] for kind in CHORE_KINDS if of_kind[kind]},
        "forms": {kind: dict(sorted(found.items())) for kind, found in forms.items() if found},
        "claims": len(chores),
        "rooms": dict(sorted(Counter(str(answer.rooms) for answer in answers).items(), key=lambda row: int(row[0]))),
        "solver_steps": {"least": min(steps), "mean": round(sum(steps) / len(steps), 1), "most": max(steps)},
    }
