"""A scene as a MuJoCo model, with tables of its parts. Only the module `binding` imports MuJoCo."""
