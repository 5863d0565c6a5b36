"""Chances of k plays against counting every set of k plays."""

from itertools import combinations

import numpy as np
import pandas as pd
import pytest

from vigil.analysis.measures.metrics import plays_of_k

PLAYS = {"a": [1, 1, 0, 1], "b": [0, 0, 0, 0], "c": [1, 1, 1, 1], "d": [0, 1], "e": [1], "f": [1, 0, 0]}


def rows() -> pd.DataFrame:
    return pd.DataFrame(
        [
            {"episode_id": name, "epoch": epoch, "house": f"house {name}", "W": bool(won), "B": False}
            for name, wins in PLAYS.items()
            for epoch, won in enumerate(wins, start=1)
        ]
    )


@pytest.mark.parametrize("k", [1, 2, 3, 4])
def test_every_set_of_k_plays_is_counted(k: int) -> None:
    found = plays_of_k(rows(), "W")[k - 1]
    enough = [wins for wins in PLAYS.values() if len(wins) >= k]
    sets = [list(combinations(wins, k)) for wins in enough]
    assert (found.k, found.episodes, found.plays) == (k, len(enough), sum(map(len, enough)))
    assert found.every[0] == pytest.approx(np.mean([np.mean([all(one) for one in each]) for each in sets]))
    assert found.any[0] == pytest.approx(np.mean([np.mean([any(one) for one in each]) for each in sets]))


def test_one_play_gives_the_rate_and_more_plays_move_the_two_apart() -> None:
    found = plays_of_k(rows(), "W")
    assert found[0].every[0] == pytest.approx(found[0].any[0])
    assert all(one.every[0] <= one.any[0] for one in found)
    assert [one.every[0] for one in plays_of_k(rows(), "B")] == [0.0] * 4


def test_intervals_need_five_houses_and_resample_these() -> None:
    one, two, *_ = plays_of_k(rows(), "W")
    assert one.every[1] is not None
    assert two.every[1] is not None
    assert plays_of_k(rows().loc[rows()["episode_id"] < "e"], "W")[0].every[1] is None
    assert plays_of_k(rows().head(0), "W") == []
