"""Draws compiled scenes with shaders of its own, lit by rays that are cast once: soft, and without a shadow pass.

`painter.Painter` is the entry point. moderngl is imported by `context` alone, the ray caster by `occluders`.
"""
