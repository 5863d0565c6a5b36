"""Streams of lists of chores: answers go with their lists, into folders and into rewards."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from vigil.authoring.chores import generation
from vigil.authoring.solving.primitive_actions import reply_of
from vigil.authoring.streaming.folder import write_stream
from vigil.authoring.streaming.stream import Stream
from vigil.errors import SettingError
from vigil.integrations.gymnasium.env import VigilEnv
from vigil.packs.pack import CHORES_SUITE, Pack
from vigil.protocol.actions import Report
from vigil.protocol.goals import Chores
from vigil.scoring.chore_answers import answer_of, list_answers


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The first list of three chores of a stream."""
    out = tmp_path_factory.mktemp("stream") / "lists"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(generation, "LENGTHS", (3,))
        write_stream(out, Stream(7, suite="chores", workers=0, last=3), 1)
    return out


@pytest.fixture(scope="module")
def env(folder: Path) -> Iterator[VigilEnv]:
    options = {"profile": "itemised_report", "claim_reward": 0.5, "frames": False, "evaluator": True}
    made = VigilEnv(pack=folder, **options)
    yield made
    made.close()


def test_a_folder_of_lists_has_their_answers(folder: Path) -> None:
    pack = Pack.load(folder)
    assert pack.manifest.suite == CHORES_SUITE
    assert pack.manifest.meta["difficulties"] == {"easy": 1}
    (episode,) = pack.episodes
    assert isinstance(episode.goal, Chores)
    assert len(answer_of(episode, list_answers(folder)).chores) == 3
    assert episode.id.startswith("stream7v")


def test_a_stream_has_families_or_a_suite() -> None:
    with pytest.raises(SettingError, match="families or of a suite"):
        Stream(7, families=("PG",), suite="chores", workers=0)


@pytest.mark.parametrize("wrong", [0, 1])
def test_each_claim_is_rewarded(folder: Path, env: VigilEnv, wrong: int) -> None:
    """The list is closed if all claims are right, and the others still earn their shares if one is missing."""
    pack = Pack.load(folder)
    *actions, last = pack.solutions[pack.episodes[0].id].actions
    assert isinstance(last, Report)
    kept = {number: claim for number, claim in (last.claims or {}).items() if number > wrong}
    env.reset(seed=1)
    reward, info = 0.0, {}
    for action in (*actions, last.model_copy(update={"claims": kept})):
        _, reward, _, _, info = env.step(reply_of(action).text)
    assert reward == pytest.approx((not wrong) + 0.5 * (3 - wrong) / 3)
    assert info["outcome"]["list_B"] == (not wrong)
    assert info["outcome"]["T"] == pytest.approx((3 - wrong) / 3)
