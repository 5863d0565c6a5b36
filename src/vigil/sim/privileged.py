"""Privileged parts of a simulator backend: they are for solvers, validation and authoring, never for an agent.

They answer questions about the house and about what is visible from any place, and undo changes. They concern the house
in its present state, after `load` and `reset`. Before the first `load` and after `close`, every member raises
SimulatorError. An id that the house does not have raises EpisodeError. No member draws a frame or changes later answers
of `Simulator`.

Places and lengths are in metres and angles in degrees, in the frame of `vigil.base.geometry` (x right, y up, z ahead).
Pixels are x (right) and y (down) from the top left corner of the frame, which has the size FRAME_WIDTH x FRAME_HEIGHT.
"""

# pyright: reportReturnType=false

from collections.abc import Collection
from contextlib import AbstractContextManager
from typing import Protocol, runtime_checkable

import numpy as np

from vigil.base.geometry import Pose, Vec3
from vigil.scene.things import Scene
from vigil.sim.protocol import Simulator


@runtime_checkable
class PrivilegedSimulator(Simulator, Protocol):
    """A simulator for solvers, validation, authoring and the conformance suite.

    Every backend in `BACKENDS` is of this type.
    """

    def object_ids(self) -> list[str]:
        """Return the sorted ids of all objects that are present, including held objects."""

    def scene(self) -> Scene:
        """Return the scene that `vigil.scene.build` makes of the house, with every thing in its present position and
        state.

        Until the next `load`, every call returns the same `Scene`, and its things follow every change of the world. The
        caller must not change it.
        """

    def room_at(self, position: Vec3) -> str | None:
        """Return the id of the room whose floor is below a position at any height; None outside every room."""

    def can_stand(self, position: Vec3) -> bool:
        """Return whether the agent's body fits at a position, i.e. it is inside the rooms and clear of obstacles."""

    def pixels_of(self, object_id: str) -> np.ndarray:
        """Return the pixels (n, 2; integers x and y) on which a click from the agent's pose hits the object.

        For speed, a backend may return only those pixels that are on a regular lattice. n is 0 if the object is out of
        view, hidden (also by glass), held or absent.
        """

    def points_visible_from(
        self, eye: Vec3, points: np.ndarray, object_id: str, *, through_glass: bool = False
    ) -> np.ndarray:
        """Return a mask (n,) of the visible points (n, 3) on an object, i.e. a ray from `eye` meets this object first.

        `eye` may be anywhere and looks in all directions. With `through_glass`, rays pass through the panes of other
        objects; the object's own glass always counts as the object. If the object is held or absent, no point is
        visible.
        """

    def may_be_visible(self, object_id: str, min_px: int) -> bool:
        """Return whether `world` may find at least `min_px` visible pixels of an object.

        The answer is quick, because it may ignore other things that hide the object. False means that fewer pixels are
        visible. True means only that this many may be visible.
        """

    def is_in_frame(self, object_id: str) -> bool:
        """Return whether at least one pixel of the frame shows an object, also through the panes of other objects.

        This is slower than `world`, which may count only some of the pixels and so miss thin parts. If `world` finds a
        visible pixel, the answer is True. Held and absent objects are not in the frame.
        """

    def looking_at(self, object_ids: Collection[str]) -> AbstractContextManager[None]:
        """Return a context in which `world` may say of all objects but these that they are not visible.

        This saves the time to measure how much of the other objects is visible.
        """

    def rollback(self) -> AbstractContextManager[None]:
        """Return a context that undoes, when it ends (also by an exception), everything that was done inside it.

        Contexts can be nested. After the context, the world and every answer are exactly the same as before. `load`
        must not be called inside.
        """

    def at_pose(self, pose: Pose) -> AbstractContextManager[None]:
        """Return a context with rollback in which the agent, with what it holds, is at a pose.

        Whether the body fits there is not checked.
        """
