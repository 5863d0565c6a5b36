"""Comparison of two packs: the episodes that were added, removed or changed, with the fields that differ."""

from dataclasses import dataclass

from vigil.packs.pack import Pack


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
    mine, theirs = (
        {each.id: {**each.model_dump(), "solution": pack.solutions.get(each.id)} for each in pack.episodes}
        for pack in (a, b)
    )
    both = sorted(mine.keys() & theirs.keys())
    fields = {name: tuple(key for key, value in mine[name].items() if value != theirs[name].get(key)) for name in both}
    changed = {name: found for name, found in fields.items() if found}
    return PackDifference(
        only_a=tuple(sorted(mine.keys() - theirs.keys())),
        only_b=tuple(sorted(theirs.keys() - mine.keys())),
        changed=changed,
        same=len(both) - len(changed),
    )
