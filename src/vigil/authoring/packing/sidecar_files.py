"""Files next to a frozen pack, outside its hash: results that were measured on it afterwards."""

from typing import TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError

from vigil.base.files import read_file, resolve_inside
from vigil.errors import PackMismatch, first_error
from vigil.packs.pack import Pack


class SidecarFile(BaseModel):
    """Results of one pack."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    pack: str
    pack_sha256: str


Sidecar = TypeVar("Sidecar", bound=SidecarFile)


def read_sidecar(pack: Pack, name: str, form: type[Sidecar], advice: str) -> Sidecar | None:
    """Return the content of a file next to the pack, for this very pack; None without the file.

    `advice` ends the error's message. Raises PackMismatch for a broken file.
    """
    path = pack.folder / name
    if not path.exists():
        return None
    raw = read_file(resolve_inside(pack.folder, name, PackMismatch), repr(str(path)), PackMismatch)
    try:
        found = form.model_validate_json(raw)
    except ValidationError as error:
        raise PackMismatch(f"{str(path)!r}: {first_error(error)}. {advice}") from None
    return found if found.pack_sha256 == pack.sha256 else None
