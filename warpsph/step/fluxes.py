"""Steps 3-10, the wave part of the step, by the name of the scheme."""

from .compatible import CompatibleFluxes
from .published import PublishedFluxes

FLUXES = {"blanc-pastor": PublishedFluxes, "taylor": PublishedFluxes, "compatible": CompatibleFluxes}
