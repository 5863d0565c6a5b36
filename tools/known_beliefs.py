"""Agents whose beliefs are known, to check the analysis of beliefs: `python -m tools.known_beliefs`.

Each agent plays synthetic episodes whose worlds, answers and reports are drawn with known chances. The same functions
as for real runs read its records and probes. The command prints how often each interval contains the true value, which
follows from the chances by enumeration; 95 % is nominal.
"""

import argparse
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import cached_property

import numpy as np
from scipy.stats import betabinom

from vigil.analysis.measures.beliefs import scores
from vigil.analysis.measures.beliefs.study import DELAY_STEPS, BeliefStudy, Estimate
from vigil.base.geometry import Box, Pose, Vec3
from vigil.base.versions import Versions
from vigil.protocol.actions import InvalidAction, Navigate, Reply, Report
from vigil.protocol.episode import Episode, HouseRef
from vigil.protocol.goals import ObjectInState
from vigil.protocol.world import Effect, ObjectState, WorldState
from vigil.records.probe import SCALE, ProbeAnswer, question_sha256
from vigil.records.probe_file import ProbeRecord
from vigil.records.record import EpisodeRecord, StepRecord
from vigil.scoring.beliefs import EpisodeBeliefs, episode_beliefs
from vigil.scoring.outcomes import score
from vigil.scoring.rates import Interval

STEPS = 12
"""Steps of every episode; the agent is asked at each."""
HAZARDS = (0.05, 0.15)
"""Chance that a step attains the goal; each house has one of them, so that its episodes are alike."""
EPISODES_PER_HOUSE = 2
VALUES = np.arange(scores.VALUES)
NOON = datetime(2026, 1, 1, 12, tzinfo=UTC)
_THING = ObjectState(
    category="Fridge",
    position=Vec3(0.0, 1.0, 2.0),
    box=Box(center=Vec3(0.0, 1.0, 2.0), size=Vec3(0.6, 1.8, 0.6)),
    visible=True,
    visible_px=500,
    open_px=300,
    toggle_px=300,
    nearest_visible_m=1.7,
    box_distance_m=1.7,
    center_distance_m=2.0,
    openness=0.0,
)
_WORLDS = {
    is_held: WorldState(
        agent=Pose(position=Vec3(0.0, 0.0, 0.0), rotation=0.0, horizon=30.0),
        objects={"target": _THING.model_copy(update={"openness": float(is_held)})},
    )
    for is_held in (False, True)
}


@dataclass(frozen=True)
class KnownAgent:
    """An agent with known chances. It believes that the task is done when its stated value is above one half."""

    name: str
    stated: str
    """How it states beliefs: `calibrated`, `overconfident`, `blind` (without a memory), or `state` (with one)."""
    detects: float = 0.0
    """Chance at each step that it notices that the goal holds; for `state`."""
    forgets: float = 0.0
    """Chance at each step that it stops believing so; for `state`."""
    imagines: float = 0.0
    """Chance at each step that it believes so falsely; for `state`."""
    reports: float = 1.0
    """Chance that it reports success at the last step if it believes that the task is done."""
    careless: float = 0.0
    """Chance that it does so otherwise."""
    silent: float = 0.0
    """Chance that the last question is not answered."""

    @cached_property
    def values(self) -> tuple[np.ndarray, np.ndarray]:
        """Chances of the 21 values while the goal does not hold, and while it holds; not for `state`."""
        rate = held_share()
        stated = betabinom.pmf(VALUES, SCALE, 2 * rate, 2 * (1 - rate))
        if self.stated == "blind":
            flat = np.full(scores.VALUES, 1 / scores.VALUES)
            return flat, flat
        false, true = stated * (1 - scores.P) / (1 - rate), stated * scores.P / rate
        if self.stated == "calibrated":
            return false, true
        pushed = np.rint(SCALE * scores.P**2 / (scores.P**2 + (1 - scores.P) ** 2)).astype(int)
        moved = [np.bincount(pushed, weights=each, minlength=scores.VALUES) for each in (false, true)]
        return moved[0], moved[1]

    def believing(self) -> np.ndarray:
        """Return the chance to believe that the task is done, by steps since the goal was attained."""
        if self.stated != "state":
            return np.full(STEPS, self.values[1][VALUES > SCALE / 2].sum())
        found = [self.detects]
        while len(found) < STEPS:
            found.append(found[-1] * (1 - self.forgets) + (1 - found[-1]) * self.detects)
        return np.array(found)

    @property
    def imagining(self) -> float:
        """Chance to believe so while the goal does not hold."""
        return self.imagines if self.stated == "state" else float(self.values[0][VALUES > SCALE / 2].sum())


