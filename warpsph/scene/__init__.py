"""Scene description: what a user writes. No Warp in here."""

from ..mesh.continuum import BAR, CONTINUA, PLANE_STRAIN, SOLID, Continuum
from .check import Check
from .condition import Condition, Fixed, Free, PrescribedVelocity, Roller, Rotating
from .free_surface import FreeSurface
from .functions import Linear, Pulse, Ramp, Table
from .material import Elastic, PerzynaVonMises
from .numerics import KERNELS, PUBLISHED, SOURCE_SCHEMES, Numerics
from .output import EdgeForce, NodeValue, Output, Probe
from .parameter import Parameter
from .resolve import BoundaryTable
from .scene import BodyForce, Scene
from .scheme import SCHEMES, Scheme
from .selection import edge, everywhere, region, where
from .shape import Box, Disc, Mapped, Polygon, Shape

__all__ = [
    "BAR",
    "CONTINUA",
    "KERNELS",
    "PLANE_STRAIN",
    "PUBLISHED",
    "SCHEMES",
    "SOLID",
    "SOURCE_SCHEMES",
    "BodyForce",
    "BoundaryTable",
    "Box",
    "Check",
    "Condition",
    "Continuum",
    "Disc",
    "EdgeForce",
    "Elastic",
    "Fixed",
    "Free",
    "FreeSurface",
    "Linear",
    "Mapped",
    "NodeValue",
    "Numerics",
    "Output",
    "Parameter",
    "PerzynaVonMises",
    "Polygon",
    "PrescribedVelocity",
    "Probe",
    "Pulse",
    "Ramp",
    "Roller",
    "Rotating",
    "Scene",
    "Scheme",
    "Shape",
    "Table",
    "edge",
    "everywhere",
    "region",
    "where",
]
