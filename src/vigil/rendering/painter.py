"""Draws a scene: first the surfaces, then the sky, then glass, and last the ambient occlusion where surfaces meet."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np

from vigil.rendering.context import context_in, moderngl, program
from vigil.rendering.culling import InView
from vigil.rendering.light.lighting import Lighting
from vigil.rendering.mirrors import MirrorTargets
from vigil.rendering.scene import PointLight, RenderScene, RenderState
from vigil.rendering.sky import SKY_PIXELS, sky
from vigil.rendering.ssao import AmbientOcclusion, Canvas, release
from vigil.rendering.surfaces import Surfaces
from vigil.rendering.viewer import FAR_M, NEAR_M, HeldGeoms, Viewer

_CLIP_DISTANCE = 0x3000
"""OpenGL's constant GL_CLIP_DISTANCE0, for which moderngl does not have a name."""

_targets: dict[tuple[Callable[..., Any], tuple[int, int], tuple[Any, ...]], Any] = {}
"""Framebuffers that all painters of the process share, by the function that makes them, their size and options."""


class Painter:
    """Draws one scene."""

    def __init__(self, scene: RenderScene, backend: str, samples: int, *, has_ssao: bool) -> None:
        self._context, self._backend = context_in(backend), backend
        self._samples, self._has_ssao = samples, has_ssao
        with ThreadPoolExecutor(1) as other:
            lighting = other.submit(Lighting, scene)  # does not need OpenGL
            self._sky = _Sky(self._context, backend)
            self._surfaces = Surfaces(backend, lighting.result())

    def paint(
        self,
        state: RenderState,
        viewer: Viewer,
        lamp: np.ndarray,
        point_lights: list[PointLight],
        held: HeldGeoms | None = None,
    ) -> np.ndarray:
        """Return a picture (height, width, 3) uint8, top row first; `lamp` (3,) is where the room's lamp is."""
        self._surfaces.place(state, held)
        if held is not None:
            self._surfaces.hold(viewer, held)
        shown = self._surfaces.shown(viewer)
        mirrors = self._surfaces.mirrors(viewer, shown.geoms)
        shown = shown.without([mirror.geom for mirror in mirrors])
        behind = [viewer.behind(mirror) for mirror in mirrors]
        mirrored = [
            (camera, self._surfaces.shown(camera).without([mirror.geom]))
            for camera, mirror in zip(behind, mirrors, strict=True)
        ]
        self._surfaces.light(np.unique(np.concatenate([shown.geoms, *(sight.geoms for _, sight in mirrored)])))
        targets = self._target(MirrorTargets, viewer, self._samples) if mirrors else None
        if targets is not None:
            self._reflect(mirrored, targets, lamp, point_lights)
        canvas = self._target(Canvas, viewer, self._samples)
        self._begin(canvas.drawn)
        if targets is not None:
            for mirror, picture in zip(mirrors, targets.pictures, strict=False):
                self._surfaces.draw_mirrored(mirror, picture, viewer)
        for _ in self._surfaces.draw(viewer, shown, lamp, point_lights):
            if not self._has_ssao:
                self._sky.draw(viewer)
        if not self._has_ssao:
            return _read(canvas.drawn, viewer)[::-1].copy()
        ssao = self._target(AmbientOcclusion, viewer, self._backend)
        self._sky.show(ssao.combine, viewer)
        ssao.apply(canvas, viewer, lamp)
        return _read(ssao.shaded, viewer)

    def identify(
        self, state: RenderState, viewer: Viewer, held: HeldGeoms | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return each pixel's geom (height, width) int32 (-1 for none), and its depth in metres (inf for none)."""
        self._surfaces.place(state, held)
        size = viewer.width, viewer.height
        target = self._context.framebuffer(
            [self._context.texture(size, 1, dtype="i4")], self._context.depth_texture(size)
        )
        self._begin(target)
        self._surfaces.draw_owners(viewer)
        owners, depth = target.color_attachments[0], target.depth_attachment
        geoms = np.frombuffer(owners.read(), np.int32).reshape(size[::-1])[::-1] - 1
        far = np.frombuffer(depth.read(), np.float32).reshape(size[::-1])[::-1].astype(np.float64)
        release(target)
        metres = NEAR_M * FAR_M / (FAR_M - far * (FAR_M - NEAR_M))
        return geoms, np.where(far >= 1.0, np.inf, metres).astype(np.float32)

    def close(self) -> None:
        """Free the OpenGL objects."""
        for each in (self._surfaces, self._sky):
            each.release()

    def _reflect(
        self,
        mirrored: list[tuple[Viewer, InView]],
        targets: MirrorTargets,
        lamp: np.ndarray,
        point_lights: list[PointLight],
    ) -> None:
        """Draw the picture of each mirror."""
        self._context.enable_direct(_CLIP_DISTANCE)
        self._context.front_face = "cw"
        for (behind, shown), flat in zip(mirrored, targets.flat, strict=False):
            targets.drawn.scissor = behind.box  # the rest of the picture is not used
            self._begin(targets.drawn)
            for _ in self._surfaces.draw(behind, shown, lamp, point_lights):
                self._sky.draw(behind)
            self._context.copy_framebuffer(flat, targets.drawn)
        self._context.front_face = "ccw"
        self._context.disable_direct(_CLIP_DISTANCE)

    def _begin(self, target: Any) -> None:
        """Clear a framebuffer and make it the one that is drawn into."""
        target.use()
        target.clear(depth=1.0)
        self._context.enable_only(moderngl.DEPTH_TEST | moderngl.CULL_FACE)
        self._context.depth_func = "<"

    def _target(self, make: Callable[..., Any], viewer: Viewer, *arguments: Any) -> Any:
        """Return the target that `make` creates for pictures of the viewer's size; it is created only once."""
        size = viewer.width, viewer.height
        key = make, size, arguments
        if key not in _targets:
            _targets[key] = make(self._context, size, *arguments)
        return _targets[key]


class _Sky:
    """The sky and the landscape behind everything else."""

    def __init__(self, context: Any, backend: str) -> None:
        self._context = context
        self._cube = context.texture_cube((SKY_PIXELS, SKY_PIXELS), 3, sky())
        self._program = program(backend, "screen.vert", "sky.frag")
        self._screen = context.vertex_array(self._program, [])

    def draw(self, viewer: Viewer) -> None:
        """Draw the sky where nothing else has been drawn."""
        self._context.enable_only(moderngl.DEPTH_TEST)
        self._context.depth_func = "<="
        self.show(self._program, viewer)
        self._screen.render(vertices=3)

    def show(self, shader: Any, viewer: Viewer) -> None:
        """Set the uniforms of a shader program that reads the sky."""
        self._cube.use(3)
        shader["sky"].value = 3
        rays = viewer.axes @ np.diag([*viewer.slopes, -1.0])
        shader["rays"].write(rays.T.astype(np.float32).tobytes())

    def release(self) -> None:
        """Free the OpenGL objects."""
        self._screen.release()
        self._cube.release()


def _read(target: Any, viewer: Viewer) -> np.ndarray:
    """Return the colours (height, width, 3) uint8 of a framebuffer, lowest row first."""
    picture = np.empty((viewer.height, viewer.width, 3), np.uint8)
    target.read_into(picture, components=3, alignment=1)
    return picture
