"""Comparisons of entries.

Boards rank the entries that may be compared, and test each entry against the next one. Signs follow from equal plays,
and from the gap between a public pack and a fresh one.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

from vigil.analysis.measures.intervals import PairedTest, holm, independent_difference, paired_test
from vigil.packs.names import stem_of, version_of
from vigil.web.leaderboard.checking import CheckedEntry
from vigil.web.leaderboard.measures import MIN_REPLIES, figure_text
from vigil.web.leaderboard.metadata import TIERS, Division, Tier

LEVEL = 0.05
_KEY = ["episode_id", "epoch"]
_EQUAL = {
    "replies_sha256": f"plays of {MIN_REPLIES} or more replies have, word by word, the replies",
    "actions_sha256": f"plays of {MIN_REPLIES} or more replies with a click have, action by action, the actions",
}
"""Column of the plays -> words which say that plays of two entries have the same value in this column."""
_Plays = Mapping[str, tuple[set[tuple[str, str]], list[tuple[str, str]]]]


@dataclass(frozen=True)
class Comparison:
    """The paired test of an entry against the next entry of its board, on the plays that both have."""

    test: PairedTest
    p: float
    """P-value after Holm's correction for the tests of the board."""

    @property
    def is_apart(self) -> bool:
        """Whether the difference between the two entries is significant."""
        return self.p < LEVEL

    @property
    def sentence(self) -> str:
        """The result of the test, with the first entry's lead in percentage points."""
        low, high = self.test.interval or (None, None)
        ends = "" if low is None or high is None else f" [{100 * low:.1f}, {100 * high:.1f}]"
        shown = "< 0.001" if self.p < 0.001 else f"= {self.p:.3f}"
        verdict = "told apart" if self.is_apart else "not told apart"
        return f"{verdict}: {100 * self.test.difference:+.1f} pp{ends}, p {shown}"


@dataclass(frozen=True)
class Ranked:
    """An entry with its rank in its board."""

    rank: int
    entry: CheckedEntry
    to_next: Comparison | None
    """Test against the next entry; None for the last entry, or if the two share no play."""


@dataclass(frozen=True)
class Board:
    """The entries of one pack, profile, tier and division, best first."""

    pack: str
    pack_sha256: str
    suite: str | None
    profile: str
    tier: Tier
    division: Division
    entries: tuple[Ranked, ...]


def boards_of(entries: Iterable[CheckedEntry]) -> list[Board]:
    """Return the boards, sorted by pack (the newest first), then by tier (the most trusted first), then by division."""
    groups: dict[tuple[str, str, str, Tier, Division], list[CheckedEntry]] = {}
    for entry in entries:
        spec = entry.header.spec
        key = (spec.pack, spec.pack_sha256, entry.profile, entry.tier, entry.division)
        groups.setdefault(key, []).append(entry)
    divisions: tuple[Division, ...] = ("standard", "custom", "trained on streams", "baseline")
    found = []
    for (pack, sha256, profile, tier, division), group in groups.items():
        ranked = sorted(group, key=lambda each: (-(each.figures[each.ranked_by][0] or 0.0), each.id))
        found.append(Board(pack, sha256, group[0].suite, profile, tier, division, tuple(_ranked(ranked))))
    return sorted(
        found,
        key=lambda board: (
            board.suite or "",
            stem_of(board.pack) or board.pack,
            tuple(-number for number in version_of(board.pack)),
            board.pack_sha256,
            -TIERS.index(board.tier),
            divisions.index(board.division),
            board.profile,
        ),
    )


def _ranked(entries: Sequence[CheckedEntry]) -> Iterable[Ranked]:
    tests = [_test(first, second) for first, second in pairwise(entries)]
    adjusted = iter(holm([test.test.p for test in tests if test is not None]))
    compared = [None if test is None else Comparison(test, next(adjusted)) for test in tests]
    for number, (entry, comparison) in enumerate(zip(entries, [*compared, None], strict=True), start=1):
        yield Ranked(number, entry, comparison)


def _test(first: CheckedEntry, second: CheckedEntry) -> PairedTest | None:
    """Return the paired test of the first entry's lead over the second; None if they share no play."""
    shared = first.plays.merge(second.plays, on=_KEY, suffixes=("", "_2"))
    if not len(shared):
        return None
    episodes, houses = (shared[name].to_numpy(dtype=str) for name in ("episode_id", "house"))
    ours, theirs = (shared[name].to_numpy(dtype=bool) for name in ("closed", "closed_2"))
    return paired_test(theirs, ours, episodes=episodes, houses=houses)


@dataclass(frozen=True)
class History:
    """One model's results over the versions of a pack."""

    model: str
    profile: str
    stem: str
    results: dict[str, list[str]]
    """Name of a pack -> the model's results on it, each as text."""


def history_of(entries: Iterable[CheckedEntry], earlier: Iterable[dict[str, str]]) -> list[History]:
    """Return the models that have results on several versions of a pack. `earlier` has `history_row`s of earlier
    builds."""
    rows = [history_row(entry) for entry in entries]
    grouped: dict[tuple[str, str, str], dict[str, list[str]]] = {}
    for row in [*rows, *earlier]:
        stem = stem_of(row["pack"]) or row["pack"]
        packs = grouped.setdefault((row["model_name"], row["profile"], stem), {})
        texts = packs.setdefault(row["pack"], [])
        if row["result"] not in texts:
            texts.append(row["result"])
    return [
        History(*key, {name: packs[name] for name in sorted(packs, key=version_of)})
        for key, packs in sorted(grouped.items())
        if len(packs) > 1
    ]


def history_row(entry: CheckedEntry) -> dict[str, str]:
    """Return the row that later builds need to show an entry in the history."""
    return {
        "model_name": entry.metadata.model_name,
        "profile": entry.profile,
        "pack": entry.header.spec.pack,
        "result": f"{figure_text(entry.ranked_by, entry.figures[entry.ranked_by])}, {entry.tier}",
    }


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
