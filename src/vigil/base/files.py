"""Safe reading of files that others may have written: regular files only, within a size limit and inside their folder.

Other files are refused: reading a device or a pipe may never end, and a link may lead to a private file.
"""

import hashlib
import os
import stat
from pathlib import Path
from typing import BinaryIO

from vigil.errors import InputError, SettingError

MIB = 1024 * 1024
MAX_JSON_BYTES = 64 * MIB
"""Default size limit of a file that holds one JSON value."""
_BLOCK = MIB
_KINDS = {
    stat.S_IFDIR: "a folder",
    stat.S_IFIFO: "a pipe",
    stat.S_IFSOCK: "a socket",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
}


def open_file(path: Path, what: str, error: type[InputError]) -> BinaryIO:
    """Open a file for reading; `what` begins a message, e.g. "House file 'a.json'".

    Raises `error` if the file does not exist, cannot be read, or is a folder, a device or a pipe.
    """
    try:
        number = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)  # opening a pipe must not block
    except FileNotFoundError:
        raise error(f"{what} does not exist.") from None
    except (OSError, ValueError) as fault:  # ValueError: the path contains a NUL
        raise error(f"{what} cannot be read: {getattr(fault, 'strerror', None) or fault}.") from None
    kind = stat.S_IFMT(os.fstat(number).st_mode)
    if kind != stat.S_IFREG:
        os.close(number)
        raise error(f"{what} is {_KINDS.get(kind, 'something else')}, not a file.")
    return open(number, "rb")


def read_file(path: Path, what: str, error: type[InputError], max_bytes: int = MAX_JSON_BYTES) -> bytes:
    """Return the bytes of a file. Raises `error` as `open_file` does, and if the file is larger than `max_bytes`."""
    with open_file(path, what, error) as file:
        try:
            data = file.read(max_bytes + 1)
        except OSError as fault:
            raise error(f"{what} cannot be read: {fault.strerror}.") from None
    if len(data) > max_bytes:
        raise error(f"{what} is over {max_bytes / MIB:g} MiB, the limit for such a file.")
    return data


def file_sha256(path: Path, what: str, error: type[InputError] = SettingError) -> str:
    """Return the SHA-256 of a file of any size. Raises `error` as `open_file` does."""
    digest = hashlib.sha256()
    with open_file(path, what, error) as file:
        while block := file.read(_BLOCK):
            digest.update(block)
    return digest.hexdigest()


def is_inside(path: Path, folder: Path) -> bool:
    """Return whether `path` lies in `folder` after the links in both paths are resolved."""
    return Path(os.path.realpath(path)).is_relative_to(os.path.realpath(folder))


def resolve_inside(folder: Path, name: str, error: type[InputError]) -> Path:
    """Return the path of a file in a folder. Raises `error` if the file is a link that leads out of the folder."""
    path = folder / name
    if not is_inside(path, folder):
        raise error(f"{name} in {str(folder)!r} is a link that leads out of the folder, so it is not followed.")
    return path


def refuse_outward_links(folder: Path, error: type[InputError]) -> None:
    """Raise `error` if a link in a folder leads out of it: writing through such a link would change other folders."""
    for parent, folders, names in os.walk(folder):
        for entry in (Path(parent, name) for name in sorted([*folders, *names])):
            if entry.is_symlink() and not is_inside(entry, folder):
                raise error(
                    f"{str(entry)!r} is a link that leads out of {str(folder)!r}, so it is not followed. Replace the "
                    "link by the file that it leads to, or remove it."
                )
