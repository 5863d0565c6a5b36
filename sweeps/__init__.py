"""Sweeps: commands that try to break VIGIL with many random cases, for hours if wanted. They are not tests.

    python -m sweeps.replies_fuzz     a million replies through the parser and the record
    python -m sweeps.episodes         whole episodes, with what must hold after every step
    python -m sweeps.handling         picking, placing, opening and closing, with what must hold of solids
    python -m sweeps.hostile          broken and malicious packs and houses

Each is cut into numbered pieces (`sweeps.support.pieces`): it continues where it stopped, prints its counts at the
end, and exits with 1 when any case failed. A case depends only on the seed and its number, and each failure is shown
with the command that repeats it. docs/reliability.md states the guarantees and the figures so far.
"""
