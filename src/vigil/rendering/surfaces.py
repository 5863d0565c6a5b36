"""A scene's triangles in OpenGL, and how each kind of surface is drawn."""

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
from PIL import Image

from vigil.rendering.context import context_in, moderngl, program
from vigil.rendering.culling import InView, in_view
from vigil.rendering.light.lighting import Lighting
from vigil.rendering.mirrors import mirrors_before
from vigil.rendering.scene import PointLight, RenderScene, RenderState
from vigil.rendering.structure_parts import StructureParts
from vigil.rendering.triangles import GROUPS, KINDS, SurfaceKind, Triangles
from vigil.rendering.viewer import HeldGeoms, Mirror, Viewer

OWN_LIGHT = 0.9
"""Factor by which the emission of a material that gives light, such as a screen, is multiplied."""
GRIPPER_COLOURS = np.array([[0.24, 0.25, 0.27, 1.0]] * 2 + [[0.93, 0.46, 0.12, 1.0]] * 2, np.float32)
"""Colours of the hand's boxes: two fingers, then the two pads at their tips."""
_ROWS = 5
"""Number of texels for each geom in the table of geoms: three for the rows of its matrix, two for its look."""
_UNITS = {"geoms": 0, "pictures": 1, "planes": 2}
"""Number of the texture unit that each texture of a surface is bound to."""
_NO_CLIP = 0.0, 0.0, 0.0, 1.0
_BLENDING = moderngl.SRC_ALPHA, moderngl.ONE_MINUS_SRC_ALPHA, moderngl.ONE, moderngl.ONE_MINUS_SRC_ALPHA
"""How transparent surfaces are mixed with what is behind them: two factors for colours, two for opacities."""
SIDE = 256
"""Width and height (pixels) of a layer of the texture."""
GROWTH = 16
"""Number of layers by which the OpenGL texture grows."""


