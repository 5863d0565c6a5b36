"""Bundle: a zip file with a run and its metadata. A bundle may come from anyone, so reading it is bounded and strict.

    entry.json       metadata, the pack's hash, hashes of the other members and of the frames, and the figures
    run.json         header of the run, without paths and addresses of the machine
    episodes.jsonl   records, as the run wrote them
    probes.jsonl     answers to probes, if there are any

Nothing else may be in it. The same run and metadata give the same bytes.
"""

import hashlib
import io
import json
import stat
import struct
import zipfile
import zlib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import BinaryIO, TypeVar

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from vigil.base.files import MIB, open_file, read_file
from vigil.errors import RecordError, first_error, shorten
from vigil.records.probe_file import PROBES_FILE
from vigil.records.record import EPISODES_FILE, HEADER_FILE, Resumption, RunHeader, read_header
from vigil.web.leaderboard.metadata import EntryMetadata

ENTRY_FILE = "entry.json"
SCHEMA = 1
MAX_ZIP_BYTES = 256 * MIB
MEMBERS: Mapping[str, int] = {
    ENTRY_FILE: MIB,
    HEADER_FILE: MIB,
    EPISODES_FILE: 512 * MIB,
    PROBES_FILE: 256 * MIB,
}
"""Name of a member (a file in the bundle) -> its maximum size in bytes after unpacking."""
MAX_ROW_BYTES = 16 * MIB
"""Maximum size of a row of records; a row with forty replies of maximum length has about 10 MiB."""
MAX_DIRECTORY_BYTES = 4096
MAX_SHOWN_CHARS = 60
_END, _END_64, _END_SIZE = b"PK\x05\x06", b"PK\x06\x07", 22
_EPOCH = (1980, 1, 1, 0, 0, 0)
_BLOCK = MIB
_Session = TypeVar("_Session", RunHeader, Resumption)


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class Frames(_Part):
    """Number and hash of the frames that the agent saw."""

    count: int = Field(ge=0)
    sha256: str
    """Hash of the frames' hashes, in the order of the records."""


class Entry(_Part):
    """Content of `entry.json`."""

    schema_version: int = Field(default=SCHEMA, ge=SCHEMA, le=SCHEMA)
    metadata: EntryMetadata
    pack: str
    pack_sha256: str
    frames: Frames
    figures: dict[str, tuple[float | None, float | None, float | None]] = Field(max_length=1000)
    """Name of a figure -> its value and interval, as the submitter computed them; the check computes them again."""
    files: dict[str, str] = Field(max_length=len(MEMBERS))
    """Name of a member -> SHA-256."""


_PATHS = ("pack_folder", "asset_database")
"""Names of the facts about the machine (`host` in the header) that are paths."""


def without_paths(header: RunHeader) -> RunHeader:
    """Return a header without the paths and addresses of the machine; the run's hash stays the same."""
    spec = header.spec.model_copy(update={"base_url": None})
    sessions = tuple(map(_without_paths, header.resumed))
    return _without_paths(header).model_copy(update={"spec": spec, "resumed": sessions})


def _without_paths(session: _Session) -> _Session:
    host = {name: value for name, value in session.host.items() if name not in _PATHS}
    answered = session.answered and session.answered.model_copy(update={"addresses": ()})
    return session.model_copy(update={"host": host, "answered": answered})


def sha256_of(data: bytes) -> str:
    """Return the SHA-256 of a member."""
    return hashlib.sha256(data).hexdigest()


def write_bundle(out: Path, entry: Entry, members: Mapping[str, bytes]) -> None:
    """Write a bundle; the same content gives the same bytes. Raises RecordError."""
    text = json.dumps(entry.model_dump(mode="json"), indent=1, sort_keys=True, ensure_ascii=False)
    whole = {ENTRY_FILE: text.encode() + b"\n", **members}
    for name, data in whole.items():
        if len(data) > MEMBERS[name]:
            raise RecordError(f"{name} has {len(data):,} bytes, but may have at most {MEMBERS[name]:,} in a bundle.")
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED, compresslevel=6) as file:
        for name in (name for name in MEMBERS if name in whole):
            info = zipfile.ZipInfo(name, _EPOCH)
            info.compress_type, info.create_system = zipfile.ZIP_DEFLATED, 3
            info.external_attr = (stat.S_IFREG | 0o644) << 16
            file.writestr(info, whole[name])
    if buffer.tell() > MAX_ZIP_BYTES:
        raise RecordError(f"The bundle would have {buffer.tell():,} bytes, but may have at most {MAX_ZIP_BYTES:,}.")
    try:
        out.write_bytes(buffer.getvalue())
    except OSError as error:
        raise RecordError(f"{str(out)!r} cannot be written: {error.strerror}. Give another --out.") from None


