"""An engine that answers AI2-THOR's client with VIGIL's simulators, so that programs for AI2-THOR run on these
simulators.

It does not use Unity or AI2-THOR's assets. docs/ai2thor.md says which actions behave as in AI2-THOR.
"""
