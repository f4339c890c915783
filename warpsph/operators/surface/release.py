"""The moving free surface: conditions that also free the body's edge, wherever it now is, of its tractions.

Tractions vanish on every face that a surface node lies on: σ ← P σ P, P the projector onto the directions that
lie in all of its faces. On a smooth surface P = 1 − n n; along the edge of a solid P = e e; at a corner, of two
edges in the plane or three faces in a solid, P = 0. σ33 in plane strain is kept.

At the end of a wall a velocity condition beats the traction condition: only the directions that nobody moves are
freed, so there n stands for its part along them. Without that a slope's toe would carry the full overburden on its
free face. Where the surface goes on smoothly from the wall, as beside a footing, the wall's last node lies on one
face only, the wall's, and nothing is freed.
"""

import math
from functools import cache

import numpy as np
import warp as wp

from ...device.compiling import forward_kernel
from ...device.launching import Launcher
from ...physics.smoothing import wendland_c2
from ...physics.space import Space
from ...scene.resolve import SMOOTH_EDGE_ANGLE
from ...scene.scene import Scene
from ...state.clock import Clock
from ...state.pairs import PairList
from ..conditions import Conditions, ConditionTypes, apply_kernel
from .scan import SurfaceScan, surface_types

# The surface is found anew once ∫|L| dt since the last time reaches this anywhere on it: the direction from one
# node to the next, and with it a normal, turns by no more than that.
LARGEST_TURN = math.radians(1.0)
# A face with less than this left of its normal, as a sine, is parallel to a wall or to a face already freed.
PARALLEL = 0.1
# At the end of a wall the scan's normal stands halfway between those of the wall and the free surface.
HALF_EDGE = 0.5 * SMOOTH_EDGE_ANGLE


class FreeSurfaceConditions(Conditions):
    """The conditions of a scene with a moving free surface.

    Args:
        scene: the scene.
        nodes: material nodes.
    """

    def __init__(self, scene: Scene, nodes, *, space: Space, launcher: Launcher, clock: Clock):
        device, mesh, surface = launcher.device, scene.mesh, scene.free_surface
        moves = scene.large_displacements
        super().__init__(scene.boundary, len(mesh.nodes), space=space, launcher=launcher, clock=clock, moves=moves)
        self._unmoved = ~surface.moved(mesh, scene.boundary)
        self._moves = scene.large_displacements
        candidates = surface.candidates(mesh, scene.conditions)
        self._scan = SurfaceScan(scene, candidates, nodes=nodes, space=space, launcher=launcher)
        self.types = free_surface_types(space, self.types)
        walls, self.table = self.table, self.types.Table()
        self.table.conditions = walls
        self.table.row = self._scan.row
        self.table.projector = wp.zeros(len(candidates), dtype=space.types.tensor, device=device)
        self._turned = wp.zeros(len(candidates), dtype=space.real, device=device)
        self.outdated = clock.new_flag()
        self._kernel = apply_kernel(space, self.types, moves)
        self._project = _project_kernel(space, self.types)
        self._turn = _turn_kernel(space, self.types)
        self.kernels = (self._kernel, self._project, self._turn, *self._scan.kernels)

    def refresh(self) -> None:
        """Find the free surface in the present configuration."""
        self._scan.refresh()
        inputs = [self._scan.pairs, self._scan.candidates, self.table]
        wp.launch(self._project, self._turned.shape[0], inputs=inputs, device=self._turned.device)
        self._turned.zero_()
        self.outdated.zero_()

    def turn(self, nodes, dt: wp.array) -> None:
        """Turn the directions freed as the stresses turn in half a time step; never at small displacements.

        A normal that lags by θ leaves the shear traction σ_tt θ, which drives a spinning body round.
        """
        if self._moves:
            inputs = [nodes, dt, self.table, self._turned, self.outdated]
            self._launcher.launch(self._turn, nodes.point, inputs, gathers=False)

    def on_surface(self) -> np.ndarray:
        """Which nodes are on the free surface and not under a velocity condition, boolean, shape (n,)."""
        found = np.zeros(len(self._unmoved), dtype=bool)
        candidates = self._scan.candidates
        found[candidates.node.numpy()] = candidates.exposed.numpy() == 1
        return found & self._unmoved

    def normals(self) -> np.ndarray:
        """Outward unit normals of the nodes on the free surface, zero elsewhere, shape (n, d)."""
        candidates = self._scan.candidates
        values = candidates.normal.numpy()
        normals = np.zeros((len(self._unmoved), values.shape[1]), dtype=values.dtype)
        normals[candidates.node.numpy()] = values
        return np.where(self.on_surface()[:, None], normals, 0.0)


