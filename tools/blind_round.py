"""Makes blind rounds, in which readers name what is drawn without knowing it, and publishes what they answered.

    python -m tools.blind_round make --kind near --seed 7 --out rounds/near
    python -m tools.blind_round make --kind near --seed 7 --before OLDER --out rounds/near_before
    python -m tools.blind_round starts --seed 7 --out rounds/starts
    python -m tools.blind_round pairs --before OLDER --seed 7 --out rounds/pairs
    python -m tools.blind_round publish --round rounds/near rounds/starts --out docs/blind

A round is a folder of sheets, README.txt with what readers are asked, and answers.jsonl, which they fill in. What is
shown is in the key beside that folder, FOLDER.key.json, which no reader may open. The seed draws everything; the same
seed and the same tree give the same bytes. OLDER is the checkout of an older commit, from `git worktree add`.
"""

import argparse
import os
from collections.abc import Callable, Sequence
from pathlib import Path

from tools.blind import making, publishing, sheets
from tools.blind.sheets import BlindRound

PICTURES = {"near": 207, "far": 207, "state": 207, "held": 40}
"""Number of pictures in a round; 207 fill 23 sheets."""
STARTS, PAIRS = 100, 40


def main(words: Sequence[str] | None = None) -> None:
    """Read the command line and do what it says."""
    options = _parser().parse_args(words)
    options.command(options)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(required=True)
    make = commands.add_parser("make", help="Single things, or what is in the hand.")
    make.add_argument("--kind", choices=list(PICTURES), required=True)
    make.add_argument(
        "--before", type=Path, metavar="OLDER", help="A checkout of an older commit, which draws instead."
    )
    make.set_defaults(command=_making(_make))
    starts = commands.add_parser("starts", help="Start frames of episodes, in which faults of drawing are looked for.")
    starts.add_argument("--before", type=Path, metavar="OLDER", help="A checkout of an older commit, which draws too.")
    starts.set_defaults(command=_making(_starts))
    pairs = commands.add_parser("pairs", help="The same starts drawn by an older tree and by this one.")
    pairs.add_argument("--before", type=Path, metavar="OLDER", required=True, help="A checkout of an older commit.")
    pairs.set_defaults(command=_making(_pairs))
    for each in (make, starts, pairs):
        each.add_argument("--seed", type=int, required=True)
        each.add_argument("--count", type=int, help="How many; a whole round when left out.")
        each.add_argument("--pack", nargs="+", default=[], help="Packs to draw from; the packaged ones when left out.")
        each.add_argument("--out", type=Path, required=True)

    publish = commands.add_parser("publish", help="Compares answers with keys, and writes all of them.")
    publish.add_argument("--round", type=Path, nargs="+", required=True, metavar="FOLDER")
    publish.add_argument("--number", type=int, help="Of the round; one more than the last published when left out.")
    publish.add_argument("--out", type=Path, default=publishing.FOLDER)
    publish.set_defaults(command=_publish)
    return parser


def _making(made: Callable[[argparse.Namespace], BlindRound]) -> Callable[[argparse.Namespace], None]:
    """Return the command that makes a round, writes it, and prints the time that it took."""

    def command(options: argparse.Namespace) -> None:
        sheets.refuse_existing(options.out)
        found = made(options)
        sheets.write(options.out, found)
        pictures = sum(len(shown.pictures) for shown in found.shown)
        spent = os.times()
        seconds = spent.user + spent.system + spent.children_user + spent.children_system
        print(f"{pictures} pictures in {options.out}; its key is {sheets.key_of(options.out)}.")
        print(f"{seconds:.0f} s of processor time, {100 * seconds / max(pictures, 1):.0f} s for 100 pictures.")
        if found.left_out:
            print(f"Left out: {len(found.left_out)}; the key says why.")

    return command


def _make(options: argparse.Namespace) -> BlindRound:
    count = options.count or PICTURES[options.kind]
    if options.kind != "held":
        return making.object_round(options.kind, options.seed, count, options.before)
    if options.before:
        raise SystemExit("Rounds of kind held play episodes, which an older tree would play otherwise: no --before.")
    return making.held_round(options.seed, count, options.pack)


def _starts(options: argparse.Namespace) -> BlindRound:
    return making.start_round(options.seed, options.count or STARTS, options.pack, options.before)


def _pairs(options: argparse.Namespace) -> BlindRound:
    return making.pair_round(options.seed, options.count or PAIRS, options.pack, options.before)


def _publish(options: argparse.Namespace) -> None:
    print(publishing.publish(options.round, options.out, options.number))


if __name__ == "__main__":
    main()
