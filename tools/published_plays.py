"""Published plays: a run in a folder that also has the episodes and houses that were played, in its folder `pack`.

`vigil score`, `report`, `verify` and `view` open such a run as any other, also when the pack it was played on is no
longer packaged.
"""

import hashlib
import json
from collections import Counter
from collections.abc import Collection, Sequence
from pathlib import Path
from typing import Any

from vigil.base.json_lines import dump_line
from vigil.packs.files import EPISODES, HOUSES, MANIFEST
from vigil.packs.pack import Pack
from vigil.records.record import EPISODES_FILE, HEADER_FILE, EpisodeRecord, RunHeader

PACK = "pack"
"""Folder of the excerpt, in the run's folder."""


def publish_plays(folder: Path, source: Path, records: Sequence[EpisodeRecord], header: RunHeader) -> None:
    """Write `records` as one run with an excerpt of the pack in `source`.

    Each row keeps the run id under which it was played. `header` gives all settings except those about the pack; its
    times become those of the first and the last play, because the plays may come from several runs.
    """
    ordered = sorted(records, key=lambda record: record.key)
    played = {record.episode_id for record in ordered}
    pack = write_excerpt(source, folder / PACK, played)
    of_pack = {"pack": pack.name, "pack_sha256": pack.sha256, "pack_versions": pack.manifest.versions}
    spec = header.spec.model_copy(update={**of_pack, "episode_ids": tuple(sorted(played))})
    times = {"started": min(each.started for each in ordered), "ended": max(each.ended for each in ordered)}
    own = header.model_copy(update={"run_id": folder.name, "spec": spec, "host": {"pack_folder": PACK}, **times})
    (folder / HEADER_FILE).write_text(own.model_dump_json(indent=1) + "\n", encoding="utf-8")
    rows = (record.model_copy(update={"run_sha256": own.sha256}) for record in ordered)
    (folder / EPISODES_FILE).write_bytes(b"".join(map(dump_line, rows)))


def write_excerpt(source: Path, folder: Path, wanted: Collection[str]) -> Pack:
    """Write the wanted episodes of a pack, their twins, their houses and all that is said of them as another pack.

    All lines and houses are the bytes of the source; the versions under which it was made stay.
    """
    pairs = Pack.load(source).pairs
    paired = {pairs[name] for name in wanted if name in pairs}
    ids = {*wanted, *(name for name, pair in pairs.items() if pair in paired)}
    raw = (source / MANIFEST).read_bytes()
    manifest: dict[str, Any] = json.loads(raw)
    episodes = [row for row in _rows(source / EPISODES) if row["id"] in ids]
    houses = {row["house"]["name"] for row in episodes}
    kept = {f"{HOUSES}/{name}.json": (source / HOUSES / f"{name}.json").read_bytes() for name in sorted(houses)}
    for path in sorted(name for name in manifest["files"] if name.endswith(".jsonl")):
        lines = (source / path).read_bytes().splitlines(keepends=True)
        kept[path] = b"".join(line for line in lines if _episode_of(json.loads(line)) in ids)
    sources = manifest["meta"].get("house_sources", {})
    manifest |= {
        "name": f"{manifest['name']}_played",
        "description": f"The episodes of {manifest['name']} that readers played, and their twins.",
        "episodes": len(episodes),
        "houses": len(houses),
        "families": dict(Counter(row["family"] for row in episodes)),
        "files": {path: hashlib.sha256(data).hexdigest() for path, data in kept.items()},
        "meta": {
            "suite": manifest["meta"].get("suite"),
            "excerpt_of": {"name": manifest["name"], "sha256": hashlib.sha256(raw).hexdigest()},
            "house_sources": {name: facts for name, facts in sources.items() if name in houses},
        },
    }
    kept[MANIFEST] = json.dumps(manifest, indent=1, sort_keys=True).encode() + b"\n"
    for path, data in kept.items():
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_bytes(data)
    return Pack.load(folder)


def _rows(path: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in path.read_bytes().splitlines()]


def _episode_of(row: dict[str, Any]) -> str:
    return row.get("episode_id") or row["id"]