STATE_VALUES = {True: (15, 18), False: (2, 6)}
"""Values that an agent of the kind `state` states, each with the chance one half."""
AGENTS = (
    KnownAgent("calibrated", "calibrated"),
    KnownAgent("overconfident", "overconfident"),
    KnownAgent("blind", "blind", reports=0.7, careless=0.2, silent=0.1),
    KnownAgent("forgetful", "state", detects=0.8, forgets=0.15, imagines=0.05, reports=0.6),
    KnownAgent("doubting", "state", detects=0.15, reports=0.9, careless=0.1),
)


def attained_chances() -> np.ndarray:
    """Return the chance that the goal is attained by step 1, 2 ..., over all houses, (STEPS,)."""
    steps = np.arange(STEPS)
    return np.mean([hazard * (1 - hazard) ** steps for hazard in HAZARDS], axis=0)


def held_chances() -> np.ndarray:
    """Return the chance that the goal holds at the frame of step 1, 2 ..., (STEPS,)."""
    return np.concatenate([[0.0], np.cumsum(attained_chances())[:-1]])


def held_share() -> float:
    """Return the share of all frames at which the goal holds."""
    return float(held_chances().mean())


def truths(agent: KnownAgent) -> dict[str, float]:
    """Return the true value of each statistic."""
    weights = np.ones(STEPS)
    weights[-1] -= agent.silent
    held = float(weights @ held_chances()) / weights.sum()
    believing, imagining = agent.believing(), agent.imagining
    by_delay = np.zeros(STEPS)  # weight of the frames that lie so many steps after attainment
    for attained, chance in enumerate(attained_chances(), start=1):
        for step in range(attained + 1, STEPS + 1):
            by_delay[step - 1 - attained] += chance * weights[step - 1]
    seen = float(by_delay @ believing) / by_delay.sum()
    counts = _population(agent, held, seen)
    first = agent.detects if agent.stated == "state" else believing[0]
    survival = (1 - first) ** np.arange(1, DELAY_STEPS + 1)
    found = {
        "base_rate": held,
        "overconfidence": float(scores.overconfidence(counts)),
        "brier": float(scores.brier(counts)),
        "skill": float(scores.skill(counts)),
        "debiased_error": float(scores.reliability_term(counts)),
        "risk_coverage": float(scores.risk_coverage(counts)),
        "false_before": imagining,
        "missed_after": 1 - seen,
        "at_once": first,
        "restricted_mean": float(survival.sum()),
        **_partition(agent, believing, imagining),
    }
    if agent.stated != "state":
        found |= {"auroc_near": float(scores.auroc(counts)), "auroc_closing": float(scores.auroc(counts))}
        found["lost"] = _lost(first, 1 - believing[0])
    else:
        found["lost"] = _lost(first, agent.forgets)
    return found


def _population(agent: KnownAgent, held: float, seen: float) -> np.ndarray:
    """Return the counts of beliefs in the limit of many episodes, (21, 2)."""
    if agent.stated != "state":
        false, true = agent.values
    else:
        false, true = np.zeros(scores.VALUES), np.zeros(scores.VALUES)
        for chances, believes in ((false, agent.imagines), (true, seen)):
            chances[list(STATE_VALUES[True])] = believes / 2
            chances[list(STATE_VALUES[False])] = (1 - believes) / 2
    return np.stack([held * true + (1 - held) * false, held * true], axis=1)


