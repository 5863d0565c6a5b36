"""The families of the package, each a module that exports one `FAMILY`; `vigil.protocol.families` finds them.

They are imported with the protocol. Each therefore imports only `vigil.protocol.family`, and gives the functions that
draft its kinds by name. A family with code of its own is a folder: `FAMILY` is in `__init__`, and next to it are the
code that drafts its kinds and the sentences that no other family uses.
"""
