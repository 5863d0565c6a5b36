"""A proposed chore: its sentence and goal, and what a list must change, name and protect for it."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import TypeVar

from vigil.authoring.drafting.house_context import HouseContext
from vigil.authoring.language.disambiguation import confusable
from vigil.authoring.language.drawer_names import OF, true_positions
from vigil.authoring.language.referring import DescribedThing, Phrase, mentions, referents
from vigil.protocol.goals import Chore, ObjectAtReceptacle
from vigil.protocol.world import ObjectSetup
from vigil.scene.supports import drawers_of
from vigil.scene.things import Scene
from vigil.scoring.chore_answers import ChoreKind
from vigil.scoring.closure import Reason

MAX_SEARCHED = 8
"""Maximum number of closed containers in which people would look for a hidden object of a list."""


@dataclass(frozen=True, slots=True)
class ProposedChore:
    """One chore that may be part of a list."""

    kind: ChoreKind
    form: str
    sentence: str
    chore: Chore
    meant: frozenset[str]
    """Ids of the things that the sentence means. Parsing the sentence must give the same things."""
    changes: Mapping[str, ObjectSetup] = field(default_factory=dict)
    """Id -> change of the object before the start."""
    roles: Mapping[str, str] = field(default_factory=dict)
    """Role (without the chore's number) -> id, for things that the goal does not name."""
    reason: Reason | None = None
    """Reason why the chore cannot be met; None if it can be met."""
    removed: str = ""
    """Id of the thing that makes the chore impossible (absent, broken or in the way); empty if the chore can be met."""
    phrase: Phrase | None = None
    """Phrase for a thing that is absent; None for other chores."""
    distractor: str | None = None
    """Id of another thing with the same bare name as the chore's object."""

    @property
    def ids(self) -> frozenset[str]:
        """Ids of all things that the chore is about, changes or depends on."""
        extra = () if self.distractor is None else (self.distractor,)
        return frozenset({*self.chore.ids(), *self.changes, *self.roles.values(), *extra})

    @property
    def receptacle_ids(self) -> frozenset[str]:
        """Ids of the receptacles on or into which the chore puts something."""
        return frozenset(part.receptacle_id for part in self.chore.parts if isinstance(part, ObjectAtReceptacle))


Proposals = Iterator[ProposedChore]
_Item = TypeVar("_Item")


def in_turn(*sources: Iterator[_Item]) -> Iterator[_Item]:
    """Yield one item of each source in turn until all are exhausted."""
    left = list(sources)
    while left:
        for source in list(left):
            for item in source:
                yield item
                break
            else:
                left.remove(source)


def other_drawers(scene: Scene, items: Mapping[str, DescribedThing], phrases: Iterable[Phrase]) -> Iterator[str]:
    """Yield ids of furniture in which a listener may look for a drawer of `phrases`, though it is not the drawer's.

    This is furniture with exactly the same name, and furniture with a similar name that has a drawer at the same
    position: "the third drawer from above" may be the last of three drawers, whose name is "bottom drawer".
    """
    for phrase in phrases:
        for name in (phrase.name, phrase.support or ""):
            which, _, whole = name.partition(OF)
            if not whole:
                continue
            called = referents(Phrase(whole, room=phrase.room), items.values())
            fitting = [each for each in called if each.name == whole or _has_drawer_at(scene, each.id, which)]
            yield from (each.id for each in fitting[1:])


def _has_drawer_at(scene: Scene, furniture_id: str, which: str) -> bool:
    return any(which in true_positions(scene, each) for each in drawers_of(scene, scene.things[furniture_id]))


def names_other_drawers(context: HouseContext, chore: ProposedChore) -> bool:
    """Return whether a chore's sentence names a drawer that a listener may look for in other furniture."""
    phrases = mentions(chore.sentence, [item.name for item in context.items.values()])
    return any(other_drawers(context.view.scene, context.items, phrases))


def distractor_of(context: HouseContext, thing_id: str) -> str | None:
    """Return the id of the first other thing that the bare name of `thing_id` could mean; None if there is none."""
    items = context.items
    return next((other.id for other in confusable(items[thing_id], items.values())), None)
