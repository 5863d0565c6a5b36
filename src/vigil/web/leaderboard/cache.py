"""Cache: the result of each bundle's check, so that a build checks only the bundles that are new to it."""

import hashlib
import json
import shutil
import tempfile
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from vigil import __version__
from vigil.base.json_files import read_json
from vigil.base.versions import Versions
from vigil.errors import RecordError
from vigil.runner.run_folder import host_facts
from vigil.runner.verify_run import SAME_HOST
from vigil.web.leaderboard.checking import CheckedEntry

CACHE_VERSION = 3
"""Version of the check and its result. Results of another version are not used."""
_ENTRY, _PLAYS, _REFUSAL = "entry.json", "plays.parquet", "refusal.txt"
PAGES = "pages"


@dataclass(frozen=True)
class Cached:
    """The result of one bundle's check: an entry with the pages of some plays, or the reason for a refusal."""

    entry: CheckedEntry | None
    refusal: str = ""
    pages: Path | None = None
    """Folder of the pages of plays; None if the bundle was refused."""


class Cache:
    """A folder with one folder for each checked bundle."""

    def __init__(self, folder: Path, *facts: object) -> None:
        """Open the cache in `folder`. `facts` are the settings on which the result of a check depends."""
        here = host_facts()
        versions = {**Versions.current().model_dump(), **{name: here[name] for name in SAME_HOST}}
        self._facts = repr((CACHE_VERSION, __version__, sorted(versions.items()), facts))
        self.folder = folder
        folder.mkdir(parents=True, exist_ok=True)

    def find(self, bundle_sha256: str) -> Cached | None:
        """Return the result of a bundle's check; None if this version of the check has not checked the bundle."""
        place = self._place(bundle_sha256)
        if not place.is_dir():
            return None
        if (place / _REFUSAL).exists():
            return Cached(None, (place / _REFUSAL).read_text(encoding="utf-8"))
        fields = read_json((place / _ENTRY).read_bytes())
        plays = pd.read_parquet(place / _PLAYS)
        return Cached(
            CheckedEntry.model_validate({**fields, "plays": plays, "bundle_sha256": bundle_sha256}), "", place / PAGES
        )

    def work_folder(self) -> tempfile.TemporaryDirectory[str]:
        """Return a new folder on the cache's disk, for unpacking a bundle."""
        return tempfile.TemporaryDirectory(dir=self.folder, prefix="unpacked-")

    def store(self, bundle_sha256: str, entry: CheckedEntry | RecordError, pages: Path | None = None) -> Cached:
        """Store the result of a check; `pages` are moved into the cache."""
        with tempfile.TemporaryDirectory(dir=self.folder, prefix="new-") as name:
            new = Path(name) / "result"
            new.mkdir()
            if isinstance(entry, RecordError):
                (new / _REFUSAL).write_text(str(entry), encoding="utf-8")
            else:
                (new / _ENTRY).write_text(json.dumps(entry.model_dump(mode="json")), encoding="utf-8")
                entry.plays.to_parquet(new / _PLAYS, index=False)
                if pages is None:
                    (new / PAGES).mkdir()
                else:
                    shutil.move(pages, new / PAGES)
            place = self._place(bundle_sha256)
            shutil.rmtree(place, ignore_errors=True)
            new.rename(place)
        found = self.find(bundle_sha256)
        assert found is not None
        return found

    def _place(self, bundle_sha256: str) -> Path:
        return self.folder / hashlib.sha256(f"{bundle_sha256}\n{self._facts}".encode()).hexdigest()
