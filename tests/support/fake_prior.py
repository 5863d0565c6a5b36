"""Stand-in for the package `prior`: its "download" writes made-up houses where the real one stores ProcTHOR-10K."""

import gzip
import json
import os
from collections.abc import Sequence
from pathlib import Path
from types import ModuleType
from typing import Any

from vigil.authoring.drafting.procthor import DATASET, OWNER, REVISION, SPLITS


class FakePrior(ModuleType):
    """The part of the module `prior` that VIGIL uses."""

    def __init__(self, folder: Path, lines: Sequence[bytes], fault: Exception | None = None) -> None:
        """Take the houses of every split as `lines`; with `fault`, a download fails midway with it."""
        super().__init__("prior")
        self.DATASET_DIR = str(folder)
        self.lines, self.fault = lines, fault
        self.calls: list[dict[str, Any]] = []

    def load_dataset(self, dataset: str, revision: str = "main", entity: str = "allenai", **more: Any) -> None:
        """Write the dataset, change the working directory and print, as the real `prior` does."""
        self.calls.append({"dataset": dataset, "revision": revision, "entity": entity, **more})
        folder = self.folder
        folder.mkdir(parents=True, exist_ok=True)
        before = Path.cwd()
        os.chdir(folder)
        print("[AI2-THOR WARNING] printed by the dataset's own program")
        for split in SPLITS:
            (folder / f"{split}.jsonl.gz").write_bytes(b"version https://git-lfs.github.com/spec/v1\n")
        if self.fault is not None:
            raise self.fault
        for split in SPLITS:
            (folder / f"{split}.jsonl.gz").write_bytes(gzip.compress(b"\n".join(self.lines) + b"\n", mtime=0))
        os.chdir(before)

    @property
    def folder(self) -> Path:
        """The folder of the pinned revision."""
        return Path(self.DATASET_DIR) / OWNER / DATASET / REVISION


def as_procthor_writes(data: dict[str, Any]) -> bytes:
    """Return a generated house's document as ProcTHOR would write it: without the name of a generator."""
    metadata = {name: value for name, value in data["metadata"].items() if name != "generator"}
    return json.dumps({**data, "metadata": metadata}).encode()
