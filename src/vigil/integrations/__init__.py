"""VIGIL inside of other people's frameworks. Each module needs a library that an extra of the package installs."""
