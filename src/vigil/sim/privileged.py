"""What a backend offers besides `vigil.sim.protocol.Simulator` to solvers, validation and authoring, never to an agent.

`PrivilegedQueries` tells what is in the house and what can be seen from anywhere; `SupportsRollback` undoes what was
tried. Both speak of the house as it is now, after `load` and `reset`; before the first `load` and after `close` every
member raises SimulatorError.
An id that the house does not have raises EpisodeError. None of it draws, and none of it may change what
`Simulator` answers later.

Places and lengths are in metres and angles in degrees, in the frame of `vigil.base.geometry` (x right, y up, z ahead).
Pixels are x (right) and y (down) from the top left corner of the frame, which is FRAME_WIDTH wide and FRAME_HEIGHT
high.
"""

# pyright: reportReturnType=false

from contextlib import AbstractContextManager
from typing import Protocol, runtime_checkable

import numpy as np

from vigil.base.geometry import Pose, Vec3
from vigil.scene.things import Scene
from vigil.sim.protocol import Simulator


class PrivilegedQueries(Protocol):
    """What is in the house, where the body fits, and what is seen from the agent's pose or any other place."""

    def object_ids(self) -> list[str]:
        """Return the ids of all objects present, held ones included, sorted."""

    def scene(self) -> Scene:
        """Return the house as `vigil.scene.build` makes it, each thing with its present place and state.

        From one `load` to the next it is the same object, whose things follow every `reset`, action and rehearsal. To
        look at, never to change.
        """

    def room_at(self, position: Vec3) -> str | None:
        """Return the id of the room whose floor holds a place, its height aside; None outside of every room."""

    def can_stand(self, position: Vec3) -> bool:
        """Whether the agent's body fits at a place, its height aside: inside the rooms, and touching no obstacle."""

    def pixels_of(self, object_id: str) -> np.ndarray:
        """Return pixels (n, 2) of x, y, integers, on which a click from the agent's pose hits the object.

        They may lie on a lattice with one stride, for speed. n = 0 when it is out of view, hidden (glass hides),
        held or absent.
        """

    def points_visible_from(
        self, eye: Vec3, points: np.ndarray, object_id: str, *, through_glass: bool = False
    ) -> np.ndarray:
        """Return for points (n, 3) on an object whether a ray from `eye` to each meets that object first: (n,) bool.

        `eye` may be anywhere, and nothing limits its view. With `through_glass`, rays pass the panes of other things;
        an object's own glass always counts as the object. All False when it is held or absent.
        """

    def may_be_visible(self, object_id: str, min_px: int) -> bool:
        """Whether `world` may say that at least so many pixels of an object are visible: True wherever it does.

        A quick answer, to be asked where few places will do; what hides the object may be left aside.
        """


class SupportsRollback(Protocol):
    """Trying what is undone afterwards."""

    def rollback(self) -> AbstractContextManager[None]:
        """Undoes at its end all that is done inside, also when that raises; rehearsals nest.

        Afterwards the world, to the last bit, and every answer are as they were. Inside, `load` must not be called.
        """

    def at_pose(self, pose: Pose) -> AbstractContextManager[None]:
        """Stands the agent at a pose, with what it holds, inside of a rehearsal; nothing checks that the body fits."""


@runtime_checkable
class PrivilegedSimulator(Simulator, PrivilegedQueries, SupportsRollback, Protocol):
    """A backend that solvers, validation, authoring and the conformance suite work on; those in `BACKENDS` are."""
