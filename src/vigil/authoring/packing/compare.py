"""Comparison of two packs: the episodes that were added, removed or changed, with the fields that differ."""

from dataclasses import dataclass

from vigil.packs.pack import Pack
from vigil.protocol.episode import Episode


@dataclass(frozen=True, slots=True)
class PackDifference:
    """The differences between two packs, A and B."""

    only_a: tuple[str, ...]
    """Ids of the episodes that only A has."""
    only_b: tuple[str, ...]
    """Ids of the episodes that only B has."""
    changed: dict[str, tuple[str, ...]]
    """Episode id -> names of the fields that differ; `solution` means the recorded actions."""
    same: int
    """Number of episodes that are equal in both packs."""

    @property
    def is_none(self) -> bool:
        """Whether both packs have equal episodes and solutions."""
        return not (self.only_a or self.only_b or self.changed)


def compare(a: Pack, b: Pack) -> PackDifference:
    """Return the differences of pack `b` from pack `a`."""
    mine, theirs = {e.id: e for e in a.episodes}, {e.id: e for e in b.episodes}
    both = sorted(mine.keys() & theirs.keys())
    fields = {name: (*_fields(mine[name], theirs[name]), *_solution(a, b, name)) for name in both}
    changed = {name: found for name, found in fields.items() if found}
    return PackDifference(
        only_a=tuple(sorted(mine.keys() - theirs.keys())),
        only_b=tuple(sorted(theirs.keys() - mine.keys())),
        changed=changed,
        same=len(both) - len(changed),
    )


def _fields(a: Episode, b: Episode) -> list[str]:
    before, after = a.model_dump(), b.model_dump()
    return [name for name in before if before[name] != after[name]]


def _solution(a: Pack, b: Pack, name: str) -> list[str]:
    return ["solution"] if a.solutions.get(name) != b.solutions.get(name) else []
