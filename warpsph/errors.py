"""What can go wrong, said in one line that names the field, its value and what is allowed."""

from __future__ import annotations

import difflib
from collections.abc import Iterable


class WarpSPHError(Exception):
    """Base class of every error that warpsph raises on purpose."""


class SceneError(WarpSPHError, ValueError):
    """A scene, a parameter or an option is not allowed.

    Attributes:
        field: name of the offending field, as the user wrote it.
        value: its value.
        allowed: what would be allowed instead.
    """

    def __init__(self, field: str, value: object, allowed: str):
        self.field, self.value, self.allowed = field, value, allowed
        super().__init__(" ".join(f"{field} = {_short(value)} is not allowed: {allowed}".split()))


class FunctionError(SceneError):
    """A user's function of time failed; where that is in the midst of a run, the run keeps what it has."""


class DamagedError(SceneError):
    """A file that a run has left can not be read: it is there, and nobody may act as if it were not."""


class BreakdownError(WarpSPHError, ArithmeticError):
    """A run came to something that can not be true, and ended there; what was recorded before stays.

    Args:
        what: what was seen.
        step: number of the step that produced it.
        time: simulated time at the end of that step [s].
        node: index of a material node where it was seen.
        position: the node's initial place [m].
        advice: what may have led there.

    Attributes:
        step, time, node: as given.
    """

    def __init__(self, what: str, *, step: int, time: float, node: int, position: Iterable[float], advice: str):
        self.step, self.time, self.node = step, time, node
        at = ", ".join(f"{x:.6g}" for x in position)
        super().__init__(
            f"{what} in step {step} (t = {time:.6g} s) at node {node}, initially at ({at}) m: the run ends here, "
            f"{advice}"
        )


class NonFiniteError(BreakdownError):
    """A field became NaN or infinite during a run."""


class StoppedError(WarpSPHError):
    """A signal asked a run to stop, and it did after a whole step.

    Attributes:
        status: exit status of the command, 128 + the signal's number.
    """

    def __init__(self, message: str, signal: int):
        self.status = 128 + signal
        super().__init__(message)


def _short(value: object, limit: int = 120) -> str:
    text = " ".join(repr(value).split())
    return text if len(text) <= limit else text[: limit - 1] + "…"


def one_of(options: Iterable[object], given: object = None) -> str:
    """The sentence "one of a, b, c", with the nearest right name where `given` is close to one."""
    names = [str(option) for option in options]
    near = difflib.get_close_matches(str(given), names, n=1) if given is not None else []
    hint = f" (did you mean {near[0]}?)" if near else ""
    return f"it must be one of {', '.join(names)}{hint}"
