"""Folder of results and samples, with the paths that the database requires: data/vigil/DEVELOPER/MODEL/UUID.json.

Names, ids and dates are derived from the run. So if a run is exported again, the same files are written.
"""

import hashlib
import json
import uuid
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path, PurePosixPath

from vigil.errors import SettingError
from vigil.integrations.exports.every_eval_ever.aggregate import aggregate, identity_of, remarks
from vigil.integrations.exports.every_eval_ever.samples import JOINED_METRIC, SCHEMA_VERSION, sample_lines
from vigil.integrations.exports.options import NO_DISCLOSURE, Disclosure, Publisher
from vigil.packs.pack import manifest_of
from vigil.packs.private import is_private
from vigil.scoring.saved_run import SavedRun, read_run
from vigil.scoring.summary import RunScores

COLLECTION = "vigil"


def write_results(
    folders: Sequence[Path],
    pack: str | Path | None,
    out: Path,
    publisher: Publisher,
    tell: Callable[[Iterable[str]], object],
    disclosure: Disclosure = NO_DISCLOSURE,
) -> list[Path]:
    """Write the runs in `folders` under `out` and return the paths of the aggregate files.

    `tell` is called with each remark about the runs. Samples of a private pack are written only if `disclosure` allows
    it.

    If one of the runs cannot be written, nothing is written. Raises SettingError, RecordError or PackMismatch.
    """
    runs = [read_run(folder, pack) for folder in folders]
    files: dict[PurePosixPath, bytes] = {}
    for run in runs:
        scores = run.table.scores()
        _check(run, scores, publisher)
        tell(f"{run.header.run_id}: {remark}" for remark in remarks(run, scores))
        files |= _files(run, scores, publisher, disclosure)
    for place, content in files.items():
        (out / place).parent.mkdir(parents=True, exist_ok=True)
        (out / place).write_bytes(content)
    return [out / place for place in files if place.suffix == ".json"]


def _check(run: SavedRun, scores: RunScores, publisher: Publisher) -> None:
    name, scored = run.header.run_id, len(scores.outcomes)
    if not scored:
        raise SettingError(f"Run {name!r} has no scored episode: there is nothing to export.")
    if not run.header.spec.profile.row.has_report:
        raise SettingError(f"Run {name!r} was played under a profile without reports: it has no B to export.")
    if publisher.force:
        return
    if run.header.spec.shard is not None:
        raise SettingError(
            f"Run {name!r} is shard {run.header.spec.shard} of a run. Join the shards with `vigil merge`, or give "
            "--force; the results then say that the run is only a shard."
        )
    if not scores.is_complete:
        raise SettingError(
            f"Run {name!r} is incomplete: {scored} of {sum(scores.planned.values())} episodes are scored. Finish "
            "the run with the command that began it, or give --force; the results then say that the run is "
            "incomplete."
        )


def _files(
    run: SavedRun, scores: RunScores, publisher: Publisher, disclosure: Disclosure
) -> dict[PurePosixPath, bytes]:
    identity = identity_of(run.header, publisher.developer)
    ended = str(max(run.table.record((row.episode_id, row.epoch)).ended for row in scores.outcomes).timestamp())
    heading = {
        "schema_version": SCHEMA_VERSION,
        "evaluation_id": f"{COLLECTION}/{identity.id}/{ended}",
        "model_id": identity.id,
        "evaluation_name": f"VIGIL {run.header.spec.pack}",
        "evaluation_result_id": JOINED_METRIC,
    }
    header = run.header
    facts = f"{header.run_id}\n{header.started.isoformat()}\n{header.spec.model_dump_json()}"
    stem = uuid.UUID(bytes=hashlib.sha256(facts.encode()).digest()[:16], version=4)  # always the same for a run
    folder = PurePosixPath("data", COLLECTION, *identity.folders)
    result = aggregate(run, heading, identity, publisher, scores)
    result["retrieved_timestamp"] = ended
    written: dict[PurePosixPath, bytes] = {}
    if disclosure.reveal_private_pack or not is_private(manifest_of(run.pack_folder).meta):
        place = folder / f"{stem}_samples.jsonl"
        lines = list(sample_lines(run, heading, disclosure))
        written[place] = "".join(f"{line}\n" for line in lines).encode()
        result["detailed_evaluation_results"] = {
            "format": "jsonl",
            "file_path": str(place),
            "hash_algorithm": "sha256",
            "checksum": hashlib.sha256(written[place]).hexdigest(),
            "total_rows": len(lines),
        }
    text = json.dumps(result, ensure_ascii=False, allow_nan=False, indent=1)
    return {folder / f"{stem}.json": f"{text}\n".encode(), **written}
