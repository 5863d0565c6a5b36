"""What the frozen starter pack consists of."""

from collections import Counter

import pytest

from vigil.authoring.packing.starter import HOUSES, QUOTAS
from vigil.housegen.document import generators_of
from vigil.packs.pack import Pack
from vigil.protocol.actions import InteractPixel, Report
from vigil.protocol.episode import Episode
from vigil.protocol.families import FAMILIES, Family
from vigil.protocol.goals import is_observable
from vigil.sim.privileged import PrivilegedSimulator


def of(starter: Pack, family: Family) -> list[Episode]:
    return [episode for episode in starter.episodes if episode.family == family]


def test_ten_of_each_family(starter: Pack) -> None:
    assert Counter(episode.family for episode in starter.episodes) == Counter(
        {family: sum(slot.count for slot in QUOTAS if slot.family == family) for family in FAMILIES}
    )
    assert len(starter.episodes) == 80
    assert sum(slot.count for slot in QUOTAS) == 80


def test_houses_are_many_and_varied(starter: Pack) -> None:
    names = {episode.house.name for episode in starter.episodes}
    rooms = {
        name: len(starter.house_of(episode).document.rooms)
        for episode in starter.episodes
        for name in [episode.house.name]
    }
    assert len(names) >= 20
    assert sum(count == 2 for count in rooms.values()) * 2 == len(rooms)
    uses = Counter((episode.family, episode.house.name) for episode in starter.episodes)
    assert max(uses.values()) <= 2
    assert len(HOUSES) == len(names)


def test_houses_are_frozen_as_the_generator_made_them_that_the_manifest_names(starter: Pack) -> None:
    """Today's generator, a later version, makes others."""
    houses = [starter.house_of(episode) for episode in starter.episodes]
    assert generators_of(houses) == starter.manifest.meta["house_generator"] == "5"


def test_targets_are_many(starter: Pack) -> None:
    categories = {episode.goal.object_id.split("|")[0] for episode in starter.episodes}
    assert len(categories) >= 20


def test_sequence_templates_are_all_there(starter: Pack) -> None:
    """All that there were when it was made; later drafts know longer ones."""
    made_of = {"reveal_pick", "put_into", "rearrange", "open_pick_place"}
    assert {episode.provenance.template for episode in of(starter, "SM")} == made_of < set(FAMILIES["SM"].kinds)


def test_constraints_are_of_many_kinds(starter: Pack) -> None:
    templates = {episode.provenance.template for episode in of(starter, "CR")}
    assert templates <= set(FAMILIES["CR"].kinds)
    assert len(templates) >= 3


def test_verification_labels_are_balanced(starter: Pack) -> None:
    labels = Counter(solution.actions[-1].status for solution in solutions_of(starter, "SV"))
    assert labels == {"on": 3, "off": 3, "open": 2, "closed": 2}


def solutions_of(starter: Pack, family: Family) -> list:
    return [starter.solutions[episode.id] for episode in of(starter, family)]


def test_pointing_difficulties(starter: Pack) -> None:
    assert Counter(episode.target_size for episode in of(starter, "PG")) == {"large": 3, "medium": 4, "small": 3}


def test_most_searches_need_walking(starter: Pack) -> None:
    templates = Counter(episode.provenance.template for episode in of(starter, "VS"))
    assert templates["walk"] >= 5


def test_walks_to_search_cannot_be_saved_by_turning(starter: Pack, simulator: PrivilegedSimulator) -> None:
    for episode in of(starter, "VS"):
        simulator.load(starter.house_of(episode))
        simulator.reset(episode.start, episode.setup)
        target, found = episode.goal.object_id, False
        for yaw in range(0, 360, 45):
            for horizon in (-30.0, 0.0, 45.0):
                with simulator.at_pose(episode.start.model_copy(update={"rotation": float(yaw), "horizon": horizon})):
                    found = found or is_observable(simulator.world([target]).objects[target])
        assert found == (episode.provenance.template == "turn"), episode.id


def test_ids_follow_the_form_and_are_unique(starter: Pack) -> None:
    ids = [episode.id for episode in starter.episodes]
    assert len(set(ids)) == len(ids)
    for episode in starter.episodes:
        head, category, seed = episode.id.split("_")[:3]
        assert head == "vigil"
        assert category == starter_category(episode)
        assert seed == f"seed{episode.provenance.seed:03d}"


def starter_category(episode: Episode) -> str:
    return episode.goal.object_id.split("|")[0].lower()


def test_every_solution_fits_its_budget_and_skills(starter: Pack) -> None:
    for episode in starter.episodes:
        actions = starter.solutions[episode.id].actions
        spec = FAMILIES[episode.family]
        assert isinstance(actions[-1], Report)
        assert not any(isinstance(action, Report) for action in actions[:-1])
        assert len(actions) <= max(2, int(0.8 * episode.max_steps))
        used = {
            "interact_pixel(ground)"
            if isinstance(action, InteractPixel) and action.intent == "ground"
            else action.skill_name
            for action in actions
        }
        assert used <= set(spec.skills)


def test_provenance_is_complete(starter: Pack) -> None:
    for episode in starter.episodes:
        assert episode.provenance.validated
        assert episode.provenance.solution_steps == len(starter.solutions[episode.id].actions)


@pytest.mark.parametrize("word", ["closed", "open", "on", "off"])
def test_questions_never_give_the_state_away(starter: Pack, word: str) -> None:
    pairs = {"closed": "open", "open": "closed", "on": "off", "off": "on"}
    for episode in of(starter, "SV"):
        words = episode.instruction.lower().replace(".", " ").replace(",", " ").replace("?", " ").split()
        if word in words and not (word == "on" and "off" not in words and "closed" in words):
            assert pairs[word] in words
