"""Files beside a frozen pack, which are no part of its hash: what was measured on it afterwards."""

from typing import TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError

from vigil.base.files import inside, read_file
from vigil.errors import PackMismatch, first_fault
from vigil.packs.pack import Pack


class FactsOfAPack(BaseModel):
    """What was found on one pack."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    pack: str
    pack_sha256: str


Facts = TypeVar("Facts", bound=FactsOfAPack)


def read_beside(pack: Pack, name: str, form: type[Facts], advice: str) -> Facts | None:
    """Returns what a file beside the pack says of this very pack, None without it; `advice` ends the error's message.

    Raises PackMismatch for a broken file.
    """
    path = pack.folder / name
    if not path.exists():
        return None
    raw = read_file(inside(pack.folder, name, PackMismatch), repr(str(path)), PackMismatch)
    try:
        found = form.model_validate_json(raw)
    except ValidationError as error:
        raise PackMismatch(f"{str(path)!r}: {first_fault(error)}. {advice}") from None
    return found if found.pack_sha256 == pack.sha256 else None
