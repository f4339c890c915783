"""The time step; importing it makes the schemes known."""

from . import scheme  # noqa: F401
