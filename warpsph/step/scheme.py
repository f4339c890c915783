"""The schemes: one file and one row each; the first is the default."""

from ..scene.registry import register
from .compatible import COMPATIBLE
from .published import BLANC_PASTOR, TAYLOR

for scheme in (COMPATIBLE, BLANC_PASTOR, TAYLOR):
    register(scheme)
