"""Scene description: what a user writes. No Warp in here."""

# ruff: noqa: F401 — names that other rooms ask this one for

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
