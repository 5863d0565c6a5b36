"""The embedded simulator's engine on MuJoCo: MuJoCo casts rays, and `vigil.rendering` draws frames.

`engine.MujocoEngine` is the entry point. Only `compiled.binding` imports MuJoCo.
"""
