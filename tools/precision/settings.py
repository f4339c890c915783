"""What is varied: velocity scheme and Courant number together, else one choice at a time.

Choices that only sums over neighbours have are varied with the published scheme that keeps waves.
"""

from collections.abc import Iterator
from dataclasses import asdict, astuple, dataclass, fields, replace
from itertools import product

from warpsph.scene.numerics import Numerics
from warpsph.scene.registry import KERNELS
from warpsph.scene.scheme import SCHEMES

COURANT = (0.4, 0.8, 0.9, 1.0)
SUMS = "taylor"
EXACT_RATIO = 0.5  # h/Δx of the Gaussian with the nearest neighbours only: at C = 1 a bar's waves are exact


@dataclass(frozen=True)
class Setting:
    """One choice of the discretisation.

    Attributes:
        spacing: [m].
        velocity_scheme, courant, kernel, smoothing_ratio, source_scheme, sharpening: as in `Numerics`.
        precision: float32 or float64.
    """

    spacing: float
    velocity_scheme: str = Numerics.velocity_scheme
    courant: float = Numerics.courant
    kernel: str | None = None
    smoothing_ratio: float | None = None
    source_scheme: str = Numerics.source_scheme
    sharpening: float | None = None
    precision: str = "float64"

    def numerics(self) -> dict:
        """The arguments of `Numerics`."""
        return {name: value for name, value in asdict(self).items() if name not in ("spacing", "precision")}

    def texts(self) -> tuple[str, ...]:
        """The values as a CSV file holds them; nothing where a choice is left to the package."""
        return tuple("" if value is None else str(value) for value in astuple(self))

    def varies(self) -> str:
        """What sets it apart from the defaults, besides scheme, Courant number and spacing."""
        default = Setting(self.spacing, self.velocity_scheme, self.courant)
        if self.kernel != default.kernel:
            return self.kernel
        if self.smoothing_ratio != default.smoothing_ratio:
            return f"h = {self.smoothing_ratio:g} Δx"
        if self.sharpening != default.sharpening:
            return f"sharpening {self.sharpening:g}"
        changed = [
            name for name in ("source_scheme", "precision") if getattr(self, name) != getattr(default, name)
        ]
        return ", ".join(getattr(self, name) for name in changed)

    def label(self) -> str:
        """All of it but the spacing."""
        return ", ".join(filter(None, (self.velocity_scheme, f"C = {self.courant:g}", self.varies())))

    def __str__(self) -> str:
        return f"{self.label()}, Δx = {self.spacing:.4g}"


NAMES = tuple(field.name for field in fields(Setting))


def parse(texts: dict[str, str]) -> Setting:
    """The setting of a row of a CSV file."""
    numbers = ("spacing", "courant", "smoothing_ratio", "sharpening")
    kinds = {name: float if name in numbers else str for name in NAMES}
    return Setting(**{name: kinds[name](texts[name]) if texts[name] else None for name in NAMES})


def variants(spacing: float, flows: bool, ratios: tuple[float, ...]) -> Iterator[Setting]:
    """Every setting at one spacing; of source schemes only where sources matter."""
    base, sums = Setting(spacing), Setting(spacing, SUMS)
    for (scheme, record), courant in product(SCHEMES.items(), COURANT):
        if record.courant_limit is None or courant <= record.courant_limit:
            yield replace(base, velocity_scheme=scheme, courant=courant)
    yield replace(base, sharpening=0.0)
    for kernel in [*KERNELS][1:]:  # the first is the default
        yield replace(sums, kernel=kernel)
    for ratio in ratios:
        yield replace(sums, smoothing_ratio=ratio)
    if EXACT_RATIO in ratios:
        for scheme in (name for name, record in SCHEMES.items() if record.sums is not None):
            yield Setting(spacing, scheme, courant=1.0, smoothing_ratio=EXACT_RATIO)
    yield replace(base, precision="float32")
    if flows:
        yield replace(sums, source_scheme="rk4")
