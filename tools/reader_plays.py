"""Publishes the results of readers who played a pack: `plays.json`, an updated card, and the records as a run.

python -m tools.reader_plays --pack PACK --causes causes.jsonl --drawn "SENTENCE" --out FOLDER RUN...

`causes.jsonl` has a line for each failure: {"episode_id": ..., "cause": "agent", "reason": ...}. Runs may have been
played on an earlier version of the pack, if their episodes are the same to the byte in this one; of those that the pack
does not hold any more, nothing is published.
"""

import argparse
import json
from collections.abc import Iterator, Sequence
from pathlib import Path

from tools.published_plays import publish_plays
from vigil.authoring.packing.dataset_card import write_card
from vigil.authoring.packing.reader_plays import PLAYS, ReaderPlay, ReaderPlays, plays_table
from vigil.packs.pack import Pack
from vigil.packs.private import REVEAL, REVEAL_HELP, check_revealed, is_private
from vigil.protocol.episode import Episode
from vigil.records.record import EpisodeRecord, read_header
from vigil.scoring.closure import closure_answers, score_closure
from vigil.scoring.levels import read_pack_levels
from vigil.scoring.outcomes import score
from vigil.scoring.saved_run import read_run


def played(folders: Sequence[Path], pack: Pack) -> Iterator[tuple[str, Episode | None, EpisodeRecord]]:
    """Yield (reader, episode, record) of what was played; no episode where it left the pack.

    Raises SystemExit when the pack's episode is another one.
    """
    held = {episode.id: episode for episode in pack.episodes}
    for folder in folders:
        table = read_run(folder).table
        for (name, _), row in table.rows.items():
            if row.outcome is None:
                continue
            episode = held.get(name)
            if episode is not None and table.episodes[name] != episode:
                raise SystemExit(f"{name!r} of {str(folder)!r} is another episode in pack {pack.name!r}.")
            yield folder.name, episode, table.record((name, 1))


def main() -> None:
    """Score the runs and write everything."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("runs", nargs="+", type=Path, help="Folders of runs, one a reader.")
    parser.add_argument("--pack", required=True)
    parser.add_argument("--causes", required=True, type=Path)
    parser.add_argument("--drawn", required=True, help="How the episodes were drawn, as a sentence.")
    parser.add_argument("--out", required=True, type=Path, help="New folder for all plays, as one run with its pack.")
    parser.add_argument(REVEAL, action="store_true", dest="reveals", help=REVEAL_HELP)
    options = parser.parse_args()
    pack = Pack.load(options.pack)
    check_revealed(pack.name, is_private(pack.manifest.meta), "A file of all records", reveals=options.reveals)
    causes = {row["episode_id"]: row for row in map(json.loads, options.causes.read_text().splitlines())}
    answers = closure_answers(pack.folder) if pack.manifest.suite else {}
    levels = read_pack_levels(pack.folder)
    plays: list[ReaderPlay] = []
    records: list[EpisodeRecord] = []
    for reader, episode, record in played(options.runs, pack):
        if episode is None:
            print(f"{record.episode_id} is not in the pack any more: its play is not published.")
            continue
        records.append(record)
        outcome, why = score(episode, record), causes.get(episode.id, {})
        closing = score_closure(answers[episode.id], episode, record) if answers else None
        plays.append(
            ReaderPlay(
                episode_id=episode.id,
                reader=reader,
                group=answers[episode.id].kind if answers else levels[episode.id].level,
                steps=len(record.steps),
                status=outcome.reported,
                W=outcome.W,
                B=outcome.B,
                C=closing.C if closing else None,
                label=closing.label if closing else outcome.label or "",
                cause=why.get("cause"),
                reason=why.get("reason", ""),
            )
        )
    plays.sort(key=lambda play: play.episode_id)
    found = ReaderPlays(pack=pack.name, pack_sha256=pack.sha256, drawn=options.drawn, plays=tuple(plays))
    (pack.folder / PLAYS).write_text(found.model_dump_json(indent=1) + "\n", encoding="utf-8")
    write_card(pack)
    publish_plays(options.out, pack.folder, records, read_header(options.runs[0]))
    print(*plays_table(found), sep="\n")


if __name__ == "__main__":
    main()
