"""AI2-THOR's protocol over two named pipes. A message is a sequence of fields with a type, a length and a body."""

import errno
import json
import os
import struct
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from typing import Any, BinaryIO, cast

from vigil.errors import SettingError
from vigil.thor.engine import EngineResponse, ThorEngine

HEADER = struct.Struct("!BI")
METADATA, ACTION, METADATA_PATCH, END_OF_MESSAGE = 1, 2, 11, 255
IMAGE_FIELDS = {
    ("image", False): 4,
    ("depth", False): 5,
    ("classes", False): 8,
    ("ids", False): 9,
    ("image", True): 10,
    ("depth", True): 12,
    ("ids", True): 14,
    ("classes", True): 15,
}
"""(kind of image, whether it is from a third-party camera) -> type number of the field with the image."""
MOST_BYTES = 2**28
"""Greatest size (bytes) of the body of an action."""
ASK_EVERY_S = 0.02
"""Interval (s) between attempts to open the pipe."""


class ClientGone(Exception):
    """The client closed its pipe, ended, or sent bytes that are not a message."""


def serve(engine: ThorEngine, environment: Mapping[str, str]) -> None:
    """Answer actions until the client ends."""
    parent = os.getppid()
    pack = packer()
    with suppress(ClientGone, BrokenPipeError), _opened(environment["AI2THOR_FIFO_SERVER_PIPE_PATH"], parent) as out:
        out.write(message(engine.first_response(), pack))
        out.flush()
        with open(environment["AI2THOR_FIFO_CLIENT_PIPE_PATH"], "rb") as incoming:
            for action in actions(incoming):
                out.write(message(engine.respond(action), pack))
                out.flush()


def _opened(path: str, parent: int) -> BinaryIO:
    """Return the pipe for answers as soon as the client reads from it. Raises ClientGone if the client ends first."""
    while True:
        try:
            number = os.open(path, os.O_WRONLY | os.O_NONBLOCK)
        except FileNotFoundError:
            raise ClientGone from None
        except OSError as error:
            if error.errno != errno.ENXIO:  # ENXIO: nobody reads yet
                raise
            if os.getppid() != parent:
                raise ClientGone from None
            time.sleep(ASK_EVERY_S)
            continue
        os.set_blocking(number, True)
        return os.fdopen(number, "wb")


def actions(incoming: BinaryIO) -> Iterator[dict[str, Any]]:
    """Yield the actions that the client sends, until the client closes the pipe.

    Raises ClientGone on bytes that are not a message.
    """
    while True:
        action: dict[str, Any] | None = None
        while True:
            header = incoming.read(HEADER.size)
            if len(header) < HEADER.size:
                return
            kind, length = HEADER.unpack(header)
            if kind == END_OF_MESSAGE:
                break
            if kind != ACTION or length > MOST_BYTES:
                raise ClientGone
            action = json.loads(incoming.read(length))
        if action is None:
            raise ClientGone
        yield action


def packer() -> Callable[[Any], bytes]:
    """Return the function that packs metadata. Raises SettingError without msgpack, which the client needs, too."""
    try:
        from msgpack import packb  # noqa: PLC0415  # pyright: ignore[reportMissingImports] - an extra
    except ImportError:
        text = "The engine needs msgpack, as AI2-THOR's client does. Give: pip install vigil-bench[thor]"
        raise SettingError(text) from None
    return cast("Callable[[Any], bytes]", packb)


def message(response: EngineResponse, pack: Callable[[Any], bytes]) -> bytes:
    """Return an answer as a message; `pack` packs its metadata."""
    kind = METADATA_PATCH if response.is_patch else METADATA
    fields = [(kind, pack(response.metadata))]
    fields += [(IMAGE_FIELDS[image.kind, image.is_third_party], image.data) for image in response.images]
    parts = [part for kind, body in fields for part in (HEADER.pack(kind, len(body)), body)]
    return b"".join([*parts, HEADER.pack(END_OF_MESSAGE, 0)])
