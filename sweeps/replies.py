"""Sweep: generated replies through the whole path, from a server's bytes to the record.

    python -m sweeps.replies --count 10000

Each run plays episodes against a loopback server that sends replies of all forms (`tests/support/reply_forms.py`).
Each record must hold exactly the text that was sent, parsed as `vigil.protocol.replies.parse_text` parses it. The exit
code is 1 when a record does not.
"""

import argparse
import contextlib
import os
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from random import Random

from tests.support.reply_forms import draw, mistakes
from tests.support.tiny_pack import loose_pack, tiny_episode, tiny_house
from tests.support.wire_server import CUT, STOP, ModelMessage, ScriptedModel, WireServer
from vigil.cli.progress import progress
from vigil.records.record import EPISODES_FILE
from vigil.records.record_file import read_records
from vigil.runner.run import run_pack
from vigil.runner.settings import RunSettings

STEPS = 8
EPISODES_A_RUN = 60


def main() -> int:
    """Run the sweep and print its figures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=10_000, help="replies to send, at least")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--stream", action="store_true", help="as streams of events")
    given = parser.parse_args()
    done, run, forms, wrong = 0, 0, Counter[str](), list[str]()
    with tempfile.TemporaryDirectory() as folder:
        pack = Path(folder) / "pack"
        episodes = [tiny_episode(number, "DA", max_steps=STEPS, max_invalid=STEPS) for number in range(EPISODES_A_RUN)]
        loose_pack(pack, episodes, [tiny_house()])
        with progress("replies", may_fork=True) as show:
            while done < given.count:
                count, found = _one_run(pack, Path(folder) / f"run-{run}", f"{given.seed} {run}", given.stream, forms)
                done, run = done + count, run + 1
                wrong += found
                show(done, given.count, f"{run} runs  {len(wrong)} wrong")
    print(f"{done} replies in {run} runs, {len(wrong)} wrong")
    print(f"forms: {', '.join(f'{name} {count}' for name, count in sorted(forms.items()))}")
    for one in wrong[:20]:
        print(one)
    return 1 if wrong else 0


def _one_run(pack: Path, log_dir: Path, seed: str, is_streamed: bool, forms: Counter[str]) -> tuple[int, list[str]]:
    def say(episode: int, step: int) -> ModelMessage:
        name, said = draw(Random(f"{seed} {episode} {step}"))
        forms[name] += 1
        return said

    model = ScriptedModel(say)
    with WireServer(model) as server, _quiet():
        run_pack(
            RunSettings(
                pack=pack,
                model="openai/loopback",
                base_url=f"{server.url}/v1",
                model_args={"stream": is_streamed},
                log_dir=log_dir,
                backend="fake",
                workers=1,
                max_connections=16,
                preflight=False,
            )
        )
    count, wrong = 0, []
    records = read_records(log_dir / EPISODES_FILE)
    if len(records) != EPISODES_A_RUN:
        wrong.append(f"{len(records)} records of {EPISODES_A_RUN} episodes")
    for record in records:
        sayings = model.said[int(record.episode_id[-3:])]
        if len(sayings) != len(record.steps):
            wrong.append(f"{record.episode_id}: {len(record.steps)} steps of {len(sayings)} replies, {record.error}")
        for said, step in zip(sayings, record.steps, strict=False):
            count += 1
            wrong += mistakes(said, step, (CUT if said.is_cut else STOP)["chat"])
    return count, wrong


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    with open(os.devnull, "w") as nowhere, contextlib.redirect_stdout(nowhere), contextlib.redirect_stderr(nowhere):
        yield


if __name__ == "__main__":
    sys.exit(main())
