"""An engine that answers AI2-THOR's client from this project's simulators, so that AI2-THOR programs run on them.

It does not use Unity or AI2-THOR's assets. docs/ai2thor.md says which actions it answers like THOR.
"""
