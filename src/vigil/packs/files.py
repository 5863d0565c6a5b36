"""Files of a pack: the manifest, and the reading of the files that the manifest lists.

A file's hash is checked at every reading, so that a file that was changed after freezing is never used.
"""

import hashlib
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, TypeVar

from pydantic import BaseModel, Field, ValidationError

from vigil.base.files import MIB, read_file
from vigil.base.json_files import is_object, read_json
from vigil.base.models import FrozenModel
from vigil.base.versions import PackVersions, schema_mismatch
from vigil.errors import EpisodeError, PackMismatch, first_error
from vigil.protocol.families import Family
from vigil.protocol.house import MAX_HOUSE_BYTES

PACK_SCHEMA = 2
MANIFEST, EPISODES, SOLUTIONS, HOUSES = "manifest.json", "episodes.jsonl", "solutions.jsonl", "houses"
MAX_MANIFEST_BYTES = 16 * MIB
MAX_LINES_BYTES = 512 * MIB
NAME_PATTERN = r"^[A-Za-z0-9][A-Za-z0-9_.-]{0,99}$"
FILE_PATTERN = r"([A-Za-z0-9][A-Za-z0-9_.-]{0,199}/){0,4}[A-Za-z0-9][A-Za-z0-9_.-]{0,199}"
"""Pattern of a file's path in a manifest: a relative path inside the pack, of limited depth and length."""
_Line = TypeVar("_Line", bound=BaseModel)


Change = Literal["wording", "start", "light"]
"""What is different in a perturbed pack."""


class Perturbation(FrozenModel):
    """The origin of a perturbed pack: its episodes have the ids of their originals."""

    of: str
    """Name of the original pack."""
    sha256: str
    """SHA-256 of the original pack."""
    change: Change
    seed: int
    left_out: dict[str, int]
    """Reason -> number of episodes of the original that could not be perturbed."""


class Manifest(FrozenModel):
    """The manifest of a pack: its name, versions, counts and the hashes of its files."""

    schema_version: int = PACK_SCHEMA
    name: str = Field(pattern=NAME_PATTERN)
    version: str = "1"
    versions: PackVersions = PackVersions()
    """Versions of the package that made the pack. The solutions are known to be valid only under these versions."""
    description: str = ""
    episodes: int
    houses: int
    families: dict[Family, int]
    meta: dict[str, Any] = Field(default_factory=dict)
    """Any further facts about how the pack was made: generator versions, seeds, counts by template."""
    files: dict[str, str]
    """Relative path -> SHA-256 of the file's bytes."""

    @property
    def suite(self) -> str | None:
        """Name of the suite that the pack belongs to; None for a pack that is not of a suite."""
        suite = self.meta.get("suite")
        return suite if isinstance(suite, str) else None

    @property
    def perturbation(self) -> Perturbation | None:
        """The origin of a perturbed pack; None for any other pack."""
        found = self.meta.get("perturbation")
        return None if found is None else Perturbation.model_validate(found)

    @property
    def version_notes(self) -> tuple[str, ...]:
        """Notes for readers if the pack was made under other versions than this package's; otherwise empty."""
        note = self.versions.note(f"Pack {self.name!r}")
        return () if note is None else (note,)


@dataclass(frozen=True, slots=True)
class PackFiles:
    """A pack's folder with its manifest. Every file is checked against its hash in the manifest when it is read."""

    folder: Path
    manifest: Manifest
    sha256: str
    """SHA-256 of the manifest, which identifies the pack because it holds the hashes of all files."""

    @classmethod
    def of(cls, folder: Path, sha256: str | None = None) -> "PackFiles":
        """Return the files of the pack in a folder. Raises PackMismatch, e.g. if the pack's hash is not `sha256`."""
        raw = _read(folder, MANIFEST, MAX_MANIFEST_BYTES)
        found = hashlib.sha256(raw).hexdigest()
        if sha256 not in (None, found):
            raise PackMismatch(
                f"Pack {str(folder)!r} has SHA-256 {found[:12]}..., expected {str(sha256)[:12]}.... Give the pack "
                "that the run was played on; results on another pack cannot be compared."
            )
        return cls(folder, _manifest(folder, raw), found)

    def read(self, name: str) -> bytes:
        """Return the bytes of a file. Raises PackMismatch if the file has changed since the pack was frozen."""
        expected = self.manifest.files.get(name)
        if expected is None:
            raise PackMismatch(f"Pack {str(self.folder)!r}: {MANIFEST} does not list {name}. Freeze the pack again.")
        data = _read(self.folder, name, MAX_HOUSE_BYTES if name.startswith(HOUSES) else MAX_LINES_BYTES)
        found = hashlib.sha256(data).hexdigest()
        if found != expected:
            raise PackMismatch(
                f"Pack {str(self.folder)!r}: {name} has SHA-256 {found[:12]}..., the manifest says {expected[:12]}.... "
                "The file was changed after freezing; restore it, or freeze a new pack."
            )
        return data

    def rows(self, name: str, model: type[_Line]) -> list[_Line]:
        """Return the rows of a JSON-lines file of the pack. Raises PackMismatch or EpisodeError."""
        rows: list[_Line] = []
        for number, line in enumerate(self.read(name).splitlines(), start=1):
            try:
                rows.append(model.model_validate_json(line))
            except ValidationError as error:
                place = f"Pack {str(self.folder)!r}: {name} line {number}"
                raise EpisodeError(f"{place}: {first_error(error)}.") from None
        return rows


def _read(folder: Path, name: str, limit: int) -> bytes:
    if not (folder / name).exists():
        raise PackMismatch(
            f"Pack {str(folder)!r}: {name} is missing. Is this the folder of a pack, and is it complete?"
        )
    return read_file(folder / name, f"Pack {str(folder)!r}: {name}", PackMismatch, limit)


def _manifest(folder: Path, raw: bytes) -> Manifest:
    try:
        found = read_json(raw)
        named: dict[str, Any] = found if is_object(found) else {}
        other = schema_mismatch(named.get("schema_version", PACK_SCHEMA), PACK_SCHEMA)
        if other is not None:
            raise PackMismatch(f"Pack {str(folder)!r} {other}.")
        manifest = Manifest.model_validate(found)
    except ValidationError as error:
        raise PackMismatch(f"Pack {str(folder)!r}: {MANIFEST}: {first_error(error)}.") from None
    except ValueError as error:
        raise PackMismatch(f"Pack {str(folder)!r}: {MANIFEST} is not JSON: {error}. Restore it from a copy.") from None
    for name in (EPISODES, SOLUTIONS):
        if name not in manifest.files:
            raise PackMismatch(f"Pack {str(folder)!r}: {MANIFEST} does not list {name}. Freeze the pack again.")
    for name in manifest.files:
        if not re.fullmatch(FILE_PATTERN, name):
            raise PackMismatch(
                f"Pack {str(folder)!r}: {MANIFEST} lists {name[:100]!r}, which may be outside the pack, or not a "
                "file. A file's name consists of letters, digits, '_', '.' and '-', with '/' after a folder, e.g. "
                "houses/kitchen_1.json."
            )
    return manifest
