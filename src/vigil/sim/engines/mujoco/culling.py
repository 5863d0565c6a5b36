"""What need not be drawn: geoms beside the view whose shadows fall beside it too. The frame is the same without."""

import numpy as np

from vigil.observation import FRAME_HEIGHT, FRAME_WIDTH
from vigil.sim.engines.mujoco.model import HELD, CompiledModel

MARGIN_M = 0.01
ASPECT = FRAME_WIDTH / FRAME_HEIGHT


def unseen(
    model: CompiledModel, eye: np.ndarray, axes: np.ndarray, fovy_deg: float, aspect: float = ASPECT
) -> np.ndarray:
    """Returns which geoms (ngeom,) leave no trace in a frame; `eye` and `axes` (right, up, backward) in MuJoCo's frame.

    A shadow lies on the far side of its caster. So it stays outside a side of the view when the caster is outside that
    side, and farther out than the light.
    """
    native, data = model.native, model.data
    inward = _sides(axes, fovy_deg, aspect)
    radius = np.where(native.geom_rbound > 0.0, native.geom_rbound, np.inf)  # 0: a plane without end
    farthest_in = (data.geom_xpos - eye) @ inward.T + radius[:, None] + MARGIN_M
    lamps = native.light_pos[(native.light_active != 0) & (native.light_castshadow != 0)]
    limit = np.min((lamps - eye) @ inward.T, axis=0, initial=0.0)
    return (farthest_in < limit).any(axis=1) & (native.geom_group != HELD)


def _sides(axes: np.ndarray, fovy_deg: float, aspect: float) -> np.ndarray:
    """Returns the inward unit normals (5, 3) of the view's four sides and of the plane through the eye."""
    right, up, backward = axes.T
    height = np.tan(np.radians(fovy_deg) / 2)
    width = height * aspect
    inward = np.array(
        [
            -backward,
            right - width * backward,
            -right - width * backward,
            up - height * backward,
            -up - height * backward,
        ]
    )
    return inward / np.linalg.norm(inward, axis=1, keepdims=True)
