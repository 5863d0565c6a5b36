"""Perturbed packs: one thing changes, the rest stays, and each episode is certified again."""

import copy
import math
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from vigil.authoring.language.rewording import read
from vigil.authoring.packing.verify import HouseBatch, VerificationSettings, pack_tasks, verify_pack
from vigil.authoring.perturbation import perturb
from vigil.authoring.perturbation.perturb import PerturbationSettings, PerturbedHouse, Perturber, perturb_pack
from vigil.authoring.perturbation.places import LEAST_CHANGE, NEAR_M, TURN_DEG, relit
from vigil.authoring.perturbation.wording import FAMILY_FORMS, other_instructions
from vigil.errors import EpisodeError, SettingError
from vigil.packs.files import Change
from vigil.packs.pack import Pack
from vigil.protocol.episode import Episode
from vigil.protocol.house import House
from vigil.scoring.closure import closure_answers

SEED = 5
FAMILIES = ("PG", "SV", "AI")


def part_of(pack: Pack, ids: set[str]) -> Pack:
    """Return a pack with some of its episodes only."""
    part = copy.copy(pack)
    part.episodes = tuple(episode for episode in pack.episodes if episode.id in ids)
    return part


@pytest.fixture(scope="module")
def small(starter: Pack) -> Pack:
    """One episode each of three families of the starter pack."""
    first = {episode.family: episode.id for episode in reversed(starter.episodes) if episode.family in FAMILIES}
    return part_of(starter, set(first.values()))


@pytest.fixture(scope="module")
def made(small: Pack, tmp_path_factory: pytest.TempPathFactory):
    @cache
    def make(change: Change) -> Pack:
        settings = PerturbationSettings(change, SEED, None, VerificationSettings())
        return perturb_pack(small, tmp_path_factory.mktemp("made") / change, f"made_{change}", settings)

    return make


def differences(first: Episode, second: Episode) -> set[str]:
    return {name for name in Episode.model_fields if getattr(first, name) != getattr(second, name)} - {"provenance"}


CHANGED: dict[Change, str] = {"wording": "instruction", "start": "start", "light": "house"}


@pytest.mark.parametrize("change", CHANGED)
def test_one_thing_changes_and_the_pack_is_valid(change: Change, small: Pack, made) -> None:
    pack = made(change)
    assert [each.id for each in pack.episodes] == [each.id for each in small.episodes]
    for before, after in zip(small.episodes, pack.episodes, strict=True):
        assert differences(before, after) == {CHANGED[change]}
    found = pack.manifest.perturbation
    assert (found.of, found.sha256, found.change, found.left_out) == (small.name, small.sha256, change, {})
    assert verify_pack(pack, VerificationSettings()) == []


def test_other_words_are_a_held_out_form_with_the_same_slots(small: Pack, made) -> None:
    for before, after in zip(small.episodes, made("wording").episodes, strict=True):
        first, second = (read(each.instruction, FAMILY_FORMS[each.family]) for each in (before, after))
        assert first is not None
        assert second is not None
        assert first.sentences == second.sentences
        assert first.form in first.sentences.public
        assert second.form in second.sentences.held_out
        assert dict(second.slots).items() <= dict(first.slots).items()


def test_another_start_is_near(small: Pack, made) -> None:
    for before, after in zip(small.episodes, made("start").episodes, strict=True):
        away_m = math.dist(
            (before.start.position.x, before.start.position.z), (after.start.position.x, after.start.position.z)
        )
        assert 0.0 < away_m <= NEAR_M[1]
        turned = after.start.rotation - before.start.rotation
        assert abs((turned + 180.0) % 360.0 - 180.0) <= TURN_DEG + 0.5
        assert after.start.horizon == before.start.horizon


def test_only_the_lamps_of_a_house_change(small: Pack, made) -> None:
    pack = made("light")
    for before, after in zip(small.episodes, pack.episodes, strict=True):
        first, second = (
            copy.deepcopy(each.house_of(episode).data) for each, episode in ((small, before), (pack, after))
        )
        lamps = [
            [light.pop("rgb") for light in house["proceduralParameters"]["lights"] if light["type"] == "point"]
            for house in (first, second)
        ]
        assert first == second
        assert all(
            max(abs(a[name] - b[name]) for name in "rgb") > LEAST_CHANGE / 2 for a, b in zip(*lamps, strict=True)
        )


