"""The closure-stress suite: its tasks, their certificates and drafts, and the selection and verification of packs."""
