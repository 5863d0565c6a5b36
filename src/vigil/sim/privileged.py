"""Privileged parts of a backend, for solvers, validation and authoring, never for an agent.

`PrivilegedQueries` answers questions about the house and about what can be seen from anywhere. `SupportsRollback`
undoes changes. Both concern the house as it is now, after `load` and `reset`. Every member raises SimulatorError before
the first `load` and after `close`, and EpisodeError on an id that the house does not have. No member draws, and none
changes what `Simulator` answers later.

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
    """Questions about the objects in the house, where the body fits, and what is seen from any place."""

    def object_ids(self) -> list[str]:
        """Return the ids of all objects present, held ones included, sorted."""

    def scene(self) -> Scene:
        """Return the house as `vigil.scene.build` makes it, each thing with its present position and state.

        Every call until the next `load` returns the same `Scene`, whose things follow every change of the world. The
        caller must not change it.
        """

    def room_at(self, position: Vec3) -> str | None:
        """Return the id of the room whose floor contains a position, whatever its height; None outside every room."""

    def can_stand(self, position: Vec3) -> bool:
        """Return whether the agent's body fits at a position: inside the rooms and clear of obstacles."""

    def pixels_of(self, object_id: str) -> np.ndarray:
        """Return the pixels (n, 2), integers x and y, on which a click from the agent's pose hits the object.

        A backend may return only those on a lattice with one stride, for speed. n = 0 when the object is out of view,
        hidden (also by glass), held or absent.
        """

    def points_visible_from(
        self, eye: Vec3, points: np.ndarray, object_id: str, *, through_glass: bool = False
    ) -> np.ndarray:
        """Return which (n,) of points (n, 3) on an object are visible: a ray from `eye` meets that object first.

        `eye` may be anywhere and looks in all directions. With `through_glass`, rays pass through the panes of other
        objects; the object's own glass always counts as the object. All are False when it is held or absent.
        """

    def may_be_visible(self, object_id: str, min_px: int) -> bool:
        """Return whether `world` may find at least `min_px` visible pixels of an object.

        The answer is quick and may ignore what hides the object: True does not promise visibility, but False excludes
        it.
        """


class SupportsRollback(Protocol):
    """Changes that are rolled back."""

    def rollback(self) -> AbstractContextManager[None]:
        """Return a context that undoes at its end all that was done inside it, also after an exception.

        Contexts nest. Afterwards the world is the same to the last bit, and so is every answer. `load` must not be
        called inside.
        """

    def at_pose(self, pose: Pose) -> AbstractContextManager[None]:
        """Return a context, with rollback, in which the agent is at a pose with what it holds.

        Nothing checks that the body fits there.
        """


@runtime_checkable
class PrivilegedSimulator(Simulator, PrivilegedQueries, SupportsRollback, Protocol):
    """A backend for solvers, validation, authoring and the conformance suite; all in `BACKENDS` are."""
