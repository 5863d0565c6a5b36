"""Fuzzes whole episodes: random replies through the parser, Env and the simulator, with what must always hold.

    python -m sweeps.episodes                        400 pieces: a house each, 20 episodes in it, 10^5 steps and more
    python -m sweeps.episodes --piece 3 --case 2     one episode again

After every step: no exception; the world is finite and sane (`sweeps.support.snapshots`); a refused, invalid or closing
reply leaves it as it was, to the last bit; what is said to have changed is what changed; budgets are obeyed to the
step. For every episode, the record written and read again is equal and is scored the same; W_strict implies W, B
implies W, progress lies in 0..1, labels partition; a second simulator, loaded afresh and playing the same replies in
another order of episodes, comes to the same record and the same world after every step, to the last bit.
"""

import random
import sys
import traceback
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from datetime import UTC, datetime
from functools import partial

from sweeps.simulators import loaded, parser, sweep
from sweeps.support import pieces
from sweeps.support.pieces import Failure, PieceResult
from sweeps.support.random_agent import RandomAgent
from sweeps.support.random_episodes import draw_house
from sweeps.support.snapshots import SanityCheck, Snapshot, changed, difference, snapshot
from vigil.base.json_lines import dump_line
from vigil.env import Env
from vigil.errors import EpisodeError
from vigil.protocol.actions import InteractPixel, Reply, Report
from vigil.protocol.episode import Episode
from vigil.protocol.house import House
from vigil.protocol.profile import ACTION_FEEDBACK, BASELINE, Profile
from vigil.records.record import EpisodeRecord, StepRecord
from vigil.scoring.goal_check import check
from vigil.scoring.outcomes import score
from vigil.scoring.summary import assert_identities
from vigil.sim.privileged import PrivilegedSimulator

PER_PIECE = 20
NOW = datetime(2026, 1, 1, tzinfo=UTC)
Faults = Iterator[tuple[str, str]]


def main() -> int:
    """Run the sweep."""
    options = parser(__doc__ or "", 400).parse_args()
    work = partial(fuzz, options.seed, options.backend, options.case, PER_PIECE)
    return pieces.run(sweep("episodes", work, options), options)


@dataclass(slots=True)
class PlayedEpisode:
    """An episode that was played, with the whole hidden state at its start and after every step."""

    episode: Episode
    profile: Profile
    record: EpisodeRecord
    moments: list[Snapshot] = field(default_factory=list)


def fuzz(seed: int, backend: str, case: int | None, count: int, piece: int) -> PieceResult:
    """Return the result of a piece: `count` episodes in one house, or one `case` of them."""
    result = PieceResult()
    house, sample_episode = draw_house(random.Random(f"{seed}/{piece}"))
    played: dict[int, PlayedEpisode] = {}
    first, second = loaded(backend, house), loaded(backend, house)
    for number in range(count) if case is None else (case,):
        rng = random.Random(f"{seed}/{piece}/{number}")
        try:
            done = _play(rng, first, house, sample_episode(rng, first), result.counts)
            played[number] = done.played
            faults = done.faults
        except EpisodeError:
            result.counts["episodes that cannot be set up"] += 1
            continue
        except Exception:  # noqa: BLE001 - any exception at all is what is looked for
            faults = [("an exception", traceback.format_exc(limit=-4))]
        result.failures += [Failure(kind, detail, f"--piece {piece} --case {number}") for kind, detail in faults]
    for number in reversed(played):
        for kind, detail in _replay_faults(played[number], second, house):
            result.failures.append(Failure(kind, detail, f"--piece {piece} --case {number}"))
        result.counts["replays"] += 1
    return result


def _env(simulator: PrivilegedSimulator, house: House, profile: Profile) -> Env:
    """Return an Env over a simulator that has loaded the house already."""
    return Env(_LoadedSimulator(simulator), lambda _: house, profile, lambda: NOW)  # pyright: ignore[reportArgumentType]


class _LoadedSimulator:
    """A simulator that keeps its house: loading it again does nothing."""

    def __init__(self, simulator: PrivilegedSimulator) -> None:
        self._simulator = simulator
        self.name, self.reset, self.step = simulator.name, simulator.reset, simulator.step
        self.world, self.frame, self.object_at = simulator.world, simulator.frame, simulator.object_at
        self.renderer, self.close = simulator.renderer, simulator.close

    def load(self, house: House) -> None:
        """Leave the scene as it is."""


@dataclass(slots=True)
class _PlayResult:
    played: PlayedEpisode
    faults: list[tuple[str, str]]


