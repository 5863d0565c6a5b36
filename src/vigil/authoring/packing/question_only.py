"""Question-only baselines: they guess a queried state (SV) from the words of the question.

If the words reveal the answer, a pack does not measure sight. Chance is one half, because each question names two
states.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import log

from vigil.protocol.actions import Report, Status
from vigil.protocol.episode import Episode, Solution
from vigil.protocol.goals import ReportStatus
from vigil.scoring.rates import wilson

PAIRS: dict[str, tuple[Status, Status]] = {"is_toggled": ("off", "on"), "is_open": ("closed", "open")}
SAME_SCORE = 1e-12
"""Difference below which two log probabilities count as equal."""


@dataclass(frozen=True, slots=True)
class GuessScore:
    """The score of a method of guessing."""

    hits: int
    """Number of correct guesses."""
    n: int
    """Number of guesses."""

    @property
    def interval(self) -> tuple[float, float]:
        """The 95 % Wilson interval of the share of correct guesses."""
        return wilson(self.hits, self.n)

    @property
    def is_chance(self) -> bool:
        """Whether the interval contains one half or lies below it, i.e. the words do not seem to reveal the answer."""
        return self.interval[0] <= 0.5


@dataclass(frozen=True, slots=True)
class _Question:
    words: frozenset[str]
    pair: tuple[Status, Status]
    label: Status
    house: str


def majority_guess(episodes: Sequence[Episode], solutions: Mapping[str, Solution]) -> GuessScore:
    """Return the score of guessing, for each pair of labels (on/off, open/closed), the pack's more common label."""
    questions = _questions(episodes, solutions)
    counts = {
        pair: Counter(question.label for question in questions if question.pair == pair) for pair in PAIRS.values()
    }
    return GuessScore(sum(max(found.values(), default=0) for found in counts.values()), len(questions))


def words_guess(episodes: Sequence[Episode], solutions: Mapping[str, Solution]) -> GuessScore:
    """Return the score of naive Bayes on the words of the question, trained for each house on all other houses."""
    questions = _questions(episodes, solutions)
    hits = 0
    for house in sorted({question.house for question in questions}):
        known = [question for question in questions if question.house != house]
        for question in questions:
            if question.house == house:
                alike = [other for other in known if other.pair == question.pair]
                hits += _most_likely(question, alike) == question.label
    return GuessScore(hits, len(questions))


def _most_likely(question: _Question, known: Sequence[_Question]) -> Status:
    """Return the label that is more likely given the words; if both are equally likely, the first of the pair."""
    first, second = question.pair
    return second if _score(question, second, known) > _score(question, first, known) + SAME_SCORE else first


def _score(question: _Question, label: Status, known: Sequence[_Question]) -> float:
    having = [other for other in known if other.label == label]
    seen = Counter(word for other in having for word in other.words)
    prior = log((len(having) + 1) / (len(known) + 2))
    return prior + sum(log((seen[word] + 1) / (len(having) + 2)) for word in sorted(question.words))


def _questions(episodes: Sequence[Episode], solutions: Mapping[str, Solution]) -> list[_Question]:
    found: list[_Question] = []
    for episode in episodes:
        report = solutions[episode.id].actions[-1]
        if isinstance(episode.goal, ReportStatus) and isinstance(report, Report):
            words = frozenset(
                episode.instruction.casefold().replace("?", " ").replace(".", " ").replace(",", " ").split()
            )
            found.append(_Question(words, PAIRS[episode.goal.state], report.status, episode.house.name))
    return found
