"""The schemes: one file and one row each; the first is the default."""

from ..scene.registry import register
from .cells import CELLS
from .compatible import COMPATIBLE
from .published import BLANC_PASTOR, TAYLOR

for scheme in (COMPATIBLE, CELLS, BLANC_PASTOR, TAYLOR):
    register(scheme)
