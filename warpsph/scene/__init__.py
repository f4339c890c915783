"""Scene description: what a user writes. No Warp in here."""

from ..mesh.continuum import BAR, CONTINUA, PLANE_STRAIN, SOLID, Continuum
from .check import Check
from .condition import Condition, Fixed, Free, PrescribedVelocity, Roller, Rotating
from .free_surface import FreeSurface
from .functions import Linear, Pulse, Ramp, Table
from .given_mesh import GivenMesh
from .interface import Adhesive, Coulomb, Glued, Interface, Rough, Smooth
from .load import Load, Pressure, Traction
from .material import Material
from .numerics import PUBLISHED, SOURCE_SCHEMES, Numerics
from .output import EdgeForce, NodeValue, Output, Probe, Reaction, ToolForce, ToolImpulse, ToolTorque
from .parameter import Parameter
from .registry import KERNELS, MATERIALS, register
from .remade import Remade
from .resolve import BoundaryTable
from .scene import BodyForce, Scene
from .scheme import SCHEMES, Scheme
from .selection import edge, everywhere, region, tag, where
from .shape import Box, Disc, Mapped, Polygon, Shape
from .smoothing import SmoothingKernel
from .tool import Block, Cylinder, Plane, Sphere, Tool

__all__ = [
    "BAR",
    "CONTINUA",
    "KERNELS",
    "MATERIALS",
    "PLANE_STRAIN",
    "PUBLISHED",
    "SCHEMES",
    "SOLID",
    "SOURCE_SCHEMES",
    "Adhesive",
    "Block",
    "BodyForce",
    "BoundaryTable",
    "Box",
    "Check",
    "Condition",
    "Continuum",
    "Coulomb",
    "Cylinder",
    "Disc",
    "EdgeForce",
    "Fixed",
    "Free",
    "FreeSurface",
    "GivenMesh",
    "Glued",
    "Interface",
    "Linear",
    "Load",
    "Mapped",
    "Material",
    "NodeValue",
    "Numerics",
    "Output",
    "Parameter",
    "Plane",
    "Polygon",
    "PrescribedVelocity",
    "Pressure",
    "Probe",
    "Pulse",
    "Ramp",
    "Reaction",
    "Remade",
    "Roller",
    "Rotating",
    "Rough",
    "Scene",
    "Scheme",
    "Shape",
    "Smooth",
    "SmoothingKernel",
    "Sphere",
    "Table",
    "Tool",
    "ToolForce",
    "ToolImpulse",
    "ToolTorque",
    "Traction",
    "edge",
    "everywhere",
    "region",
    "register",
    "tag",
    "where",
]
