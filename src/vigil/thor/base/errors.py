"""Failures of actions, with AI2-THOR's messages and codes."""


class ActionFailed(Exception):
    """The failure of an action.

    `thrown` is the name of the exception that Unity would have thrown. If it is given, the message contains this name
    and a trace.
    """

    def __init__(self, message: str, *, thrown: str = "", code: str | None = None) -> None:
        super().__init__(f"{thrown}: {message}. trace: " if thrown else message)
        self.code = code


def invalid_operation(message: str) -> ActionFailed:
    """Return the failure that Unity reports for an action that does not make sense now."""
    return ActionFailed(message, thrown="InvalidOperationException")


def null_reference(message: str) -> ActionFailed:
    """Return the failure that Unity reports for an object that is not found."""
    return ActionFailed(message, thrown="NullReferenceException")


def bad_argument(message: str) -> ActionFailed:
    """Return the failure that Unity reports for an argument that is out of range, or for an unknown object."""
    return ActionFailed(message, thrown="ArgumentException")
