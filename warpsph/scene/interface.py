"""What an interface between a body and a tool carries: nothing, friction, adhesion, the soil's strength, all.

Pressed together they carry any pressure, and along the surface at most friction times the pressure plus a
strength; then they slip. What is pulled comes off, unless it is glued.

Friction follows the pressure at once, or with a `lag`, as it was measured to (Prakash and Clifton 1993): the
pressure p̄ that counts then has dp̄/dt = (p − p̄)/lag. An elastic body without damping that slides under friction
is unstable (Adams 2000): its waves grow, nodes stick and lift in turn, and the friction that is left is less. A
lag of the time that waves need through the body leaves its inside at rest.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from ..validate import number


class Carried(NamedTuple):
    """What an interface carries.

    Attributes:
        friction: μ, of the pressure [-].
        strength: shear stress without pressure [Pa], or None for the soil's own.
        lag: of the friction behind the pressure [s].
        glued: whether nodes that have touched the tool stay where they are on it.
    """

    friction: float = 0.0
    strength: float | None = 0.0
    lag: float = 0.0
    glued: bool = False


@dataclass(frozen=True)
class Interface:
    """An interface; a subclass says what it carries."""

    @property
    def carried(self) -> Carried:
        """What it carries."""
        raise NotImplementedError

    def _check(self, *names: str) -> None:
        for name in names:
            checked = number(f"{type(self).__name__}.{name}", getattr(self, name), at_least=0.0)
            object.__setattr__(self, name, checked)


@dataclass(frozen=True)
class Smooth(Interface):
    """No shear at all."""

    @property
    def carried(self):
        return Carried()


@dataclass(frozen=True)
class Coulomb(Interface):
    """Shear stress up to μ times the pressure.

    Args:
        friction: μ [-].
        lag: by which the friction is behind the pressure [s], see above.
    """

    friction: float
    lag: float = 0.0

    def __post_init__(self):
        self._check("friction", "lag")

    @property
    def carried(self):
        return Carried(friction=self.friction, lag=self.lag)


@dataclass(frozen=True)
class Adhesive(Interface):
    """Shear stress up to a strength, however small the pressure, plus μ times the pressure.

    Args:
        strength: [Pa].
        friction: μ [-].
        lag: by which the friction is behind the pressure [s], see above.
    """

    strength: float
    friction: float = 0.0
    lag: float = 0.0

    def __post_init__(self):
        self._check("strength", "friction", "lag")

    @property
    def carried(self):
        return Carried(friction=self.friction, strength=self.strength, lag=self.lag)


@dataclass(frozen=True)
class Rough(Interface):
    """Shear stress up to the soil's own strength where it touches, as it is then: soil slips over itself.

    What never flows, as an elastic body, never slips on it.
    """

    @property
    def carried(self):
        return Carried(strength=None)


@dataclass(frozen=True)
class Glued(Interface):
    """Nodes that have touched it stay where they are on it, in tension as well."""

    @property
    def carried(self):
        return Carried(glued=True)
