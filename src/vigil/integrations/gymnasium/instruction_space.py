"""The space of instructions: a text that asynchronous vectors hand on as it changes.

Gymnasium 1.4 reads a `Text` out of shared memory once, when the vector is made, and would return that first reading for
ever. How a space is read is a registry of Gymnasium's own, in which this space reads anew for every observation.
"""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, overload

from gymnasium.spaces import Text
from gymnasium.vector.utils import read_from_shared_memory


class InstructionText(Text):
    """Instructions of a pack."""


class _Current(Sequence[str]):
    """The texts that lie in shared memory now; a deep copy is a tuple of them, and stays."""

    def __init__(self, read: Callable[[], Any]) -> None:
        self._read = read

    @overload
    def __getitem__(self, index: int) -> str: ...
    @overload
    def __getitem__(self, index: slice) -> Sequence[str]: ...
    def __getitem__(self, index: int | slice) -> str | Sequence[str]:
        return self._read()[index]

    def __len__(self) -> int:
        return len(self._read())

    def __deepcopy__(self, memo: dict[int, Any]) -> tuple[str, ...]:
        return self._read()


@read_from_shared_memory.register(InstructionText)
def _read(space: InstructionText, shared_memory: Any, n: int = 1) -> Any:
    return _Current(partial(read_from_shared_memory.dispatch(Text), space, shared_memory, n))
