"""House generator: `vigil.housegen.generate.generate(seed, spec)` returns a house in ProcTHOR's format.

The same arguments give the same bytes.
"""
