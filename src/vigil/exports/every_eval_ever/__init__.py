"""Results in the schema of Every Eval Ever, the database of evaluations of the EvalEval coalition.

Schema 0.3.0 of the package `every-eval-ever`: https://github.com/evaleval/every_eval_ever. Its own validator is run
by hand (`docs/export.md`); the tests hold what is written against copies of its two schemas.
"""
