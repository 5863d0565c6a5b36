"""The last passes of a frame: ambient occlusion, which darkens the picture where surfaces are close to each other."""

from typing import Any

import numpy as np

from vigil.rendering.context import moderngl, program
from vigil.rendering.viewer import FAR_M, NEAR_M, Viewer


class Canvas:
    """Framebuffer for pictures of one size, whose samples later passes read."""

    def __init__(self, context: Any, size: tuple[int, int], samples: int) -> None:
        self.colours, self.depth = (
            context.texture(size, 4, samples=samples),
            context.depth_texture(size, samples=samples),
        )
        self.drawn = context.framebuffer([self.colours], self.depth)

    def release(self) -> None:
        """Free the framebuffer."""
        release(self.drawn)


class AmbientOcclusion:
    """Screen-space ambient occlusion for pictures of one size."""

    def __init__(self, context: Any, size: tuple[int, int], backend: str) -> None:
        self._context = context
        half = (size[0] + 1) // 2, (size[1] + 1) // 2
        # Each pass reads what the last one wrote: distance; openness and distance; openness.
        kinds = (1, "f4", moderngl.NEAREST), (2, "f4", moderngl.NEAREST), (1, "f1", moderngl.LINEAR)
        self._halves = [context.texture(half, components, dtype=dtype) for components, dtype, _ in kinds]
        for each, (_, _, reading) in zip(self._halves, kinds, strict=True):
            each.filter = reading, reading
            each.repeat_x = each.repeat_y = False
        self._targets = [context.framebuffer([each]) for each in self._halves]
        self.shaded = context.framebuffer([context.renderbuffer(size, 4)])
        names = "distance", "nearness", "smooth", "combine"
        *self._programs, self.combine = [program(backend, "screen.vert", f"{name}.frag") for name in names]
        self._screens = [context.vertex_array(each, []) for each in (*self._programs, self.combine)]
        distance, nearness, smooth = self._programs
        distance["depth"].value, distance["planes"].value = 4, (NEAR_M, FAR_M)
        nearness["distances"].value = smooth["nearness"].value = self.combine["nearness"].value = 6
        self.combine["picture"].value = 5

    def apply(self, canvas: Canvas, viewer: Viewer, lamp: np.ndarray) -> None:
        """Write the darkened picture of a canvas to `shaded`, upside down.

        `lamp` (3,) is where the lamp of the viewed room is. The uniforms of `combine` that show the sky must have been
        set.
        """
        self._context.enable_only(moderngl.NOTHING)
        _, nearness, _ = self._programs
        canvas.depth.use(4)
        canvas.colours.use(5)
        nearness["slopes"].value = viewer.slopes
        ahead = viewer.axes * np.array([1.0, 1.0, -1.0])
        nearness["upward"].value, nearness["lamp"].value = tuple(ahead[2]), tuple((lamp - viewer.eye) @ ahead)
        for screen, target, read in zip(
            self._screens, [*self._targets, self.shaded], (None, *self._halves), strict=True
        ):
            if read is not None:
                read.use(6)
            target.use()
            screen.render(vertices=3)

    def release(self) -> None:
        """Free the OpenGL objects."""
        for each in [*self._screens, *self._targets, *self._halves]:
            each.release()
        release(self.shaded)


def release(target: Any) -> None:
    """Free a framebuffer and the pictures attached to it."""
    for part in (*target.color_attachments, target.depth_attachment):
        if part is not None:
            part.release()
    target.release()
