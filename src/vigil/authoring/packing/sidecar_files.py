"""Sidecar files: files in a frozen pack's folder with results measured on the pack. They are not in its hash."""

from typing import Self

from pydantic import BaseModel, ConfigDict, ValidationError

from vigil.base.files import read_file, resolve_inside
from vigil.errors import PackMismatch, first_error
from vigil.packs.pack import Pack


class SidecarFile(BaseModel):
    """Results that were measured on one pack, with the hash of this pack."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    pack: str
    pack_sha256: str

    @classmethod
    def read(cls, pack: Pack, name: str, advice: str) -> Self | None:
        """Return the content of a pack's file; None if the file is missing or is for another version of the pack.

        Raises PackMismatch if the file is invalid; the message ends with `advice`.
        """
        path = pack.folder / name
        if not path.exists():
            return None
        raw = read_file(resolve_inside(pack.folder, name, PackMismatch), repr(str(path)), PackMismatch)
        try:
            found = cls.model_validate_json(raw)
        except ValidationError as error:
            raise PackMismatch(f"{str(path)!r}: {first_error(error)}. {advice}") from None
        return found if found.pack_sha256 == pack.sha256 else None
