"""A background process of a stream: it makes the requested houses, one at a time.

Requests come on its standard input, and answers go to its standard output. When the requesting process ends, for
whatever reason, the input ends and this process ends too, even while it makes a house.
"""

import os
import pickle
import queue
import sys
import threading
import traceback
from typing import BinaryIO

from vigil.authoring.streaming.houses import StreamHouse, StreamHouseMaker, StreamSettings
from vigil.base.imports import import_modules_from_environment
from vigil.errors import SimulatorError, VigilError

Asked = tuple[StreamSettings, int]


def main() -> None:
    """Answer requests until the input ends."""
    import_modules_from_environment()
    with os.fdopen(os.dup(sys.stdout.fileno()), "wb") as answers:
        os.dup2(sys.stderr.fileno(), sys.stdout.fileno())  # what a library prints must not be read as an answer
        asked: queue.SimpleQueue[Asked] = queue.SimpleQueue()
        threading.Thread(target=_listen, args=(sys.stdin.buffer, asked), daemon=True).start()
        makers: dict[StreamSettings, StreamHouseMaker] = {}
        while True:
            settings, number = asked.get()
            if settings not in makers:
                makers = {settings: StreamHouseMaker(settings)}
            pickle.dump(_house_or_error(makers[settings], number), answers)
            answers.flush()


def _listen(requests: BinaryIO, asked: "queue.SimpleQueue[Asked]") -> None:
    while True:
        try:
            asked.put(pickle.load(requests))
        except (EOFError, pickle.UnpicklingError):
            os._exit(0)


def _house_or_error(maker: StreamHouseMaker, number: int) -> StreamHouse | VigilError:
    try:
        return maker.made(number)
    except VigilError as error:
        return error
    except Exception:  # noqa: BLE001 - sent to the requesting process
        return SimulatorError(f"House {number} of the stream could not be made:\n{traceback.format_exc(limit=-8)}")


if __name__ == "__main__":
    main()
