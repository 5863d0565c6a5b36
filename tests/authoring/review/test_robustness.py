"""Robustness: what forgives a body that errs, what does not, and where an episode may start."""

from pathlib import Path

import pytest

from tests.authoring.review.pocket import house_with_gap, to_the_lamp
from vigil.authoring.review import robustness
from vigil.authoring.review.robustness import NEEDED_SUCCESSES, ROBUST_RULES, TRIES, noisy_try
from vigil.authoring.review.validate import Validator, reason_of
from vigil.authoring.solving.macro_actions import Unsolvable
from vigil.authoring.solving.privileged_view import PrivilegedView
from vigil.base.geometry import Pose, Vec3, heading
from vigil.env import Env
from vigil.packs.pack import Pack
from vigil.protocol.actions import Navigate, Report
from vigil.protocol.episode import Episode
from vigil.protocol.profile import Profile
from vigil.scene import floor
from vigil.sim.privileged import PrivilegedSimulator

STEP = Navigate(mode="turn_left", magnitude=10.0)
CLAIM = Report(status="success", summary="")


def first_of(starter: Pack, family: str) -> Episode:
    return next(episode for episode in starter.episodes if episode.family == family)


def rules_broken(episode: Episode, starter: Pack, simulator: PrivilegedSimulator) -> set[str]:
    return {found.rule for found in Validator(simulator).robustness(episode, starter.house_of(episode))}


@pytest.mark.parametrize("family", ["SV", "AI"])
def test_a_fair_episode_is_robust(family: str, starter: Pack, simulator: PrivilegedSimulator) -> None:
    assert rules_broken(first_of(starter, family), starter, simulator) == set()


def test_a_budget_for_exact_walks_alone_is_not_robust(starter: Pack, simulator: PrivilegedSimulator) -> None:
    episode = first_of(starter, "AI").model_copy(update={"max_steps": 2})
    assert rules_broken(episode, starter, simulator) == {"robust"}


def test_a_narrow_way_costs_a_body_that_errs_more_than_a_wide_one(
    starter: Pack, simulator: PrivilegedSimulator
) -> None:
    steps: dict[float, int] = {}
    for gap_m in (0.47, 0.9):
        house = house_with_gap(gap_m)
        episode = to_the_lamp(first_of(starter, "AI"), house)
        env = Env(simulator, lambda _episode, house=house: house, Profile())
        steps[gap_m] = sum(len(noisy_try(episode, PrivilegedView(simulator), env, number).steps) for number in range(4))
    assert steps[0.9] < steps[0.47]
    assert Validator(simulator).robustness(episode, house) == ()


def test_one_try_in_ten_may_fail(
    starter: Pack, simulator: PrivilegedSimulator, monkeypatch: pytest.MonkeyPatch
) -> None:
    episode = first_of(starter, "SV")
    (label,) = starter.solutions[episode.id].actions
    played: list[int] = []

    def failing(*bad: int):
        def solve(_episode: Episode, _view: PrivilegedView, number: int):
            played.append(number)
            yield CLAIM if number in bad else label

        return solve

    for bad, broken, tries in (
        ((0,), False, TRIES),
        ((), False, NEEDED_SUCCESSES),
        ((2, 3), True, 4),
        ((0, 9), True, TRIES),
    ):
        played.clear()
        monkeypatch.setattr(robustness, "solve_noisily", failing(*bad))
        assert ("robust" in rules_broken(episode, starter, simulator)) == broken
        assert played == list(range(tries))


def test_who_knows_no_way_concedes(
    starter: Pack, simulator: PrivilegedSimulator, monkeypatch: pytest.MonkeyPatch
) -> None:
    def lost(_episode: Episode, _view: PrivilegedView, _number: int):
        yield STEP
        raise Unsolvable("No way.")

    monkeypatch.setattr(robustness, "solve_noisily", lost)
    env = Env(simulator, starter.house_of, Profile())
    record = noisy_try(first_of(starter, "AI"), PrivilegedView(simulator), env, 0)
    assert [step.action for step in record.steps] == [STEP, Report(status="fail", summary="No way.")]


def test_a_try_is_the_same_each_time_and_tries_differ(starter: Pack, simulator: PrivilegedSimulator) -> None:
    episode, env = first_of(starter, "DA"), Env(simulator, starter.house_of, Profile())
    tries = [noisy_try(episode, PrivilegedView(simulator), env, number) for number in (3, 3, 4)]
    first, again, other = ([step.action for step in record.steps] for record in tries)
    assert first == again != other


def test_a_start_with_the_nose_at_a_bare_wall_is_refused(starter: Pack, simulator: PrivilegedSimulator) -> None:
    """Right before the middle of a wall's longest bare stretch, looking at it."""
    episode = starter.episode("vigil_dogbed_seed102")
    simulator.load(starter.house_of(episode))
    simulator.reset(episode.start, episode.setup)
    view = PrivilegedView(simulator)
    broken = [
        rules_broken(episode.model_copy(update={"start": start}), starter, simulator)
        for start in _before_walls(view, episode.start)
    ]
    assert any("more_than_a_wall" in rules for rules in broken)
    assert not all("more_than_a_wall" in rules for rules in broken)


def _before_walls(view: PrivilegedView, like: Pose) -> list[Pose]:
    """Poses 0.3 m before the middles of inner faces of walls, where a body can stand, looking at them."""
    found: list[Pose] = []
    for panel in view.scene.panels:
        if panel.room_id == "exterior" or panel.holes:
            continue
        for share in (0.2, 0.5, 0.8):
            x, z = (a + share * (b - a) for a, b in zip(panel.start, panel.end, strict=True))
            place = x + 0.3 * panel.normal[0], z + 0.3 * panel.normal[1]
            if view.plan().can_stand(place):
                yaw = next(y for y in range(0, 360, 90) if _is_against(heading(float(y)), panel.normal))
                found.append(Pose(position=Vec3(place[0], 0.0, place[1]), rotation=float(yaw), horizon=like.horizon))
    return found


def _is_against(direction: tuple[float, float], normal: tuple[float, float]) -> bool:
    return direction[0] * normal[0] + direction[1] * normal[1] < -0.9


def test_who_is_hemmed_in_on_three_sides_has_no_room(
    starter: Pack, simulator: PrivilegedSimulator, monkeypatch: pytest.MonkeyPatch
) -> None:
    episode = first_of(starter, "SV")
    assert "room_at_start" not in rules_broken(episode, starter, simulator)
    monkeypatch.setattr(floor, "ROOM_TO_MOVE_M", 30.0)
    assert "room_at_start" in rules_broken(episode, starter, simulator)


def test_every_rule_has_a_reason_that_the_documents_tell() -> None:
    text = (Path(__file__).parents[3] / "docs" / "packs.md").read_text(encoding="utf-8")
    for name in ROBUST_RULES:
        assert f"| `{name}` | " in text
        assert f" | {reason_of(name)} |" in text
