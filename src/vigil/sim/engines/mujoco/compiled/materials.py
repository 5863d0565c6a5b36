"""Materials of a scene: each look once per model."""

from vigil.assets.kernel.materials import Material, material
from vigil.assets.kernel.textures import texture
from vigil.sim.engines.mujoco.compiled.binding import NativeSpec

Tint = tuple[float, float, float] | None


class MaterialTable:
    """The materials that a model under construction has so far; MuJoCo knows their colours alone."""

    def __init__(self, spec: NativeSpec) -> None:
        self._spec = spec
        self._names: dict[tuple[str, Tint], str] = {}
        self.materials: dict[str, Material] = {}
        """The material of each name."""

    def name_of(self, key: str, tint: Tint = None) -> str:
        """Return the model's name of a material, adding it when it is new."""
        if (key, tint) not in self._names:
            name = f"material{len(self._names)}"
            self._names[key, tint] = name
            self.materials[name] = material(key, tint)
            self._spec.add_material(name=name, rgba=list(self.materials[name].rgba))
        return self._names[key, tint]

    def draw_textures(self) -> None:
        """Draws the textures of all materials, which are kept for whoever asks for them."""
        for each in self.materials.values():
            if each.texture_name is not None:
                texture(each.texture_name)

    @staticmethod
    def metres(key: str, tint: Tint = None) -> float:
        """Return how many metres of surface one repeat of the material's texture covers."""
        return material(key, tint).metres