@cache
def free_surface_types(space: Space, walls: ConditionTypes) -> ConditionTypes:
    """The walls' table and function, with the free surface: P of each candidate after all else."""
    phi, types = space.phi, space.types

    @wp.struct
    class Table:
        conditions: walls.Table
        row: wp.array(dtype=wp.int32)
        projector: wp.array(dtype=types.tensor)

    @wp.func
    def apply(i: int, values: phi.phi, when: int, table: Table):
        result = walls.apply(i, values, when, table.conditions)
        c = table.row[i]
        if c >= 0:
            result = phi.with_stress(result, space.stress.transform(phi.stress(result), table.projector[c]))
        return result

    return ConditionTypes(Table, apply)


@cache
def _project_kernel(space: Space, conditions: ConditionTypes):
    types, real, surface, weights = space.types, space.real, surface_types(space), wendland_c2(space.precision)
    identity, same_face, smooth = types.tensor(np.eye(space.dim)), math.cos(SMOOTH_EDGE_ANGLE), math.cos(HALF_EDGE)

    @wp.func
    def faces_of(c: int, pairs: PairList, row: wp.array(dtype=wp.int32), candidates: surface.Candidates):
        """Normals of the smooth faces that meet at c, not normalised, one a row; zero rows are left."""
        x, h = candidates.point[c].x, candidates.smoothing_length[c]
        faces = types.tensor()
        count = wp.int32(0)
        for k in range(pairs.start[c], pairs.start[c + 1]):
            o = surface.on_face(c, k, pairs, row, candidates)
            if o >= 0 and candidates.sharp[o] == 0:
                normal = candidates.normal[o]
                face = count
                for f in range(count):
                    if wp.dot(normal, wp.normalize(faces[f])) > real(same_face):
                        face = f
                if face < wp.static(space.dim):
                    p = (candidates.point[o].x - x) / h
                    w, _ = weights(wp.dot(p, p))
                    faces[face] = faces[face] + w * normal
                    count = wp.max(count, face + 1)
        if count == 0:
            faces[0] = candidates.normal[c]
        return faces

    @wp.func
    def without(projector: types.tensor, normal: types.vector):
        """The projector onto what is left of its range without its part along a face's normal."""
        part = projector * normal
        if wp.length(part) > real(PARALLEL):
            unit = wp.normalize(part)
            return projector - wp.outer(unit, unit)
        return projector

    @wp.func
    def freed_part(face: types.vector, c: int, candidates: surface.Candidates, table: conditions.Table):
        """The part of a face's normal along the directions in which its traction must vanish."""
        wall = table.conditions.held.row[candidates.node[c]]
        if wall < 0:
            return face
        if wp.dot(candidates.scan_normal[c], face) > real(smooth):
            return types.vector()
        return table.conditions.held.projector[wall] * face

    @forward_kernel
    def project(pairs: PairList, candidates: surface.Candidates, table: conditions.Table):
        c = wp.tid()
        projector = identity
        if candidates.exposed[c] == 1 and candidates.sharp[c] == 0:
            projector = without(projector, freed_part(candidates.normal[c], c, candidates, table))
        elif candidates.exposed[c] == 1:
            faces = faces_of(c, pairs, table.row, candidates)
            mean = types.vector()
            for f in range(wp.static(space.dim)):
                face = wp.normalize(faces[f])
                mean += face
                projector = without(projector, freed_part(face, c, candidates, table))
            candidates.normal[c] = wp.normalize(mean)
        table.projector[c] = projector

    return project


@cache
def _turn_kernel(space: Space, conditions: ConditionTypes):
    real = space.real

    @forward_kernel
    def turn(
        first: int,
        nodes: space.types.MaterialNodes,
        dt: wp.array(dtype=real),
        table: conditions.Table,
        turned: wp.array(dtype=real),
        outdated: wp.array(dtype=wp.int32),
    ):
        i = first + wp.tid()
        c = table.row[i]
        if c < 0:
            return
        L = nodes.velocity_gradient[i]
        half = real(0.5) * dt[0]
        R = space.algebra.rotation(L, half)
        table.projector[c] = R * table.projector[c] * wp.transpose(R)
        turned[c] += half * wp.sqrt(wp.ddot(L, L))
        if turned[c] > real(LARGEST_TURN):
            outdated[0] = 1

    return turn
