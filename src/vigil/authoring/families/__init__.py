"""The families of the package, each a file that exports one `FAMILY`; `vigil.protocol.families` finds them.

They are imported with the protocol, so each imports `vigil.protocol.family` alone and names by text what drafts it.
"""
