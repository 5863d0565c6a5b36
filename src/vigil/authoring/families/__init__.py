"""The families of the package, each a file that exports one `FAMILY`; `vigil.protocol.families` finds them.

They are imported with the protocol. Each file therefore imports only `vigil.protocol.family`, and gives the functions
that draft its kinds by name.
"""
