"""Signs that follow from a comparison of entries: equal plays, and the gap between a public pack and a fresh one."""

from collections.abc import Iterator, Mapping, Sequence

from vigil.analysis.measures.intervals import independent_difference
from vigil.web.leaderboard.checking import CheckedEntry
from vigil.web.leaderboard.signs import MIN_REPLIES

_EQUAL = {
    "replies_sha256": f"plays of {MIN_REPLIES} or more replies have, word by word, the replies",
    "actions_sha256": f"plays of {MIN_REPLIES} or more replies with a click have, action by action, the actions",
}
"""Column of the plays -> words which say that plays of two entries have the same value in this column."""


def signs_between(entries: Sequence[CheckedEntry]) -> dict[str, list[str]]:
    """Return {id of an entry: signs} from comparisons of entries: equal replies, and lower results on fresh packs."""
    found: dict[str, list[str]] = {entry.id: [] for entry in entries}
    plays = {entry.id: {column: _plays_of(entry, column) for column in _EQUAL} for entry in entries}
    for entry in entries:
        for other in entries:
            if other is not entry and other.header.spec.pack_sha256 == entry.header.spec.pack_sha256:
                found[entry.id].extend(_equal_plays(other, plays[entry.id], plays[other.id]))
            if other.tier == "fresh_pack" != entry.tier:
                sentence = _gap(entry, other)
                found[entry.id].extend(sentence)
                found[other.id].extend(sentence)
    return found


_Plays = Mapping[str, tuple[set[tuple[str, str]], list[tuple[str, str]]]]


def _plays_of(entry: CheckedEntry, column: str) -> tuple[set[tuple[str, str]], list[tuple[str, str]]]:
    """Return (episode, hash in `column`) of all plays, and of the plays that are compared with others."""
    plays = list(zip(entry.plays["episode_id"], entry.plays[column], strict=True))
    if entry.header.spec.agent_kind in ("scripted", "privileged"):
        return set(plays), []  # the same script gives the same replies
    steps = entry.plays["steps"]
    return set(plays), [play for play, count in zip(plays, steps, strict=True) if count >= MIN_REPLIES and play[1]]


def _equal_plays(other: CheckedEntry, ours: _Plays, theirs: _Plays) -> Iterator[str]:
    reported = 0
    for column, words in _EQUAL.items():
        compared, (known, _) = ours[column][1], theirs[column]
        equal = sum(play in known for play in compared)
        if equal > reported:  # equal replies are equal actions too
            reported = equal
            yield f"{equal} of {len(compared)} {words} of entry {other.id} ({other.metadata.model_name})."


def _gap(public: CheckedEntry, fresh: CheckedEntry) -> list[str]:
    """Return [a sentence that compares a model's results on a public and a fresh pack]; [] if that is not possible."""
    same = [(each.metadata.model_name, each.header.spec.profile, each.suite) for each in (public, fresh)]
    ours, theirs = (each.figures[each.ranked_by] for each in (public, fresh))
    if same[0] != same[1] or None in (*ours, *theirs):
        return []
    gap, (low, high) = independent_difference(ours, theirs)  # pyright: ignore[reportArgumentType]
    return [
        f"{public.ranked_by} on the public pack {public.header.spec.pack} minus that on the fresh pack "
        f"{fresh.header.spec.pack}: {100 * gap:+.1f} pp [{100 * low:.1f}, {100 * high:.1f}]."
    ]


def copied_plays(entry: CheckedEntry, other: CheckedEntry) -> int:
    """Return how many plays equal a play of another entry in replies and times, which never happens by chance."""
    return len(set(entry.plays["play_sha256"]) & set(other.plays["play_sha256"]))
