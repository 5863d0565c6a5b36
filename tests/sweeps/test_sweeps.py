"""The sweeps at a tiny size: that they run, find a planted fault, go on where they stopped, and repeat a case alone."""

import json
import random
from collections import Counter
from functools import partial
from pathlib import Path

import pytest

from sweeps import episodes, handling, hostile, replies_fuzz
from sweeps.support import pieces
from sweeps.support.confined import run_confined
from sweeps.support.hostile_cases import base_pack, write
from sweeps.support.pieces import Failure, PieceResult, Sweep
from sweeps.support.reply_forms import ReplyForm
from vigil.errors import SettingError
from vigil.packs.pack import Pack
from vigil.protocol.house import House


def odd_fall(piece: int) -> PieceResult:
    failures = [Failure("odd", f"number {piece}", f"--piece {piece}")] if piece % 2 else []
    return PieceResult(Counter(pieces=1, total=piece), failures)


def run(work: pieces.Work, log: Path, count: int, *, workers: int = 1, seed: int = 0) -> int:
    options = pieces.parser("", count).parse_args(["--log", str(log), "--workers", str(workers)])
    return pieces.run(Sweep("trial", {"seed": seed}, work), options)


def test_a_sweep_goes_on_where_it_stopped_and_a_torn_line_is_done_again(tmp_path: Path, capsys):
    log = tmp_path / "log.jsonl"
    assert run(odd_fall, log, 1) == 0
    assert run(odd_fall, log, 3) == 1
    assert "FELL 1 x odd" in (out := capsys.readouterr().out)
    assert "again: python -m sweeps.trial --seed 0 --piece 1" in out
    log.write_bytes(log.read_bytes()[:-5])
    done: list[int] = []
    assert run(lambda piece: done.append(piece) or odd_fall(piece), log, 3) == 1
    assert done == [2]
    assert [json.loads(line)["piece"] for line in log.read_text().splitlines()[1:]] == [0, 1, 2]
    assert "pieces 3, total 3" in capsys.readouterr().out


def test_the_log_of_another_sweep_is_refused(tmp_path: Path):
    run(odd_fall, tmp_path / "log.jsonl", 1)
    with pytest.raises(SystemExit, match="Give another --log"):
        run(odd_fall, tmp_path / "log.jsonl", 1, seed=1)


def test_fuzzed_replies_hold_apart_from_what_is_planted():
    finding = replies_fuzz.fuzz(0, None, 300, 0)
    assert finding.counts["replies"] == 300
    assert finding.counts["accepted"] > 30
    assert finding.failures == []
    planted = ReplyForm('{"skill_name": "fly"}', is_action=True, same_as='{"skill_name": "fly"}')
    assert [kind for kind, _ in replies_fuzz.faults_of(planted, Counter())] == ["refused against the protocol"]


def test_a_fuzzed_reply_is_the_same_alone():
    alone = replies_fuzz.fuzz(0, 7, 300, 1)
    assert alone.counts["replies"] == 1
    assert alone.counts == replies_fuzz.fuzz(0, 7, 300, 1).counts


def test_fuzzed_episodes_hold_and_are_the_same_played_again():
    finding = episodes.fuzz(0, "fake", None, 2, 1)
    assert finding.failures == []
    assert finding.counts["episodes"] == finding.counts["replays"] == 2


def test_fuzzed_handling_holds():
    finding = handling.fuzz(0, "fake", 6, 0)
    assert finding.failures == []
    assert finding.counts["interactions"] >= 3


def test_hostile_packs_and_houses_are_refused_or_played():
    finding = hostile.fuzz(0, None, None, 3, 0)
    assert finding.failures == []
    assert finding.counts["cases"] == 3


def test_the_good_pack_under_the_hostile_ones_is_good(tmp_path: Path):
    write(tmp_path, base_pack(0))
    pack = Pack.load(tmp_path)
    assert isinstance(pack.house_of(pack.episodes[0]), House)
    assert run_confined(partial(hostile._use_pack, tmp_path, False)).kind == "done"


@pytest.mark.parametrize(
    ("call", "kind"),
    [
        (lambda: "fine", "done"),
        (lambda: [][1], "exception"),
        (lambda: bytearray(2**33).hex(), "memory"),
        (lambda: random.Random(0).choice([]), "exception"),
    ],
)
def test_confined_calls_tell_how_they_ended(call, kind: str):
    assert run_confined(call).kind == kind


def test_a_confined_call_is_refused_cut_off_or_dead():
    def refuse() -> str:
        raise SettingError("no")

    def hang() -> str:
        while True:
            pass

    def die() -> str:
        raise SystemExit(3)

    assert run_confined(refuse).text == "SettingError: no"
    assert run_confined(hang, wall_s=0.5).kind == "hang"
    assert run_confined(die).text == "SystemExit 3"
