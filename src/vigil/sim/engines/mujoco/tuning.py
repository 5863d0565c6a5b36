"""OpenGL settings that MuJoCo's renderer leaves at their defaults: softer shadows, and no specks.

MuJoCo sets neither the matrix of the shadow map's texture unit nor, after it has made them, the parameters of its
textures, so what is set here holds for as long as the context lives.
"""

from vigil.sim.engines.mujoco.binding import GL, RenderContext

LAMP_BIAS, SUN_BIAS = 0.005, 0.0004
"""Surfaces count as this share nearer to the light than they are, or they would be speckled with their own shadow."""


def tune(context: RenderContext) -> None:
    """Tunes a render context that has just been made and is current."""
    if context.shadowFBO:
        _soften_shadows(context.shadowTex)


def _soften_shadows(texture: int) -> None:
    """Makes the shadow test darken colours in proportion.

    What lies outside the shadow map is lit (depth is reversed: 0 is infinitely far from the lamp).
    """
    GL.glActiveTexture(GL.GL_TEXTURE1)
    GL.glBindTexture(GL.GL_TEXTURE_2D, texture)
    GL.glTexParameteri(GL.GL_TEXTURE_2D, GL.GL_DEPTH_TEXTURE_MODE, GL.GL_LUMINANCE)
    for name in (GL.GL_TEXTURE_MIN_FILTER, GL.GL_TEXTURE_MAG_FILTER):
        GL.glTexParameteri(GL.GL_TEXTURE_2D, name, GL.GL_LINEAR)
    for axis in (GL.GL_TEXTURE_WRAP_S, GL.GL_TEXTURE_WRAP_T):
        GL.glTexParameteri(GL.GL_TEXTURE_2D, axis, GL.GL_CLAMP_TO_BORDER)
    GL.glTexParameterfv(GL.GL_TEXTURE_2D, GL.GL_TEXTURE_BORDER_COLOR, (0.0, 0.0, 0.0, 0.0))
    GL.glActiveTexture(GL.GL_TEXTURE0)


def lift(share: float) -> None:
    """Makes the shadow tests of the coming frames take surfaces for nearer to the light by a share."""
    GL.glActiveTexture(GL.GL_TEXTURE1)
    GL.glMatrixMode(GL.GL_TEXTURE)
    GL.glLoadIdentity()
    GL.glScalef(1.0, 1.0, 1.0 + share)
    GL.glMatrixMode(GL.GL_MODELVIEW)
    GL.glActiveTexture(GL.GL_TEXTURE0)
