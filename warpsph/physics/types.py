"""Warp types of the node sets: material nodes carry the mass, auxiliary nodes stand in the middle of cells."""

from dataclasses import dataclass
from functools import cache

import warp as wp

from ..device.precision import Precision
from ..mesh.continuum import Continuum


@dataclass(frozen=True)
class NodeTypes:
    """Warp types of the node sets of one continuum in one precision.

    Attributes:
        size: length of φ = (v, σ), d + s.
        vector, stress, phi: Warp vectors of length d, s and d + s.
        tensor: d × d matrix.
        stress_gradient: s × d matrix ∂σ_k/∂x_l.
        Point: what a neighbour is asked for, packed since one gather is cheaper than two: position x [m] and
            unknowns φ = (v [m/s], σ [Pa]). 8 values in the plane and 12 in space suit wide loads; with the volume
            in it they would not.
        MaterialNodes, AuxiliaryNodes: structs of arrays, see `warpsph.state.nodes`.
    """

    size: int
    vector: type
    stress: type
    phi: type
    tensor: type
    stress_gradient: type
    Point: type
    MaterialNodes: type
    AuxiliaryNodes: type


@cache
def node_types(continuum: Continuum, precision: Precision) -> NodeTypes:
    """The types of the node sets."""
    d, s = continuum.dim, continuum.stress_size
    real, vector, tensor = precision.real, precision.vec(d), precision.mat(d, d)

    @wp.struct
    class Point:
        x: vector
        phi: precision.vec(d + s)

    @wp.struct
    class MaterialNodes:
        point: wp.array(dtype=Point)
        volume: wp.array(dtype=real)
        reference: wp.array(dtype=vector)
        displacement: wp.array(dtype=vector)
        density: wp.array(dtype=real)
        smoothing_length: wp.array(dtype=real)
        weight: wp.array(dtype=real)
        half_velocity: wp.array(dtype=vector)
        velocity_gradient: wp.array(dtype=tensor)

    @wp.struct
    class AuxiliaryNodes:
        point: wp.array(dtype=Point)
        volume: wp.array(dtype=real)
        density: wp.array(dtype=real)
        smoothing_length: wp.array(dtype=real)
        cell: wp.array2d(dtype=wp.int32)

    return NodeTypes(
        size=d + s,
        vector=vector,
        stress=precision.vec(s),
        phi=precision.vec(d + s),
        tensor=tensor,
        stress_gradient=precision.mat(s, d),
        Point=Point,
        MaterialNodes=MaterialNodes,
        AuxiliaryNodes=AuxiliaryNodes,
    )
