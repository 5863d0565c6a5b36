"""Solving: playing episodes with privileged access, through the same skills as any agent."""
