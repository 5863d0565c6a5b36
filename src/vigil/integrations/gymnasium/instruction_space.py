"""Space of instructions: a text space for instructions that change, also in asynchronous vectors.

Gymnasium 1.4 reads the value of a `Text` space from shared memory only once, when the vector is made, and would return
this first value forever. For this space, Gymnasium uses a function that reads the value again for every observation.
"""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, overload

from gymnasium.spaces import Text
from gymnasium.vector.utils import read_from_shared_memory


class InstructionText(Text):
    """Space of the instructions of a pack."""


class _Current(Sequence[str]):
    """View of the texts that are currently in shared memory; its deep copy is a tuple of the texts at that moment."""

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