def _play(
    rng: random.Random, simulator: PrivilegedSimulator, house: House, episode: Episode, counts: Counter[str]
) -> _PlayResult:
    profile = Profile(
        name=rng.choice((BASELINE, ACTION_FEEDBACK)),
        coordinates=rng.choice(["pixel", "pixel", "normalized_1000"]),
        reply_policy=rng.choice(["strict", "lenient"]),
    )
    env, faults = _env(simulator, house, profile), list[tuple[str, str]]()
    agent = RandomAgent(rng, simulator, episode.bound_ids(), nonsense=rng.choice([0.0, 0.05, 0.3]))
    observation = env.reset(episode)
    sanity, moments, steps = SanityCheck(simulator), [snapshot(simulator)], list[StepRecord]()
    faults += sanity.faults(episode.start.position.y, moments[0])
    while observation is not None:
        observation = env.step(Reply.model_validate({"text": agent.reply()}))
        moments.append(snapshot(simulator))
        step = env._steps[-1]
        steps.append(step)
        held = {thing.id for thing in simulator.scene().things.values() if thing.is_held}
        faults += _step_faults(step, _StepChange(moments[-2], moments[-1], held), profile, observation)
        faults += sanity.faults(episode.start.position.y, changed(moments[-2], moments[-1]))
        faults += _budget_faults(steps, episode, env.end)
        counts["steps"] += 1
        counts["steps that changed the house"] += bool(step.effect and step.effect.changed)
        counts["invalid replies"] += step.invalid is not None
        if step.effect is not None and step.effect.refusal is not None:
            counts[f"refused: {step.effect.refusal}"] += 1
    record = env.record(run_id="sweep")
    counts["episodes"] += 1
    counts[f"ended by {record.end}"] += 1
    return _PlayResult(PlayedEpisode(episode, profile, record, moments), [*faults, *_record_faults(episode, record)])


@dataclass(frozen=True, slots=True)
class _StepChange:
    """The effect of a step: the hidden state before and after it, what is in the hand, and what is on what."""

    before: Snapshot
    after: Snapshot
    held: set[str]


def _step_faults(step: StepRecord, moment: _StepChange, profile: Profile, observation: object) -> Faults:
    effect, before, after, held = step.effect, moment.before, moment.after, moment.held
    what = f"step {step.index}, {step.action or step.invalid!r}, {effect!r}"
    found = changed(before, after)
    is_still = effect is None or effect.refusal is not None
    is_still |= isinstance(step.action, InteractPixel) and step.action.intent == "ground"
    if is_still and found:
        yield "what did nothing changed something", f"{what}: {difference(before, after)}"
    if effect is not None and isinstance(step.action, InteractPixel) and not is_still:
        reported = set(effect.changed)
        if found - reported - held - {"agent"}:
            yield "something changed that was not said", f"{what}: {sorted(found - reported)}"
        if reported - found:
            yield "something was said to change and did not", f"{what}: {sorted(reported - found)}"
    if effect is not None and not isinstance(step.action, InteractPixel) and effect.changed:
        yield "moving the body changed things", what
    feedback = getattr(observation, "feedback", None)
    if observation is not None and (feedback is not None) != profile.has_feedback:
        yield "feedback against the profile", what
    if feedback is not None:
        shown = (feedback.too_far, feedback.path_blocked)
        if shown != ((False, False) if effect is None else (effect.too_far, effect.path_blocked)):
            yield "feedback is wrong", f"{what}: {feedback!r}"


def _budget_faults(steps: list[StepRecord], episode: Episode, end: str | None) -> Faults:
    invalid = sum(step.invalid is not None for step in steps)
    expected = None
    if isinstance(steps[-1].action, Report):
        expected = "report"
    elif invalid > episode.max_invalid:
        expected = "invalid_action_limit_exceeded"
    elif len(steps) >= episode.max_steps:
        expected = "fail_no_report"
    if end != expected:
        yield "a budget is not obeyed", f"step {len(steps)}, {invalid} invalid: ended as {end}, expected {expected}"


def _record_faults(episode: Episode, record: EpisodeRecord) -> Faults:
    line = dump_line(record)
    again = EpisodeRecord.model_validate_json(line)
    if again != record or dump_line(again) != line:
        yield "the record read again differs", record.episode_id
    outcome = score(episode, record)
    if score(episode, record) != outcome or score(episode, again) != outcome:
        yield "settled twice, two verdicts", record.episode_id
    assert_identities([outcome])
    if outcome.W_strict > outcome.W or outcome.B > outcome.W:
        yield "B or W_strict without W", repr(outcome)
    rows = check(episode.goal, record).rows
    if any(row.progress is not None and not 0.0 <= row.progress <= 1.0 for row in rows):
        yield "progress out of 0..1", repr(rows)
    if any(row.strict > row.semantic or (row.progress == 1.0) > row.semantic for row in rows):
        yield "strict or progress 1 without the goal", repr(rows)


def _replay_faults(played: PlayedEpisode, simulator: PrivilegedSimulator, house: House) -> Faults:
    try:
        env = _env(simulator, house, played.profile)
        observation = env.reset(played.episode)
        moments = [snapshot(simulator)]
        for step in played.record.steps:
            if observation is None:
                break
            observation = env.step(step.reply)
            moments.append(snapshot(simulator))
        for number, (old, new) in enumerate(zip(played.moments, moments, strict=False)):
            if old != new:
                yield "played again the world differs", f"after step {number}: {difference(old, new)}"
                return
        if env.record(run_id="sweep") != played.record:
            yield "played again the record differs", played.episode.id
    except Exception:  # noqa: BLE001 - any exception at all is what is looked for
        yield "an exception in the replay", traceback.format_exc(limit=-4)


if __name__ == "__main__":
    sys.exit(main())