def unpack_bundle(path: Path, folder: Path) -> Entry:
    """Unpack a bundle into an empty folder, as the folder of a run, and return its entry.

    Raises RecordError that says what is wrong with the bundle.
    """
    with open_file(path, f"Bundle {str(path)!r}", RecordError) as file:
        _check_directory(file)
        try:
            with zipfile.ZipFile(file) as bundle:
                infos = bundle.infolist()
                _check_members(infos)
                hashes = {info.filename: _unpack(bundle, info, folder / info.filename) for info in infos}
        except (zipfile.BadZipFile, NotImplementedError, EOFError, ValueError, zlib.error) as error:
            raise RecordError(f"the bundle is not a complete zip file: {_shown(error)}") from None
    data = read_file(folder / ENTRY_FILE, ENTRY_FILE, RecordError)
    try:
        entry = Entry.model_validate_json(data)
    except ValidationError as error:
        raise RecordError(f"{ENTRY_FILE} of the bundle is not valid: {_shown(first_error(error))}") from None
    found = {name: sha256 for name, sha256 in hashes.items() if name != ENTRY_FILE}
    for name in sorted(found.keys() | entry.files.keys()):
        if found.get(name) != entry.files.get(name):
            raise RecordError(
                f"{_shown(name)} does not have the hash in {ENTRY_FILE}: the file was changed, added or removed"
            )
    _check_header(read_header(folder), entry)
    return entry


def _check_directory(file: BinaryIO) -> None:
    """Check the size of a zip file, and of its directory, before the directory is read into memory."""
    size = file.seek(0, io.SEEK_END)
    if size > MAX_ZIP_BYTES:
        raise RecordError(f"the bundle has {size:,} bytes, but may have at most {MAX_ZIP_BYTES:,}")
    file.seek(max(0, size - _END_SIZE))
    end = file.read(_END_SIZE)
    if len(end) < _END_SIZE or not end.startswith(_END):
        raise RecordError("the bundle is not a complete zip file, or has a zip comment; make it with `vigil submit`")
    file.seek(max(0, size - _END_SIZE - 20))
    if file.read(4) == _END_64:
        raise RecordError("the bundle is a ZIP64 file (for more than 4 GiB); make it with `vigil submit`")
    count, directory = struct.unpack("<HL", end[10:16])
    if count > len(MEMBERS) or directory > MAX_DIRECTORY_BYTES:
        raise RecordError(
            f"the bundle's directory has {count} files and {directory:,} bytes; only {len(MEMBERS)} files are allowed"
        )
    file.seek(0)


def _check_members(infos: Iterable[zipfile.ZipInfo]) -> None:
    names = [info.filename for info in infos]
    for info in infos:
        name = info.filename
        kind = stat.S_IFMT(info.external_attr >> 16)
        if name not in MEMBERS or info.orig_filename != name:
            raise RecordError(
                f"the bundle contains {_shown(repr(info.orig_filename))}; only {', '.join(MEMBERS)} are allowed"
            )
        if kind not in (0, stat.S_IFREG):
            raise RecordError(f"{name} in the bundle is a link or another special file")
        if names.count(name) > 1:
            raise RecordError(f"{name} is in the bundle twice")
        if info.flag_bits & 1 or info.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
            raise RecordError(f"{name} in the bundle is encrypted, or compressed by a method other than deflate")
        if info.file_size > MEMBERS[name]:
            raise RecordError(
                f"{name} has {info.file_size:,} bytes when unpacked, but may have at most {MEMBERS[name]:,}"
            )
    for name in (ENTRY_FILE, HEADER_FILE, EPISODES_FILE):
        if name not in names:
            raise RecordError(f"the bundle does not contain {name}")


def _unpack(bundle: zipfile.ZipFile, info: zipfile.ZipInfo, out: Path) -> str:
    """Unpack a member and return its SHA-256. Stop at the size limits, because the sizes in a zip file may be false."""
    digest, size, row = hashlib.sha256(), 0, 0
    with bundle.open(info) as source, out.open("wb") as target:
        while block := source.read(_BLOCK):
            size += len(block)
            lines = block.split(b"\n")
            longest = max(row + len(lines[0]), *map(len, lines))
            row = len(lines[-1]) + (row if len(lines) == 1 else 0)
            if size > MEMBERS[info.filename]:
                raise RecordError(f"{info.filename} has more than {MEMBERS[info.filename]:,} bytes when unpacked")
            if longest > MAX_ROW_BYTES:
                raise RecordError(f"{info.filename} has a row of more than {MAX_ROW_BYTES:,} bytes")
            digest.update(block)
            target.write(block)
    return digest.hexdigest()


def _check_header(header: RunHeader, entry: Entry) -> None:
    if (header.spec.pack, header.spec.pack_sha256) != (entry.pack, entry.pack_sha256):
        raise RecordError(f"{HEADER_FILE} and {ENTRY_FILE} name different packs")
    if without_paths(header) != header:
        raise RecordError(
            f"{HEADER_FILE} contains paths or addresses of a machine; make the bundle with `vigil submit`, which "
            "leaves them out"
        )


def _shown(fault: object) -> str:
    return shorten(ascii(str(fault))[1:-1], 3 * MAX_SHOWN_CHARS)
