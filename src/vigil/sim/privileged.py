"""Privileged parts of a simulator backend: for solvers, validation and authoring, never for an agent.

`PrivilegedQueries` answers questions about the house and about what is visible from any place. `SupportsRollback`
undoes changes. Both concern the house in its present state, after `load` and `reset`. Every member raises
SimulatorError before the first `load` and after `close`, and EpisodeError on an id that the house does not have. No
member draws a frame or changes later answers of `Simulator`.

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
    """Queries about the objects in the house, where the agent's body fits, and what is visible from any place."""

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

        For speed, a backend may return only pixels on a regular lattice. n = 0 when the object is out of view, hidden
        (also by glass), held or absent.
        """

    def points_visible_from(
        self, eye: Vec3, points: np.ndarray, object_id: str, *, through_glass: bool = False
    ) -> np.ndarray:
        """Return for points (n, 3) on an object whether (n,) each is visible, i.e. the ray from `eye` towards it meets
        this object first.

        `eye` may be anywhere and looks in all directions. With `through_glass`, rays pass through the panes of other
        objects; the object's own glass always counts as the object. All are False when it is held or absent.
        """

    def may_be_visible(self, object_id: str, min_px: int) -> bool:
        """Return whether `world` may find at least `min_px` visible pixels of an object.

        The answer is quick and may ignore other things that hide the object. So False means that fewer pixels are
        visible, but True does not promise that they are visible.
        """


class SupportsRollback(Protocol):
    """Contexts that undo all changes made inside them."""

    def rollback(self) -> AbstractContextManager[None]:
        """Return a context. At its end, everything that was done inside it is undone, also after an exception.

        Contexts can be nested. After the context, the world and every answer are the same as before, to the last bit.
        `load` must not be called inside.
        """

    def at_pose(self, pose: Pose) -> AbstractContextManager[None]:
        """Return a context with rollback in which the agent, with what it holds, is at a pose.

        It is not checked that the body fits there.
        """


@runtime_checkable
class PrivilegedSimulator(Simulator, PrivilegedQueries, SupportsRollback, Protocol):
    """A simulator for solvers, validation, authoring and the conformance suite.

    Every backend in `BACKENDS` is of this type.
    """
