"""The order in which a run plays its episodes."""

import json
from pathlib import Path

from quick_runs import quick
from tiny_pack import loose_pack, tiny_episode, tiny_house

from vigil.record import EPISODES_FILE
from vigil.runner.run import run_pack
from vigil.runner.verify_run import VerifySettings, verify_run


def test_a_run_goes_from_house_to_house_and_its_records_are_told_by_episode(tmp_path: Path) -> None:
    houses = [tiny_house("one"), tiny_house("two")]
    episodes = [tiny_episode(number, house=houses[number % 2]) for number in range(6)]
    loose_pack(tmp_path / "pack", episodes, houses)
    result = run_pack(quick(tmp_path / "pack", tmp_path / "run", agent="noop", epochs=2))
    lines = (tmp_path / "run" / EPISODES_FILE).read_text().splitlines()
    played = [(row["epoch"], row["episode_id"]) for row in map(json.loads, lines)]
    assert played == [(epoch, f"tiny-DA-{number:03d}") for epoch in (1, 2) for number in (0, 2, 4, 1, 3, 5)]
    assert [record.episode_id for record in result.records[::2]] == [episode.id for episode in episodes]
    assert verify_run(tmp_path / "run", VerifySettings(workers=1)).is_verified
