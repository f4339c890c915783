"""What an interface between a body and a tool carries: nothing, friction, adhesion, the soil's strength, all.

Pressed together they carry any pressure, and along the surface at most friction times the pressure plus a
strength; then they slip. What is pulled comes off, unless it is glued.
"""

from __future__ import annotations

from dataclasses import dataclass

from ..validate import number


@dataclass(frozen=True)
class Interface:
    """An interface; a subclass says what it carries.

    Attributes:
        friction: μ, of the pressure [-].
        strength: shear stress that it carries without pressure [Pa], or None for the soil's own.
        glued: whether nodes that have touched the tool stay where they are on it.
    """

    @property
    def carried(self) -> tuple[float, float | None, bool]:
        """Friction [-], strength [Pa] or None for the soil's own, and whether it is glued."""
        raise NotImplementedError


@dataclass(frozen=True)
class Smooth(Interface):
    """No shear at all."""

    @property
    def carried(self):
        return 0.0, 0.0, False


@dataclass(frozen=True)
class Coulomb(Interface):
    """Shear stress up to μ times the pressure.

    Args:
        friction: μ [-].
    """

    friction: float

    def __post_init__(self):
        object.__setattr__(self, "friction", number("Coulomb.friction", self.friction, at_least=0.0))

    @property
    def carried(self):
        return self.friction, 0.0, False


@dataclass(frozen=True)
class Adhesive(Interface):
    """Shear stress up to a strength, however small the pressure, plus μ times the pressure.

    Args:
        strength: [Pa].
        friction: μ [-].
    """

    strength: float
    friction: float = 0.0

    def __post_init__(self):
        for name in ("strength", "friction"):
            object.__setattr__(self, name, number(f"Adhesive.{name}", getattr(self, name), at_least=0.0))

    @property
    def carried(self):
        return self.friction, self.strength, False


@dataclass(frozen=True)
class Rough(Interface):
    """Shear stress up to the soil's own strength where it touches, as it is then: soil slips over itself.

    What never flows, as an elastic body, never slips on it.
    """

    @property
    def carried(self):
        return 0.0, None, False


@dataclass(frozen=True)
class Glued(Interface):
    """Nodes that have touched it stay where they are on it, in tension as well."""

    @property
    def carried(self):
        return 0.0, 0.0, True
