"""The light on a scene: computed once with rays from vertices and texels, then averaged along surfaces.

Which lamps are lit in a frame is decided by the simulator, in `vigil.sim.engines.mujoco.light_sources`.
"""
