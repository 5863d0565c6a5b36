"""The families of the package. Each is a module that exports a `FAMILY`; `vigil.protocol.families` finds these modules.

The protocol imports all of them. Therefore each module imports only `vigil.protocol.family`, and its `FAMILY` has names
of functions, "package.module:function". A family that has code is a folder: `FAMILY` is in `__init__`, and the other
modules have the functions that draft its kinds and the sentences that only this family uses.
"""
