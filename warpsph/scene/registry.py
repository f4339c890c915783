"""What scenes can name: one table for each kind of thing, and the function that adds to them."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeVar

from ..errors import SceneError
from .material import Material
from .scheme import SCHEMES, Scheme
from .smoothing import SmoothingKernel

if TYPE_CHECKING:
    from .scene import Scene

PACKAGE = __package__.partition(".")[0]
MATERIALS: dict[str, type[Material]] = {}
KERNELS: dict[str, SmoothingKernel] = {}

Record = TypeVar("Record", type[Material], SmoothingKernel, Scheme)


def register(record: Record) -> Record:
    """Make a material, a smoothing kernel or a scheme known by its name.

    A scene document names a material by its `type`, a scene the others by `Numerics.kernel` and
    `Numerics.velocity_scheme`. A scene file registers its own as it is read, or imports a module that does.

    Args:
        record: a subclass of `Material` (so that this may decorate it), a `SmoothingKernel` or a `Scheme`.

    Returns:
        The record itself.

    Raises:
        SceneError: it is none of them, or its name is taken. What the same place in the code made before is
            replaced: a scene file may be read twice, a cell of a notebook run again.
    """
    table, name, place = _row(record)
    if name in table and _row(table[name])[-1] != place:
        raise SceneError(f"name of {place}", name, f"{_row(table[name])[-1]} has this name")
    table[name] = record
    return record


def _row(record: object) -> tuple[dict, str, str]:
    """The table of a record's kind, its name in there, and the place in the code that makes it what it is."""
    if isinstance(record, type) and issubclass(record, Material):
        return MATERIALS, record.__name__, _place(record)
    if isinstance(record, SmoothingKernel):
        return KERNELS, record.name, _place(record.weights)
    if isinstance(record, Scheme):
        return SCHEMES, record.name, _place(record.stepper if record.sums is None else record.sums.fluxes)
    raise SceneError("register", record, "it must be a subclass of Material, a SmoothingKernel or a Scheme")


def _place(made_by: object) -> str:
    return f"{made_by.__module__}.{getattr(made_by, '__qualname__', made_by)}"


def needs_code(scene: Scene) -> bool:
    """Whether a scene names what code outside of this package has registered: a document alone can not know it."""
    numerics = scene.numerics
    kernels = () if numerics.scheme.sums is None else (numerics.smoothing,)
    records = (type(scene.material), numerics.scheme, *kernels)
    return not all(_row(record)[-1].startswith(f"{PACKAGE}.") for record in records)
