"""A scene as a MuJoCo model, with all that is known of its parts; MuJoCo itself is imported by `binding` alone."""
