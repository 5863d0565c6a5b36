"""Baselines of a pack: the rates of agents without skill or sight, and the limits for these rates that packs promise.

They are stored in the pack's folder in `baselines.json`. This file is not part of the pack's hash, because the
baselines are measured on the frozen pack.

Two baselines guess a queried state (SV) from the words of the question only. If the words reveal the answer, a pack
does not measure sight. Chance is one half, because each question names two states.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import log
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field

from vigil.authoring.cards import rate_words, table_lines
from vigil.authoring.packing.sidecar_files import SidecarFile
from vigil.base.versions import schema_validator
from vigil.packs.pack import Pack
from vigil.protocol.actions import Report, Status
from vigil.protocol.episode import Episode, Solution
from vigil.protocol.families import FAMILIES
from vigil.protocol.goals import ReportStatus
from vigil.scoring.rates import wilson

BASELINES = "baselines.json"
BASELINES_SCHEMA = 1
BLIND_AGENTS = ("noop", "random", "sweep", "forward", "centre", "explore", "point", "click_around", "always_success")
AGENTS = (*BLIND_AGENTS, "never_report", "premature", "solver")
"""Baseline agents in the order of the table: first the blind agents, then the privileged agents."""
LIST_AGENTS = ("claim_success", "claim_fail", "claim_coin")
"""Baseline agents on lists of chores. They look at nothing, but make a claim about every chore."""
LIST_RATES = {"W_share": "W share", "W": "W", "B": "B", "T": "T", "chance": "T by chance", "skill": "skill over chance"}
"""Score of lists of chores -> its name in the table."""
MAX_W_OF_A_BLIND_AGENT = 0.40
"""Maximum W of a blind agent in a family. Packs promise that it is not exceeded."""
MOST_BLIND_SKILL = 0.05
"""Maximum absolute skill over chance of claims by an agent that does not look. Packs promise not to exceed it."""
RATES = ("W", "W_strict", "B", "FR", "NR", "IL", "Other")
PAIRS: dict[str, tuple[Status, Status]] = {"is_toggled": ("off", "on"), "is_open": ("closed", "open")}
SAME_SCORE = 1e-12
"""Difference below which two log probabilities count as equal."""


class AgentScore(BaseModel):
    """One agent's rates over some episodes, as fractions. W and B have their 95 % Wilson intervals."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    episodes: int
    rates: dict[str, float]
    intervals: dict[str, tuple[float, float]]
    mean_steps: float


class Baselines(SidecarFile):
    """Baselines measured on one pack."""

    schema_version: Annotated[int, schema_validator(BASELINES_SCHEMA)] = BASELINES_SCHEMA
    vigil: str
    agents: dict[str, dict[str, AgentScore]]
    """Agent -> family (or `all`) -> the agent's rates."""
    guesses: dict[str, tuple[int, int]]
    """Method of guessing a queried state without looking -> number of correct guesses, and number of all guesses."""
    lists: dict[str, dict[str, float | None]] = Field(default_factory=dict)
    """Agent -> its scores on lists of chores; empty for other packs."""


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


def measured_baselines(pack: Pack, summaries: Mapping[str, Mapping[str, Any]], version: str) -> Baselines:
    """Return the baselines of a pack; `summaries` has each agent's summary (`vigil.scoring.summary.summarise`)."""
    agents = {
        name: {"all": _score(summary["overall"])}
        | {family: _score(rates) for family, rates in summary["families"].items()}
        for name, summary in summaries.items()
    }
    guesses = {name: (guess.hits, guess.n) for name, guess in guesses_of(pack).items() if guess.n}
    return Baselines(pack=pack.name, pack_sha256=pack.sha256, vigil=version, agents=agents, guesses=guesses)


def list_baselines(pack: Pack, scores: Mapping[str, Mapping[str, Any]], version: str) -> Baselines:
    """Return the baselines of a pack of lists; `scores` has each agent's scores (`ChoresRun.scores`)."""
    lists = {
        name: {rate: None if found[rate] is None else round(found[rate], 6) for rate in LIST_RATES}
        for name, found in scores.items()
    }
    return Baselines(pack=pack.name, pack_sha256=pack.sha256, vigil=version, agents={}, guesses={}, lists=lists)


def guesses_of(pack: Pack) -> dict[str, GuessScore]:
    """Return method of guessing a queried state without looking -> its score."""
    return {
        "the more common label": majority_guess(pack.episodes, pack.solutions),
        "the words of the question": words_guess(pack.episodes, pack.solutions),
    }


