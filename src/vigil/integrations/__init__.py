"""VIGIL in other frameworks. Each module needs a library, which an optional extra of the package installs."""
