"""The schemes: one file and one row each; the first is the default."""

from ..scene.scheme import register_scheme
from .compatible import COMPATIBLE
from .published import BLANC_PASTOR, TAYLOR

for scheme in (COMPATIBLE, BLANC_PASTOR, TAYLOR):
    register_scheme(scheme)
