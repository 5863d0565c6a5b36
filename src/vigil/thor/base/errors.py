"""Why an action failed, in AI2-THOR's words and codes."""


class ActionFailed(Exception):
    """An action that did not do what it was asked to.

    `thrown` names the exception that Unity would have thrown; such messages carry its name and a trace.
    """

    def __init__(self, message: str, *, thrown: str = "", code: str | None = None) -> None:
        super().__init__(f"{thrown}: {message}. trace: " if thrown else message)
        self.code = code


def invalid_operation(message: str) -> ActionFailed:
    """Return what Unity throws for an action that makes no sense now."""
    return ActionFailed(message, thrown="InvalidOperationException")


def null_reference(message: str) -> ActionFailed:
    """Return what Unity throws for an object that is not found."""
    return ActionFailed(message, thrown="NullReferenceException")


def bad_argument(message: str) -> ActionFailed:
    """Return what Unity throws for an argument out of its range, or an unknown object."""
    return ActionFailed(message, thrown="ArgumentException")
