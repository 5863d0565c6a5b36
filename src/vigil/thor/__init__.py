"""An engine that speaks AI2-THOR's protocols, over a house of this project's: the client's own programs run on it.

It is no Unity and draws nothing of AI2-THOR's. What it answers like THOR, and what not, stands in docs/ai2thor.md.
"""
