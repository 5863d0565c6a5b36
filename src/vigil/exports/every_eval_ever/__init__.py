"""Export of results in the schema of Every Eval Ever, the EvalEval coalition's database of evaluations.

Source: schema 0.3.0 of the package `every-eval-ever`, https://github.com/evaleval/every_eval_ever. Its validator is
run by hand (`docs/export.md`); the tests validate the output against copies of its two schemas.
"""
