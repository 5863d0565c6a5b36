"""The families of the package, each a module that exports one `FAMILY`; `vigil.protocol.families` finds them.

They are imported with the protocol. Each therefore imports only `vigil.protocol.family`, and gives the functions that
draft its kinds by name. A family with code of its own is a folder: `FAMILY` in `__init__`, beside it what drafts its
kinds, with the sentences that no other family uses.
"""
