"""Sweeps: commands that try to break VIGIL with many random cases, for hours if wanted. They are not tests.

    python -m sweeps.replies_fuzz     a million replies through the parser and the record
    python -m sweeps.episodes         whole episodes, with what must hold after every step
    python -m sweeps.handling         picking, placing, opening and closing, with what must hold of solids
    python -m sweeps.hostile          broken and malicious packs and houses

Each is cut into numbered pieces (`sweeps.support.pieces`): it goes on where it stopped, says at its end what it
counted, and exits with 1 when anything fell. A case depends on the seed and its own number alone, and each case that
fell is shown with the command that repeats it. What is promised, and the figures so far: docs/reliability.md.
"""