def _partition(agent: KnownAgent, believing: np.ndarray, imagining: float) -> dict[str, float]:
    chances = attained_chances()[: STEPS - 1]
    held = float(chances.sum())
    sees = float(chances @ believing[: STEPS - 1][::-1])
    dreams = (1 - held) * imagining
    blank = 1 - held - dreams
    missing = {
        "FR": dreams * agent.reports + blank * agent.careless,
        "NR": (sees + dreams) * (1 - agent.reports) + (held - sees + blank) * (1 - agent.careless),
    }
    said = 1 - agent.silent
    return {
        "NR knew_and_did_not_say": said * sees * (1 - agent.reports),
        "FR said_without_believing": said * blank * agent.careless,
        "FR believed_wrongly": said * dreams * agent.reports,
        "NR believed_wrongly": said * (dreams * (1 - agent.reports) + (held - sees) * (1 - agent.careless)),
        "NR doubted_correctly": said * blank * (1 - agent.careless),
        "FR no_answer": agent.silent * missing["FR"],
        "NR no_answer": agent.silent * missing["NR"],
    }


def _lost(detects: float, forgets: float) -> float:
    """Return the share of plays that lose their belief, of those that are asked again after it."""
    lost = able = 0.0
    for attained, chance in enumerate(attained_chances(), start=1):
        for step in range(attained + 1, STEPS):  # the step of the first belief; at least one question follows
            begins = chance * detects * (1 - detects) ** (step - attained - 1)
            able += begins
            lost += begins * (1 - (1 - forgets) ** (STEPS - step))
    return lost / able


def estimates(study: BeliefStudy) -> dict[str, tuple[float, Interval | None]]:
    """Return each statistic of a study with its interval."""
    delay = study.delay()
    found: dict[str, Estimate] = {
        **study.calibration(),
        "false_before": study.false_before(),
        "missed_after": study.missed_after(),
    }
    if delay is not None:
        found |= {"at_once": delay.at_once, "restricted_mean": delay.restricted_mean}
    values = {name: (each.value, each.interval) for name, each in found.items()}
    for part, shares in study.parts.items():
        values |= {f"{label} {part}": (share.rate.value or 0.0, share.interval) for label, share in shares.items()}
    lost = study.lost()
    return values | ({"lost": (lost.value or 0.0, lost.interval)} if lost.n else {})


def study_of(agent: KnownAgent, plays: int, rng: np.random.Generator) -> BeliefStudy:
    """Return the study of an agent that plays, two episodes in each house."""
    return BeliefStudy("state", tuple(_plays(agent, plays, rng)))


def _plays(agent: KnownAgent, plays: int, rng: np.random.Generator) -> Iterator[EpisodeBeliefs]:
    hazard = HAZARDS[0]
    for number in range(plays):
        if number % EPISODES_PER_HOUSE == 0:
            hazard = HAZARDS[int(rng.integers(2))]
        house = HouseRef(name=f"house_{number // EPISODES_PER_HOUSE}", sha256="0" * 64)
        episode = _EPISODE.model_copy(update={"id": f"episode_{number}", "house": house})
        attained = next((step for step in range(1, STEPS + 1) if rng.random() < hazard), STEPS + 1)
        stated = _stated(agent, attained, rng)
        chance = agent.reports if stated[-1] > SCALE / 2 else agent.careless
        record = _record(episode, attained, is_reported=bool(rng.random() < chance))
        is_silent = bool(rng.random() < agent.silent)
        probes = [
            _probe(episode.id, step, None if is_silent and step == STEPS else value)
            for step, value in enumerate(stated, start=1)
        ]
        yield episode_beliefs(episode, record, score(episode, record), probes)


def _stated(agent: KnownAgent, attained: int, rng: np.random.Generator) -> list[int]:
    """Return the value that the agent states at each step."""
    found: list[int] = []
    believes = False
    for step in range(1, STEPS + 1):
        is_held = step > attained
        if agent.stated != "state":
            found.append(int(rng.choice(scores.VALUES, p=agent.values[is_held])))
            continue
        if not is_held:
            believes = bool(rng.random() < agent.imagines)
        elif step == attained + 1 or not believes:
            believes = bool(rng.random() < agent.detects)
        else:
            believes = bool(rng.random() >= agent.forgets)
        found.append(STATE_VALUES[believes][int(rng.integers(2))])
    return found


