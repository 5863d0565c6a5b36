"""OpenGL settings that MuJoCo's renderer leaves at their defaults: softer shadows, and no specks.

MuJoCo sets neither the matrix of the shadow map's texture unit nor, after it has made them, the parameters of its
textures, so what is set here holds for as long as the context lives.
"""

from vigil.sim.mujoco.binding import GL, RenderContext

SHADOW_BIAS = 0.004
"""A surface's distance from the lamp counts as this share shorter, or rounding would speckle it with its own shadow."""


def tune(context: RenderContext) -> None:
    """Tunes a render context that has just been made and is current."""
    if context.shadowFBO:
        _soften_shadows(context.shadowTex)


def _soften_shadows(texture: int) -> None:
    """Makes the shadow test darken colours in proportion, and lifts surfaces a little towards the lamp.

    What lies outside the shadow map is lit (depth is reversed: 0 is infinitely far from the lamp).
    """
    GL.glActiveTexture(GL.GL_TEXTURE1)
    GL.glBindTexture(GL.GL_TEXTURE_2D, texture)
    GL.glTexParameteri(GL.GL_TEXTURE_2D, GL.GL_DEPTH_TEXTURE_MODE, GL.GL_LUMINANCE)
    for axis in (GL.GL_TEXTURE_WRAP_S, GL.GL_TEXTURE_WRAP_T):
        GL.glTexParameteri(GL.GL_TEXTURE_2D, axis, GL.GL_CLAMP_TO_BORDER)
    GL.glTexParameterfv(GL.GL_TEXTURE_2D, GL.GL_TEXTURE_BORDER_COLOR, (0.0, 0.0, 0.0, 0.0))
    GL.glMatrixMode(GL.GL_TEXTURE)
    GL.glLoadIdentity()
    GL.glScalef(1.0, 1.0, 1.0 + SHADOW_BIAS)
    GL.glMatrixMode(GL.GL_MODELVIEW)
    GL.glActiveTexture(GL.GL_TEXTURE0)


def set_back() -> None:
    """Sets the first pass of the coming frame back by a hair.

    MuJoCo draws everything, then adds the lamp's light to what lies at the same depth. Drivers may compute that depth
    a rounding error apart in the two passes, and pixels would miss their light. (Depth is reversed: less is farther.)
    """
    GL.glEnable(GL.GL_POLYGON_OFFSET_FILL)
    GL.glPolygonOffset(0.0, -4.0)
