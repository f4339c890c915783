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

from importlib import import_module

TYPE_CHECKING = False  # as type checkers know it; `typing` takes longer to import than the rest of this file
if TYPE_CHECKING:
    from .public import *  # noqa: F403

__version__ = "0.1.0"


def __getattr__(name: str):
    """A public name, or their list: imported when first asked for, as the command answers Ctrl-C before it is."""
    try:
        public = import_module(".public", __name__)
    except AttributeError as error:  # else `from warpsph import …` would say that the name is unknown
        raise ImportError(f"warpsph can not be imported: {error}") from error
    if name == "__all__" or name in getattr(public, "__all__", ()):  # it has none yet while it is being imported
        return globals().setdefault(name, getattr(public, name))
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *import_module(".public", __name__).__all__})
