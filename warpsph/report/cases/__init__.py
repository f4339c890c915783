"""The report's cases, in the paper's order; what each one runs, draws and says."""

from __future__ import annotations

from ..case import Case
from . import elastic_bar, gravity_slope, hanging_bar, strip_footing, tension, vertical_cut, wavy_surface

ORDER = (wavy_surface, hanging_bar, elastic_bar, gravity_slope, vertical_cut, strip_footing, tension)


def cases(quick: bool) -> list[Case]:
    """All cases that can be run, in full or in a quick form."""
    return [module.case(quick) for module in ORDER]
