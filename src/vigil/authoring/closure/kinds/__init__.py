"""The kinds of the suite. Each is a module that exports one `KIND`; `vigil.scoring.closure` finds these modules.

Scoring imports all of them. Therefore each module imports only `vigil.scoring.closure_kind`, and gives its functions by
name. A kind that has code is a folder: `KIND` is in `__init__`, and the other modules propose and check its tasks.
"""
