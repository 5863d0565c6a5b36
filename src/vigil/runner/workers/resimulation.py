"""Verification: recorded replies are simulated again, and every recorded fact is compared with the result.

Positions may differ by 1 mm and angles by 0.01 degrees, because another machine rounds differently. Booleans, ids,
words, endings and verdicts must be equal. Source: `protocol.md` section 7.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from vigil.base.json_files import is_array, is_object
from vigil.base.processes.child import report
from vigil.env import Env
from vigil.protocol.episode import Episode
from vigil.protocol.profile import Profile
from vigil.records.record import EpisodeRecord, StepRecord
from vigil.scoring.outcomes import score

LENGTH_TOLERANCE_M = 1e-3
ANGLE_TOLERANCE_DEG = 1e-2
_ANGLE_KEYS = frozenset({"rotation", "horizon", "yaw", "turned_deg", "pitched_deg"})
_COUNT_KEYS = frozenset({"visible_px", "open_px", "toggle_px"})
"""Names of pixel counts. They are measured with rays, so a rounding error that shifts an edge changes them a little."""
_COUNT_TOLERANCE = 0.02
_RECORDED_SINCE = {"not_on": 3}
"""Fact -> first version of the rules under which this fact is recorded."""


@dataclass(frozen=True, slots=True)
class FactDifference:
    """Recorded fact that differs in the new simulation."""

    episode_id: str
    epoch: int
    step: int
    """Number of the step; 0 for the world at the reset."""
    fact: str
    """Path within the step, e.g. `world.objects.Mug|1.position.0`."""
    recorded: Any
    found: Any

    def __str__(self) -> str:
        where = f"Episode {self.episode_id!r} (epoch {self.epoch}) step {self.step}"
        return f"{where}: {self.fact}: recorded {self.recorded!r}, found {self.found!r}"


@dataclass(frozen=True, slots=True)
class ComparisonSettings:
    """Settings for comparing a recorded episode with what happens when its actions are played again."""

    frames: bool = False
    """Whether to compare the frames' pixels, too."""
    exact: bool = False
    """Whether numbers must be bit-identical, as they are on the machine that made the record."""
    profile: Profile | None = None
    """Profile of the record; None if it is the profile of the Env."""
    recorded_profile: Profile | None = None
    """Profile of the play that the record continues; None if it does not continue one."""


def resimulate(episode: Episode, record: EpisodeRecord, env: Env, settings: ComparisonSettings) -> list[FactDifference]:
    """Return how `record` differs from a new simulation of its replies."""
    if settings.profile is not None:
        env.use_profile(settings.profile, settings.recorded_profile)
    observation = env.reset(episode, record.replayed_steps)
    for step in record.steps:
        if observation is None:
            break
        if settings.frames and step.frame_sha256 is not None:
            observation.rgb  # noqa: B018 - reading a frame draws it
        observation = env.step(step.reply)
        report()
    if env.end is None:
        env.fail("runner", "the record ends here")
    again = env.record(run_id=record.run_id, epoch=record.epoch, attempt=record.attempt)
    return list(replay_differences(record, again, settings)) or list(_changed_verdict(episode, record, again))


def _changed_verdict(episode: Episode, record: EpisodeRecord, again: EpisodeRecord) -> Iterator[FactDifference]:
    """Yield the verdicts that differ although all facts are equal within the tolerances."""
    if record.end == "error":
        return
    recorded, found = score(episode, record), score(episode, again)
    for fact in ("W", "B", "label"):
        old, new = getattr(recorded, fact), getattr(found, fact)
        if old != new:
            yield FactDifference(record.episode_id, record.epoch, len(record.steps), f"verdict.{fact}", old, new)


def replay_differences(
    recorded: EpisodeRecord, found: EpisodeRecord, settings: ComparisonSettings
) -> Iterator[FactDifference]:
    """Yield the differences between two records of one episode; times are not compared."""
    compare = _FactComparison(settings.exact, recorded.versions.rules).compare

    def report(step: int, faults: Iterator[tuple[str, Any, Any]]) -> Iterator[FactDifference]:
        for fact, old, new in faults:
            yield FactDifference(recorded.episode_id, recorded.epoch, step, fact, old, new)

    yield from report(0, compare("prompt_sha256", recorded.prompt_sha256, found.prompt_sha256))
    yield from report(0, compare("initial", _as_json(recorded.initial), _as_json(found.initial)))
    for old, new in zip(recorded.steps, found.steps, strict=False):
        yield from report(old.index, compare("", _facts(old, settings.frames), _facts(new, settings.frames)))
    last = len(recorded.steps)
    if recorded.end != "error":
        yield from report(last, compare("steps", last, len(found.steps)))
        yield from report(last, compare("end", recorded.end, found.end))


def _as_json(fact: Any) -> Any:
    return None if fact is None else fact.model_dump(mode="json")


def _facts(step: StepRecord, frames: bool) -> dict[str, Any]:
    compared = {"action", "invalid", "ignored_keys", "history_cut", "effect", "world", "is_unconfirmed"}
    if frames and step.frame_sha256 is not None:
        compared.add("frame_sha256")
    return step.model_dump(mode="json", include=compared)


@dataclass(frozen=True, slots=True)
class _FactComparison:
    exact: bool
    rules: int
    """Version of the rules under which the record was made."""

    def compare(self, place: str, old: Any, new: Any, key: str = "") -> Iterator[tuple[str, Any, Any]]:
        """Yield (place, old, new) for each value that differs; `key` is the nearest name in the path to the value."""
        if is_object(old) and is_object(new):
            for name in sorted(name for name in old.keys() | new.keys() if _RECORDED_SINCE.get(name, 0) <= self.rules):
                yield from self.compare(f"{place}.{name}".lstrip("."), old.get(name), new.get(name), name)
        elif is_array(old) and is_array(new) and len(old) == len(new):
            for index, (before, now) in enumerate(zip(old, new, strict=True)):
                yield from self.compare(f"{place}.{index}", before, now, key)
        elif not self._is_same(key, old, new):
            yield place, old, new

    def _is_same(self, key: str, old: Any, new: Any) -> bool:
        are_numbers = all(isinstance(value, int | float) and not isinstance(value, bool) for value in (old, new))
        if self.exact or not are_numbers:
            return old == new
        if key in _COUNT_KEYS:
            return abs(old - new) <= max(1.0, _COUNT_TOLERANCE * max(old, new))
        if key in _ANGLE_KEYS:
            return abs((old - new + 180.0) % 360.0 - 180.0) <= ANGLE_TOLERANCE_DEG
        return math.isclose(old, new, rel_tol=0.0, abs_tol=LENGTH_TOLERANCE_M)