def broken_promises(found: Baselines) -> list[str]:
    """Return messages about promises of packs that these baselines break; empty if they break none."""
    broken: list[str] = []
    for agent, scores in found.agents.items():
        for family, score in scores.items():
            limit = _limit(agent, family)
            if limit is not None and score.rates["W"] > limit:
                broken.append(f"{agent}: W is {score.rates['W']:.1%} in {family}, at most {limit:.0%} is promised")
        if agent in ("noop", "never_report") and scores["all"].rates["B"] > 0:
            broken.append(f"{agent}: B is {scores['all'].rates['B']:.1%}, although it never reports")
        if agent == "solver" and min(scores["all"].rates[rate] for rate in ("W", "W_strict", "B")) < 1:
            broken.append("solver: W, W_strict and B are promised to be 100 %")
    for agent, rates in found.lists.items():
        if rates["B"] or abs(rates["skill"] or 0.0) > MOST_BLIND_SKILL:
            broken.append(f"{agent}: it closes a list, or its claims are better or worse than chance")
    for name, (hits, n) in found.guesses.items():
        if not GuessScore(hits, n).is_chance:
            broken.append(f"{name}: {hits} of {n} states are guessed correctly, more than by chance")
    return broken


def _limit(agent: str, family: str) -> float | None:
    """Return the maximum W that packs promise for an agent in a family; None if they promise nothing."""
    if agent not in BLIND_AGENTS or family == "all" or "report_status" in FAMILIES[family].goal_kinds:
        return None
    return 0.0 if agent == "noop" else MAX_W_OF_A_BLIND_AGENT


def read_baselines(pack: Pack) -> Baselines | None:
    """Return the baselines of exactly this pack; None if there are none. Raises PackMismatch if the file is invalid."""
    return Baselines.read(pack, BASELINES, "Measure again.")


def baselines_table(found: Baselines) -> list[str]:
    """Return the lines of a Markdown table with the rates (%) of each agent, overall and by family.

    On lists of chores, the rates are the scores of lists and claims.
    """
    if found.lists:
        heads = ["agent", *LIST_RATES.values()]
        return table_lines(
            heads,
            (
                [agent, *("" if rate is None else _percent(rate) for rate in rates.values())]
                for agent, rates in found.lists.items()
            ),
        )
    families = [family for family in FAMILIES if any(family in scores for scores in found.agents.values())]
    heads = ["agent", "W [95 %]", "B [95 %]", "FR", "NR", "IL", *(f"{family} W/B" for family in families)]
    rows: list[list[str]] = []
    for agent, scores in found.agents.items():
        whole = scores["all"]
        cells = [f"{agent}{'' if agent in BLIND_AGENTS else ' (privileged)'}"]
        cells += [rate_words(whole.rates[rate], whole.intervals[rate]) for rate in ("W", "B")]
        cells += [_percent(whole.rates[rate]) for rate in ("FR", "NR", "IL")]
        cells += [
            f"{_percent(scores[family].rates['W'])} / {_percent(scores[family].rates['B'])}" if family in scores else ""
            for family in families
        ]
        rows.append(cells)
    return table_lines(heads, rows)


def strongest_lines(found: Baselines) -> list[str]:
    """Return one line of text that names the blind agent with the highest W in each family; none for lists of chores.

    Families whose goal is a report are left out: in them, W does not need a correct answer.
    """
    best: dict[str, tuple[str, float]] = {}
    for agent in BLIND_AGENTS:
        for family, score in found.agents.get(agent, {}).items():
            if _limit(agent, family) is not None and score.rates["W"] > best.get(family, ("", -1.0))[1]:
                best[family] = (agent, score.rates["W"])
    named = [f"{family} {_percent(w)} (`{agent}`)" if w else f"{family} 0" for family, (agent, w) in best.items()]
    return [f"- Highest W of a blind agent: {', '.join(named)}."] if named else []


def guess_lines(found: Baselines) -> list[str]:
    """Return one line of text for each method of guessing a queried state without looking."""
    lines: list[str] = []
    for name, (hits, n) in found.guesses.items():
        low, high = GuessScore(hits, n).interval
        lines.append(
            f"- By {name}, a guess of the queried state is right in {100 * hits / n:.1f} % "
            f"[{100 * low:.0f}, {100 * high:.0f}] of {n}; chance is 50 %."
        )
    return lines


def _score(rates: Mapping[str, Any]) -> AgentScore:
    return AgentScore(
        episodes=rates["episodes"],
        rates={rate: round(rates[rate] or 0.0, 6) for rate in RATES},
        intervals={rate: _rounded(rates["intervals"][rate] or (0.0, 1.0)) for rate in ("W", "B")},
        mean_steps=round(rates["mean_steps"] or 0.0, 4),
    )


def _rounded(interval: Sequence[float]) -> tuple[float, float]:
    low, high = interval
    return round(low, 6), round(high, 6)


def _percent(share: float) -> str:
    return f"{100 * share:.1f}"


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
    least = _log_probability(question, first, known) + SAME_SCORE
    return second if _log_probability(question, second, known) > least else first


def _log_probability(question: _Question, label: Status, known: Sequence[_Question]) -> float:
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
