"""VIGIL in other frameworks; each module needs a library that an extra of the package installs."""
