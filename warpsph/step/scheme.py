"""The schemes: one file and one row each; the first is the default."""

from ..scene.registry import register
from .cells import CELLS
from .published import BLANC_PASTOR, TAYLOR

for scheme in (CELLS, BLANC_PASTOR, TAYLOR):
    register(scheme)