def _record(episode: Episode, attained: int, *, is_reported: bool) -> EpisodeRecord:
    steps: list[StepRecord] = []
    for step in range(1, STEPS + 1):
        is_report = is_reported and step == STEPS
        is_held = step >= attained if not is_report else step > attained  # a report does not change the world
        action = Report(status="success", summary="") if is_report else Navigate(mode="forward", magnitude=1)
        effect, world = None if is_report else Effect(), _WORLDS[is_held]
        steps.append(StepRecord(index=step, reply=Reply(text="{}"), action=action, effect=effect, world=world))
    return EpisodeRecord(
        versions=Versions.current(),
        run_id="known",
        episode_id=episode.id,
        started=NOON,
        ended=NOON,
        initial=_WORLDS[False],
        steps=tuple(steps),
        end="report" if is_reported else "fail_no_report",
    )


def _probe(episode_id: str, step: int, value: int | None) -> ProbeRecord:
    answer = invalid = None
    if value is None:
        invalid = InvalidAction(kind="protocol_failure", reason="no_object")
    else:
        is_done = value > SCALE / 2
        answer = ProbeAnswer(done=is_done, report="success" if is_done else "fail", sure=value, evidence="")
    return ProbeRecord(
        run_sha256="",
        episode_id=episode_id,
        epoch=1,
        attempt=1,
        step=step,
        framing="state",
        question_sha256=question_sha256("state"),
        asked=NOON,
        reply=Reply(text="{}"),
        answer=answer,
        invalid=invalid,
    )


_EPISODE = Episode(
    id="episode",
    family="AI",
    house=HouseRef(name="house", sha256="0" * 64),
    start=_WORLDS[False].agent,
    instruction="Open the fridge.",
    goal=ObjectInState(object_id="target", state="is_open"),
    bindings={"target": "target"},
    max_steps=STEPS,
    max_invalid=4,
)


def coverage(agent: KnownAgent, studies: int, plays: int, seed: int) -> dict[str, tuple[int, int]]:
    """Return for each statistic the number of studies whose interval contains the truth, and of those with one."""
    known, found = truths(agent), defaultdict[str, list[bool]](list)
    for number in range(studies):
        rng = np.random.default_rng((seed, AGENTS.index(agent), number))
        study = study_of(agent, plays, rng)
        assert not study.broken_identities
        for name, (_, interval) in estimates(study).items():
            if name in known and interval is not None:
                low, high = interval
                found[name].append(low - 1e-9 <= known[name] <= high + 1e-9)
    return {name: (sum(each), len(each)) for name, each in found.items()}


def main() -> None:
    """Print the coverage of every interval."""
    parser = argparse.ArgumentParser(description="Checks the analysis of beliefs on agents with known beliefs.")
    parser.add_argument("--plays", type=int, default=50, help="Number of episodes of a study.")
    parser.add_argument("--studies", type=int, default=40, help="Number of studies of each agent.")
    parser.add_argument("--seed", type=int, default=0, help="Random seed.")
    given = parser.parse_args()
    everything: dict[str, list[tuple[int, int]]] = defaultdict(list)
    for agent in AGENTS:
        found = coverage(agent, given.studies, given.plays, given.seed)
        for name, counts in found.items():
            everything[name].append(counts)
    print(f"{len(AGENTS)} agents, {given.studies} studies of {given.plays} episodes each; 95 % is nominal.")
    total = [0, 0]
    for name, counts in everything.items():
        hits, n = (sum(each[at] for each in counts) for at in (0, 1))
        total = [total[0] + hits, total[1] + n]
        by_agent = " ".join(f"{100 * each[0] / max(each[1], 1):4.0f}" for each in counts)
        print(f"{name:28} {hits:5} of {n:5}  {100 * hits / max(n, 1):5.1f} %   by agent: {by_agent}")
    print(f"{'all':28} {total[0]:5} of {total[1]:5}  {100 * total[0] / total[1]:5.1f} %")


if __name__ == "__main__":
    main()
