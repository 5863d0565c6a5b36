"""An episode at its start, with the facts that the rules (`rules.RULES`) need."""

from dataclasses import dataclass
from functools import cached_property

from vigil.authoring.language.referring import DescribedThing, Phrase, items_of, mentions, resolve_mentions
from vigil.authoring.solving.privileged_view import PrivilegedView
from vigil.protocol.episode import Episode
from vigil.protocol.goals import Goal
from vigil.protocol.house import House
from vigil.protocol.world import ObjectState, WorldState
from vigil.records.record import EpisodeRecord
from vigil.scoring.goal_check import GoalRow, check


@dataclass(frozen=True)
class EpisodeStart:
    """An episode at its start. The simulator has just been reset to the episode."""

    episode: Episode
    house: House
    view: PrivilegedView

    @cached_property
    def world(self) -> WorldState:
        """The hidden world at the reset."""
        return self.view.world(self.episode.bound_ids())

    @cached_property
    def items(self) -> dict[str, DescribedThing]:
        """Thing id -> description of the thing at the reset, with the names of the catalogue."""
        return items_of(self.view.scene)

    @cached_property
    def mentioned(self) -> list[tuple[Phrase, list[DescribedThing]]]:
        """Every phrase of the instruction with the things that it could mean."""
        phrases = mentions(self.episode.instruction, [item.name for item in self.items.values()])
        held = self.items.get(self.episode.setup.held or "")
        return list(zip(phrases, resolve_mentions(phrases, self.items.values(), held), strict=True))

    @property
    def target(self) -> ObjectState:
        """The target's state at the reset."""
        return self.world.objects[self.episode.goal.object_id]

    @property
    def first(self) -> ObjectState:
        """State at the reset of the object that must be acted on first."""
        chain = self.episode.goal.chain
        return self.world.objects[chain[0].object_id if chain else self.episode.goal.object_id]

    @cached_property
    def row(self) -> GoalRow:
        """Whether the goal holds at the reset, and its progress."""
        return self.at_reset(self.episode.goal)

    def at_reset(self, goal: Goal) -> GoalRow:
        """Return whether a goal about bound objects holds at the reset, and its progress."""
        record = EpisodeRecord.model_construct(episode_id=self.episode.id, initial=self.world, steps=())
        return check(goal, record).rows[0]
