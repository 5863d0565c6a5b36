"""Frames of a scene, drawn by OpenGL shaders. The light on surfaces is computed once by rays, so no shadow pass is
needed.

`painter.Painter` is the entry point; `scene` defines what it draws. Only `context` imports moderngl.
"""
