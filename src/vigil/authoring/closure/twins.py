"""Rules about twins that can be checked on their episodes and start states, without search or replay.

The other rules are in `vigil.authoring.closure.certify`, which decides by search whether twins match their answers.
"""

from collections.abc import Iterable, Sequence
from typing import Literal

from vigil.authoring.closure.tasks import ClosureTask
from vigil.authoring.language.referring import DescribedThing, Phrase, referents
from vigil.authoring.solving.privileged_view import PrivilegedView
from vigil.errors import EpisodeError
from vigil.protocol.episode import Episode
from vigil.scoring.closure import CLOSURE_KINDS


class BrokenRule(EpisodeError):
    """Error for twins that break a rule; the message says how."""

    def __init__(self, rule: str, message: str) -> None:
        super().__init__(message)
        self.rule = rule


def check_single_difference(task: ClosureTask, second: Episode) -> None:
    """Raise BrokenRule unless the setup of the object `task.removed` is the only difference between two twins.

    In kinds of tasks whose instruction has an "if", the goals of the twins may differ, too.
    """
    first = task.episodes[0]
    same = ("family", "house", "start", "instruction", "bindings", "max_steps", "max_invalid")
    goal = () if CLOSURE_KINDS[task.kind].has_branches else ("goal",)
    apart = [name for name in (*same, *goal) if getattr(first, name) != getattr(second, name)]
    ids = {
        object_id
        for object_id in {*first.setup.objects, *second.setup.objects}
        if first.setup.objects.get(object_id) != second.setup.objects.get(object_id)
    }
    if apart or ids != {task.removed} or first.setup.held != second.setup.held:
        raise BrokenRule(
            "twins_differ_in_one",
            f"the twins may differ only in the setup of {task.removed!r}, but differ in "
            f"{', '.join([*apart, *sorted(ids)])}",
        )


def check_hidden(task: ClosureTask, episode: Episode, view: PrivilegedView, *, is_searched: bool) -> None:
    """Raise BrokenRule if a side's first frame shows what it must hide. The simulator was just reset to this side.

    The frame must hide any thing in which the twins differ, except the target; if `is_searched` is True, also the
    target. No mirror may be in view: it may show these things, and things in a mirror do not count as seen.
    """
    target = episode.goal.object_id
    wanted = {target: "hidden_at_start"} if is_searched else {}
    if task.removed != target:
        wanted[task.removed] = "difference_hidden"
    mirrors = [thing.id for thing in view.scene.things.values() if thing.category == "Mirror" and thing.is_present]
    for object_id, rule in wanted.items():
        for mirror in mirrors:
            if view.is_in_frame(mirror):
                raise BrokenRule(
                    rule,
                    f"the mirror {mirror!r}, which may show {object_id!r}, is in view at the start of {episode.id!r}",
                )
        if view.scene.things[object_id].is_present and view.is_in_frame(object_id):
            pixels = view.state_of(object_id).visible_px
            raise BrokenRule(rule, f"{object_id!r} is in view at the start of {episode.id!r} (about {pixels} pixels)")


def reason_for_absence(phrases: Sequence[Phrase], items: Iterable[DescribedThing]) -> Literal["absent", "elsewhere"]:
    """Return "elsewhere" if another thing has the same name as the missing thing; otherwise "absent".

    A look-alike with another name (a pot for a kettle) does not count. `phrases` describe the missing thing. Raises
    BrokenRule if one of them also fits a thing that is present, even a look-alike.
    """
    everything = list(items)
    for phrase in phrases:
        for other in referents(phrase, everything)[:1]:
            raise BrokenRule(
                "distinguished", f"the object meant by {str(phrase)!r} is absent, but the phrase also fits {other.id!r}"
            )
    left = [(phrase.name, each.name) for phrase in phrases for each in referents(phrase.without_place, everything)]
    return "elsewhere" if any(name == found for name, found in left) else "absent"
