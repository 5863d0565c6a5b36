"""Packaged twins: played alike, and held to the rules of their time."""

from copy import copy

import pytest

from vigil.authoring.packing.verify import VerificationSettings, verify_pack
from vigil.authoring.review.validate import Validator
from vigil.packs.pack import Pack
from vigil.scoring.closure import PAIRED, ClosureAnswer, ClosureOutcome, Kind, closure_answers, score_closure
from vigil.sim.privileged import PrivilegedSimulator

EACH = 20
"""One pair of so many is played."""


@pytest.fixture(scope="module")
def pack() -> Pack:
    return Pack.load("vigil_closure_400_v5")


@pytest.fixture(scope="module")
def answers(pack: Pack) -> dict[str, ClosureAnswer]:
    return closure_answers(pack.folder)


@pytest.mark.parametrize("kind", ["already", "if_so"])
def test_the_actions_of_one_side_close_no_packaged_pair_knowingly(
    kind: Kind, pack: Pack, answers: dict[str, ClosureAnswer], simulator: PrivilegedSimulator
) -> None:
    validator = Validator(simulator)

    def closed(name: str, by_solution_of: str) -> ClosureOutcome:
        episode = pack.episode(name)
        record = validator.play(episode, pack.house_of(episode), pack.solutions[by_solution_of].actions)
        return score_closure(answers[name], episode, record)

    sides = {(answer.pair, answer.side): name for name, answer in answers.items() if answer.kind == kind}
    first, second = PAIRED[kind]
    played = sorted((name, sides[pair, second]) for (pair, side), name in sides.items() if side == first)[::EACH]
    assert played
    for solved, other in played:
        assert closed(solved, solved).is_knowing
        again = closed(other, solved)
        assert not again.is_knowing
        assert again.C is (kind == "already")


def test_what_lies_elsewhere_is_verified(pack: Pack, answers: dict[str, ClosureAnswer]) -> None:
    pairs = {answer.pair for answer in answers.values() if answer.reason == "elsewhere"}
    part = copy(pack)
    part.episodes = tuple(episode for episode in pack.episodes if answers[episode.id].pair in pairs)
    assert len(part.episodes) == 2 * len(pairs) > 0
    assert verify_pack(part, VerificationSettings()) == []