def test_a_house_without_lamps_has_no_other_light(small: Pack) -> None:
    house = small.house_of(small.episodes[0])
    data = copy.deepcopy(house.data)
    data["proceduralParameters"]["lights"] = []
    assert relit(House(house.name, data), np.random.default_rng(0)) is None


def test_the_seed_decides(small: Pack, made, tmp_path: Path) -> None:
    again, other = (
        perturb_pack(
            small,
            tmp_path / str(seed),
            "made_wording",
            PerturbationSettings("wording", seed, None, VerificationSettings()),
        )
        for seed in (SEED, SEED + 1)
    )
    assert again.sha256 == made("wording").sha256
    assert [each.instruction for each in again.episodes] != [each.instruction for each in other.episodes]


def test_an_interrupted_command_continues_with_the_next_house(
    small: Pack, made, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    expected, worked = made("light").sha256, list[str]()
    work = Perturber.work

    def until_interrupted(perturber: Perturber, batch: HouseBatch) -> PerturbedHouse:
        if len(worked) == 1:
            raise KeyboardInterrupt
        worked.append(batch.name)
        return work(perturber, batch)

    settings, out = PerturbationSettings("light", SEED, None, VerificationSettings()), tmp_path / "out"
    monkeypatch.setattr(Perturber, "work", until_interrupted)
    with pytest.raises(KeyboardInterrupt):
        perturb_pack(small, out, "made_light", settings)
    monkeypatch.setattr(Perturber, "work", lambda perturber, batch: worked.append(batch.name) or work(perturber, batch))
    assert perturb_pack(small, out, "made_light", settings).sha256 == expected
    assert sorted(worked) == sorted({episode.house.name for episode in small.episodes})
    assert [each.name for each in tmp_path.iterdir()] == ["out"]


def test_what_cannot_be_certified_is_left_out_and_counted(
    small: Pack, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        perturb, "near_starts", lambda view, start, rng: iter([start.model_copy(update={"horizon": -20.0})])
    )
    settings = PerturbationSettings("start", SEED, None, VerificationSettings())
    with pytest.raises(EpisodeError, match="no episode could be perturbed"):
        perturb_pack(small, tmp_path / "all", "all", settings)
    wordless = small.episodes[0].model_copy(update={"instruction": "Do what you think is best."})
    part = copy.copy(small)
    part.episodes = (wordless, *small.episodes[1:])
    found = perturb_pack(
        part, tmp_path / "some", "some", PerturbationSettings("wording", SEED, None, VerificationSettings())
    )
    assert found.manifest.perturbation is not None
    assert found.manifest.perturbation.left_out == {"no_other_form": 1}
    assert len(found.episodes) == 2


def test_a_perturbed_pack_is_not_perturbed_again(made, tmp_path: Path) -> None:
    settings = PerturbationSettings("start", SEED, None, VerificationSettings())
    with pytest.raises(SettingError, match="itself a perturbation of 'starter'"):
        perturb_pack(made("wording"), tmp_path / "again", "again", settings)


@pytest.mark.parametrize("change", CHANGED)
def test_twins_change_together(change: Change, tmp_path: Path) -> None:
    pack = Pack.load("vigil_closure_400_v5")
    answers = closure_answers(pack.folder)
    pair = sorted(str(each.pair) for each in answers.values() if each.kind == "impossible" and each.reason == "broken")[
        0
    ]
    twins = part_of(pack, {name for name, each in answers.items() if each.pair == pair})
    assert [len(task.episodes) for task in pack_tasks(twins)] == [2]
    made = perturb_pack(
        twins, tmp_path / "twins", "twins", PerturbationSettings(change, 1, "closure", VerificationSettings())
    )
    assert differences(*made.episodes) == differences(*twins.episodes)
    for before, after in zip(twins.episodes, made.episodes, strict=True):
        assert differences(before, after) == {CHANGED[change]}
    assert {each.pair for each in closure_answers(made.folder).values()} == {pair}
    assert verify_pack(made, VerificationSettings()) == []


@pytest.mark.parametrize("name", ["starter", "vigil_closure_400_v5", "vigil_chores_200_v5"])
def test_nearly_all_packaged_instructions_have_other_words(name: str) -> None:
    pack = Pack.load(name)
    rng = np.random.default_rng(0)
    found = {
        episode.id: list(other_instructions(episode.instruction, episode.family, pack.manifest.suite, rng))
        for episode in pack.episodes
    }
    assert all(
        text not in others for (text, others) in ((pack.episode(key).instruction, each) for key, each in found.items())
    )
    assert sum(map(bool, found.values())) >= 0.95 * len(found)
