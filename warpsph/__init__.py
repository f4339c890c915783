"""warpsph: large-deformation solid and soil dynamics by Runge-Kutta Taylor SPH on NVIDIA Warp.

A scene is built from named parts and run by a `Simulation`:

>>> from warpsph import Box, Elastic, Fixed, Scene, Simulation, edge
>>> scene = Scene(
...     shape=Box(size=(1.0,), spacing=0.1),
...     material=Elastic(young_modulus=8e7, density=2000.0),
...     conditions=[Fixed(edge("left"))],
...     velocity=lambda x: 1e-3 * x,
...     duration=1e-3,
... )
>>> simulation = Simulation(scene, device="cpu")
>>> simulation.run()
>>> simulation.field("stress").shape
(11, 1)
"""

__version__ = "0.1.0"

from . import analysis, frames
from .errors import BreakdownError, NonFiniteError, SceneError, WarpSPHError
from .materials import Elastic, Material, PerzynaVonMises
from .scene import (
    PUBLISHED,
    BodyForce,
    Box,
    Check,
    Disc,
    EdgeForce,
    Fixed,
    Free,
    FreeSurface,
    GivenMesh,
    Linear,
    NodeValue,
    Numerics,
    Output,
    Parameter,
    Polygon,
    PrescribedVelocity,
    Probe,
    Pulse,
    Ramp,
    Roller,
    Rotating,
    Scene,
    Shape,
    SmoothingKernel,
    Table,
    edge,
    everywhere,
    region,
    register,
    tag,
    where,
)
from .simulation.checkpoint import Checkpoint, write_checkpoint
from .simulation.history import History
from .simulation.simulation import Observer, Simulation

__all__ = [
    "PUBLISHED",
    "BodyForce",
    "Box",
    "BreakdownError",
    "Check",
    "Checkpoint",
    "Disc",
    "EdgeForce",
    "Elastic",
    "Fixed",
    "Free",
    "FreeSurface",
    "GivenMesh",
    "History",
    "Linear",
    "Material",
    "NodeValue",
    "NonFiniteError",
    "Numerics",
    "Observer",
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
    "SceneError",
    "Shape",
    "Simulation",
    "SmoothingKernel",
    "Table",
    "WarpSPHError",
    "analysis",
    "edge",
    "everywhere",
    "frames",
    "region",
    "register",
    "tag",
    "where",
    "write_checkpoint",
]
