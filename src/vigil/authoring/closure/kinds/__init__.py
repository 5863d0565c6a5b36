"""The kinds of the suite. Each is a module that exports one `KIND`; `vigil.scoring.closure` finds these modules.

Scoring imports all of them. Therefore each module imports only `vigil.scoring.closure_kind`, and its `KIND` has names
of functions, "package.module:function". A kind that has code is a folder: `KIND` is in `__init__`, and the other
modules propose and check its tasks.
"""
