"""Frames of a scene, drawn by OpenGL shaders. The light on surfaces is computed once with rays, so that no pass for
shadows is needed.

`painter.Painter` is the entry point; `scene` defines what it draws. Only `context` imports moderngl.
"""
