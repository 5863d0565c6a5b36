"""VIGIL in other frameworks. Each module needs a library that an extra of the package installs."""
