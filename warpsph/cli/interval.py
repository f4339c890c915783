"""How often to write a checkpoint, as the command line says it."""

from __future__ import annotations

import math
import re

from ..errors import SceneError
from ..simulation.checkpoint import Interval


def parse_interval(text: str) -> Interval:
    """How often, from a text such as 500, 0.2s, 10min or 1h.

    >>> parse_interval("500").steps, parse_interval("0.2s").time, parse_interval("1.5h").seconds
    (500, 0.2, 5400.0)
    """
    found = re.fullmatch(r"\s*([0-9.]+(?:e[+-]?[0-9]+)?)\s*(s|min|h|)\s*", text, re.IGNORECASE)
    allowed = "it must be a number of steps (500), a simulated time (0.2s) or a wall time (10min, 1h), above 0"
    try:
        amount, unit = float(found[1]), found[2].lower()
    except (TypeError, ValueError):
        amount, unit = math.nan, ""
    if not 0.0 < amount < math.inf or (not unit and amount != int(amount)):
        raise SceneError("--checkpoint-every", text, allowed)
    if unit == "s":
        return Interval(time=amount)
    return Interval(seconds=amount * {"min": 60.0, "h": 3600.0}[unit]) if unit else Interval(steps=int(amount))
