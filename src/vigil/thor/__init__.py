"""An engine that speaks AI2-THOR's protocols, over this project's simulators, so that AI2-THOR programs run on it.

It is not Unity and has none of AI2-THOR's assets. docs/ai2thor.md says which actions it answers like THOR.
"""
