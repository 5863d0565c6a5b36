"""The kinds of the suite, each a module that exports one `KIND`; `vigil.scoring.closure` finds them.

They are imported with scoring. Each therefore imports only `vigil.scoring.closure_kind`, and gives its functions by
name. A kind with code of its own is a folder: `KIND` is in `__init__`, and next to it is the code that proposes and
checks its tasks.
"""
