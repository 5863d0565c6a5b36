"""An engine that answers AI2-THOR's client from VIGIL's simulators, so that AI2-THOR's programs run on them.

It does not use Unity or AI2-THOR's assets. docs/ai2thor.md says which actions behave as in AI2-THOR.
"""
