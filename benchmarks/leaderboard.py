"""How long the site of a leaderboard of 30 bundles of 1,000 plays takes, and what one more bundle costs.

    python -m benchmarks.leaderboard --out build/many [--bundles 30] [--pack vigil_balanced_1000] [--workers 2]

The plays are the pack's published solutions after 4, 6 or 8 turns (fewer in a small budget), so that they have about as
many steps as a reader's. Each is played once; a third of the bundles has the plays of one kind, each bundle with its
own run and times. This part is not measured. A second call continues with what is in the folder: `--bundles 30` and
then `--bundles 31` measures what a new bundle costs. Processor times include those of all worker processes.
"""

import argparse
import json
import resource
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from datetime import date, timedelta
from functools import cache
from pathlib import Path

from tools.first_entries import metadata_of
from vigil.assets.database import AssetDatabase
from vigil.base.json_lines import dump_line
from vigil.env import Env
from vigil.packs.pack import Pack
from vigil.protocol.actions import AnyAction, Navigate, Reply
from vigil.protocol.profile import Profile
from vigil.records.record import EPISODES_FILE, HEADER_FILE, EpisodeRecord, RunHeader
from vigil.runner.plan import run_spec
from vigil.runner.run_folder import host_facts
from vigil.scoring.saved_run import read_run
from vigil.sim import make_simulator
from vigil.web.leaderboard.build import build_site
from vigil.web.leaderboard.bundle import Entry, sha256_of, write_bundle
from vigil.web.leaderboard.measures import measures_of
from vigil.web.leaderboard.settings import BuildSettings

TURNS = (4, 6, 8)
"""Number of turns before the solution, for each kind of run: to the left and back again."""
_ASIDE = (Navigate(mode="turn_left", magnitude=30), Navigate(mode="turn_right", magnitude=30))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--pack", default="vigil_balanced_1000")
    parser.add_argument("--bundles", type=int, default=30)
    parser.add_argument("--workers", type=int, default=2)
    options = parser.parse_args()
    (options.out / "plays").mkdir(parents=True, exist_ok=True)
    pack = Pack.load(options.pack)
    houses = sorted({episode.house.name for episode in pack.episodes})
    with ProcessPoolExecutor(options.workers) as pool:
        list(pool.map(play_house, [(options.pack, name, options.out / "plays" / name) for name in houses]))
    bundles = [bundle_of(pack, options.out, number) for number in range(options.bundles)]
    sizes = [bundle.stat().st_size for bundle in bundles]
    print(f"{len(bundles)} bundles of {len(pack.episodes)} plays, {sum(sizes) / 2**20:.1f} MiB", flush=True)
    used, began = _processor_s(), time.monotonic()
    settings = BuildSettings(workers=options.workers, shown_plays=0)
    built = build_site(bundles, options.out / "site", settings)
    print(
        f"{built.checked} checked, {len(built.entries)} entries: {time.monotonic() - began:.0f} s, "
        f"{_processor_s() - used:.0f} s of processor time"
    )


def play_house(task: tuple[str, str, Path]) -> None:
    """Play the episodes of one house once in each way, and write the records to `task[2]`."""
    name, house, out = task
    if out.exists():
        return
    pack = _pack(name)
    env = Env(make_simulator("mujoco", assets=AssetDatabase.default()), pack.house_of, Profile())
    rows = b""
    for turns in TURNS:
        for episode in (each for each in pack.episodes if each.house.name == house):
            solution = pack.solutions[episode.id].actions
            pairs = min(turns, episode.max_steps - len(solution)) // 2
            env.reset(episode)
            for action in (*(pairs * _ASIDE), *solution):
                env.step(Reply(text=reply_text(action)))
            rows += dump_line(env.record(run_id=str(turns)))
    env.close()
    partial = out.with_suffix(".partial")
    partial.write_bytes(rows)
    partial.rename(out)


@cache
def _pack(name: str) -> Pack:
    return Pack.load(name)


def reply_text(action: AnyAction) -> str:
    """Return a reply that says an action."""
    arguments = action.model_dump(exclude={"skill_name"}, exclude_none=True)
    return json.dumps({"thought": "This is the next step.", "skill_name": action.skill_name, "arguments": arguments})


def bundle_of(pack: Pack, out: Path, number: int) -> Path:
    """Return the bundle of a run, which is made unless it exists. Its plays were not checked by `vigil submit`."""
    bundle, run = out / f"{number:03}.zip", out / f"run{number:03}"
    if bundle.exists():
        return bundle
    run.mkdir(exist_ok=True)
    late = timedelta(days=number)
    records = [_later(record, late) for record in _records(out / "plays", TURNS[number % len(TURNS)])]
    header = _header(pack, number, records)
    lines = [dump_line(header.stamp(record)) for record in sorted(records, key=lambda record: record.key)]
    members = {HEADER_FILE: header.model_dump_json(indent=1).encode() + b"\n", EPISODES_FILE: b"".join(lines)}
    for name, data in members.items():
        (run / name).write_bytes(data)
    measures = measures_of(read_run(run, pack.folder), pack)
    claimed = Entry(
        metadata=metadata_of(run.name, "A run for measuring.").model_copy(update={"submission_date": date.max}),
        pack=pack.name,
        pack_sha256=pack.sha256,
        frames=measures.frames,
        figures=measures.figures,
        files={name: sha256_of(data) for name, data in members.items()},
    )
    write_bundle(bundle, claimed, members)
    return bundle


def _records(folder: Path, turns: int) -> Iterator[EpisodeRecord]:
    for path in sorted(folder.iterdir()):
        found = map(EpisodeRecord.model_validate_json, path.read_bytes().splitlines())
        yield from (record for record in found if record.run_id == str(turns))


def _later(record: EpisodeRecord, late: timedelta) -> EpisodeRecord:
    return record.model_copy(update={"started": record.started + late, "ended": record.ended + late})


def _header(pack: Pack, number: int, records: list[EpisodeRecord]) -> RunHeader:
    ids = tuple(sorted(episode.id for episode in pack.episodes))
    return RunHeader(
        run_id=f"run{number:03}",
        nonce=f"{number:032x}",
        spec=run_spec(pack, Profile(), agent="solutions", agent_kind="privileged", episode_ids=ids),
        package_version="0",
        started=min(record.started for record in records),
        ended=max(record.ended for record in records),
        host=host_facts(),
    )


def _processor_s() -> float:
    """Return the processor time (s) of this process and of those that it has started and that have ended."""
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(each.ru_utime + each.ru_stime for each in used)


if __name__ == "__main__":
    main()
