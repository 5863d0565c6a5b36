"""Making packs of the closure-stress suite: tasks, certificates, drafts, selection, verification."""