class TextureArray:
    """Layers of `SIDE` x `SIDE` pixels in one array texture. The first is white, for materials without a texture."""

    def __init__(self) -> None:
        self._layers: dict[int, int] = {}
        self._pictures: list[np.ndarray] = [np.full((SIDE, SIDE, 3), 255, np.uint8)]
        self._texture: Any = None
        self._count = 0

    def layer_of(self, picture: np.ndarray | None) -> int:
        """Return the layer of a picture (h, w, 3) uint8. A new picture gets a new layer, which is never freed."""
        if picture is None:
            return 0
        if id(picture) not in self._layers:
            self._layers[id(picture)] = len(self._pictures)
            self._pictures.append(picture)
        return self._layers[id(picture)]

    @property
    def is_complete(self) -> bool:
        """Whether all layers that were added have been passed to OpenGL."""
        return self._count == len(self._pictures)

    def texture(self, context: Any) -> Any:
        """Return the OpenGL texture with all layers that were added."""
        if self.is_complete:
            return self._texture
        if self._texture is None or len(self._pictures) > self._texture.layers:
            if self._texture is not None:
                self._texture.release()
            layers = -(-len(self._pictures) // GROWTH) * GROWTH
            self._texture, self._count = context.texture_array((SIDE, SIDE, layers), 4), 0
            self._texture.filter = moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR
        for layer in range(self._count, len(self._pictures)):
            self._texture.write(_fitted(self._pictures[layer]).tobytes(), (0, 0, layer, SIDE, SIDE, 1))
        self._texture.build_mipmaps()
        self._count = len(self._pictures)
        return self._texture


def _fitted(picture: np.ndarray) -> np.ndarray:
    """Return the picture scaled to (`SIDE`, `SIDE`, 4), with its first row at the bottom, where v is 0.

    It has four channels, because software renderers read three channels much more slowly.
    """
    if picture.shape[:2] != (SIDE, SIDE):
        picture = np.asarray(Image.fromarray(picture).resize((SIDE, SIDE), Image.Resampling.BOX))
    fitted = np.full((SIDE, SIDE, 4), 255, np.uint8)
    for channel in range(3):
        fitted[..., channel] = picture[::-1, :, channel]
    return fitted


textures = TextureArray()
"""The textures of all scenes of this process."""


class _SceneBuffers:
    """The OpenGL buffers of a scene that all its `Surfaces` share, because they are the same in every state."""

    def __init__(self, context: Any, lighting: Lighting) -> None:
        geometry = lighting.geometry
        places = np.zeros((len(geometry.vertices), 2), np.float32)
        places[geometry.is_in_atlas[geometry.geoms]] = lighting.places
        corners = np.concatenate([geometry.vertices, geometry.normals, geometry.uvs, places], axis=1)
        self.vertices, self.owners = context.buffer(corners), context.buffer(geometry.geoms)
        self.corners = context.buffer(reserve=geometry.faces.nbytes)
        """Corners of the triangles of one drawing; they are written before they are drawn."""
        self.users = 0
        """Number of `Surfaces` that use the buffers."""


class Surfaces:
    """The surfaces of one scene."""

    def __init__(self, backend: str, lighting: Lighting) -> None:
        self._backend, self._context = backend, context_in(backend)
        self._lighting, self._geometry = lighting, lighting.geometry
        self._scene = self._geometry.scene
        self._state = self._scene.initial
        if "triangles" not in self._scene.cache:
            self._scene.cache["triangles"] = Triangles(self._geometry, StructureParts(self._geometry))
        self._triangles: Triangles = self._scene.cache["triangles"]
        self._looks = _looks(self._scene)
        self._is_holding = False
        self._arrays: dict[tuple[SurfaceKind | str, int], Any] = {}
        context, geometry = self._context, self._geometry
        self._buffers = self._scene.cache.get("buffers") or _SceneBuffers(context, lighting)
        self._scene.cache["buffers"] = self._buffers
        self._buffers.users += 1
        self._light = context.buffer(self._lighting.vertices)
        self._planes = context.texture(self._lighting.planes.shape[1::-1], 4)
        self._planes.repeat_x = self._planes.repeat_y = False
        self._table = context.texture((_ROWS, len(geometry.face_slices)), 4, dtype="f4")
        self._table.filter = moderngl.NEAREST, moderngl.NEAREST

    def hold(self, viewer: Viewer, held: HeldGeoms) -> None:
        """Compute and write the light on held things."""
        self._write_light(self._lighting.in_hand(self._state, held.geoms, viewer.axes[:, 1]))

    def place(self, state: RenderState, held: HeldGeoms | None) -> None:
        """Write the poses and looks of all geoms into the table."""
        self._state, count = state, len(state.positions)
        table = np.zeros((len(self._geometry.face_slices), _ROWS, 4), np.float32)
        table[:count, :3, :3] = state.rotations
        table[:count, :3, 3] = state.positions
        table[:count, 3:] = self._looks[state.materials]
        if held is not None:
            table[held.geoms, :3] *= held.scale
            table[held.geoms, :3, 3] += held.shift
            table[self._geometry.hand, :3] = held.gripper
            table[self._geometry.hand, 3] = GRIPPER_COLOURS
        self._is_holding = held is not None
        self._table.write(table.tobytes())
        self._table.use(0)

    def shown(self, viewer: Viewer) -> InView:
        """Return what may be in view."""
        return in_view(self._triangles, self._state, viewer)

    def mirrors(self, viewer: Viewer, shown: np.ndarray) -> list[Mirror]:
        """Return the mirrors among the shown geoms that the viewer sees from the front."""
        return mirrors_before(self._geometry, self._state, shown, viewer)

    def draw_mirrored(self, mirror: Mirror, picture: Any, viewer: Viewer) -> None:
        """Draw a mirror with the picture that it reflects."""
        made = self._array("mirror.frag").program
        made["mirrored"].value, made["size"].value = 3, (viewer.width, viewer.height)
        picture.use(3)
        self._draw_plain("mirror.frag", [self._triangles.faces_of(np.array([mirror.geom]))], viewer)

    def light(self, shown: np.ndarray) -> None:
        """Compute the light on shown geoms and write it to OpenGL, before they are drawn."""
        has_new_planes, changed = self._cast(shown)
        if has_new_planes:
            self._planes.write(self._lighting.planes.tobytes())
        self._write_light(changed)

    def draw(self, viewer: Viewer, shown: InView, lamp: np.ndarray, point_lights: list[PointLight]) -> Iterator[bool]:
        """Draw the opaque geoms, yield so that the caller can draw the background, then draw the transparent geoms."""
        groups = self._groups(shown)
        if self._is_holding and viewer.mirror is None:
            groups[0] = np.concatenate([self._triangles.faces_of(self._geometry.hand), groups[0]])
        starts = self._write_corners(groups)
        uniforms = _uniforms(viewer, lamp, point_lights)
        textures.texture(self._context).use(1)
        self._planes.use(2)
        for number, (kind, (start, count)) in enumerate(zip(GROUPS, starts, strict=True)):
            is_transparent = number == len(KINDS)
            if is_transparent:
                yield True
            if not count:
                continue
            if is_transparent:
                self._context.enable_only(moderngl.DEPTH_TEST | moderngl.CULL_FACE | moderngl.BLEND)
                self._context.blend_func = _BLENDING
                self._context.fbo.depth_mask = False
            array = self._array(kind, len(point_lights))
            for name, value in uniforms.items():
                uniform = array.program.get(name, None)  # programs without gloss lack some; `in` would look through all
                if uniform is not None:
                    uniform.write(value)
            array.render(vertices=count, first=start)
        self._context.fbo.depth_mask = True

    def draw_owners(self, viewer: Viewer) -> None:
        """Draw the number of the geom at each pixel."""
        self._draw_plain("identity.frag", self._groups(self.shown(viewer)), viewer)

    def _draw_plain(self, fragment: str, groups: list[np.ndarray], viewer: Viewer) -> None:
        """Draw groups of triangles with a fragment shader that needs only positions."""
        starts = self._write_corners(groups)
        array = self._array(fragment)
        array.program["view_projection"].write(_matrix(viewer))
        array.program["geoms"].value = 0
        array.render(vertices=sum(count for _, count in starts))

    def release(self) -> None:
        """Free the OpenGL objects."""
        freed = [*self._arrays.values(), self._light, self._planes, self._table]
        self._buffers.users -= 1
        if not self._buffers.users:
            del self._scene.cache["buffers"]
            freed += [self._buffers.vertices, self._buffers.owners, self._buffers.corners]
        for each in freed:
            each.release()

    def _cast(self, shown: np.ndarray) -> tuple[bool, list[slice]]:
        """Compute the light on shown geoms in another thread, and meanwhile write new textures to OpenGL."""
        if textures.is_complete:
            return self._lighting.update(self._state, shown)
        with ThreadPoolExecutor(1) as other:
            casting = other.submit(self._lighting.update, self._state, shown)
            textures.texture(self._context)
            return casting.result()

    def _write_light(self, changed: list[slice]) -> None:
        for part in changed:
            self._light.write(self._lighting.vertices[part].tobytes(), offset=4 * part.start)

    def _groups(self, shown: InView) -> list[np.ndarray]:
        """Return the triangles (n, 3) of each group of surfaces, with those of held geoms."""
        groups = shown.groups()
        held = shown.geoms[self._state.is_held[shown.geoms]]
        for geom, group in zip(held, self._triangles.groups_of(held, self._state.materials[held]), strict=True):
            groups[group] = np.concatenate([groups[group], self._triangles.faces_of(geom[None])])
        return groups

    def _write_corners(self, groups: list[np.ndarray]) -> list[tuple[int, int]]:
        """Write the corners of each group of triangles (n, 3); return (start, number of corners) of each."""
        counts = [group.size for group in groups]
        if any(counts):
            self._buffers.corners.write(np.concatenate(groups).tobytes())
        return list(zip(np.cumsum([0, *counts[:-1]]).tolist(), counts, strict=True))

    def _array(self, kind: SurfaceKind | str, point_lights: int = 0) -> Any:
        """Return the vertex array for a kind of surface, or for a fragment shader that needs positions only."""
        if (kind, point_lights) not in self._arrays:
            owners = self._buffers.owners, "1i", "geom"
            if isinstance(kind, str):
                made = program(self._backend, "identity.vert", kind)
                contents = [(self._buffers.vertices, "3f 28x", "position"), owners]
            else:
                made = program(self._backend, "surface.vert", "surface.frag", *kind.definitions(point_lights))
                for name, unit in _UNITS.items():
                    if name in made:
                        made[name].value = unit
                names = ["position", *(["normal"] if "normal" in made else []), "uv"]
                form = f"3f {'3f' if 'normal' in made else '12x'} 2f {'2f' if kind.is_in_atlas else '8x'}"
                contents = [(self._buffers.vertices, form, *names, *(["place"] if kind.is_in_atlas else [])), owners]
                if not kind.is_in_atlas:
                    contents.append((self._light, "3f1 1x1", "light"))
            self._arrays[kind, point_lights] = self._context.vertex_array(made, contents, self._buffers.corners)
        return self._arrays[kind, point_lights]


def _uniforms(viewer: Viewer, lamp: np.ndarray, point_lights: list[PointLight]) -> dict[str, bytes]:
    """Return the values of the uniforms of a surface's shader program, by name."""
    values = {
        "view_projection": viewer.matrix.T,
        "clip": _NO_CLIP if viewer.clip is None else viewer.clip,
        "eye": viewer.eye,
        "lamp": lamp,
    }
    if point_lights:
        values["light_places"] = np.array([light.place for light in point_lights])
        values["light_colours"] = np.array([light.colour for light in point_lights])
    return {name: np.asarray(value, np.float32).tobytes() for name, value in values.items()}


def _matrix(viewer: Viewer) -> bytes:
    return viewer.matrix.T.astype(np.float32).tobytes()


def _looks(scene: RenderScene) -> np.ndarray:
    """Return rows (materials, 2, 4). First row: colour, opacity. Second: texture layer, emission, gloss, metalness."""
    looks = np.zeros((len(scene.materials), 2, 4), np.float32)
    for number, look in enumerate(scene.materials):
        looks[number, 0] = look.rgba
        looks[number, 1] = textures.layer_of(look.texture), OWN_LIGHT * look.emission, look.shininess, look.is_metal
    return looks
