"""Frozen packs: their files, their names, and the code that freezes them. The packs of the package are in
`vigil/data`.
"""
