"""The pair lists of both node sets around each other, renewed when nodes have used up the lists' skin."""

from ..device.compiling import load_kernels
from ..operators.motion import Motion, SmallMotion, centre_kernel
from ..state.clock import Clock
from ..state.nodes import SumsBody
from ..state.pairs import SKIN, Neighbours, Search


class PairLists:
    """A `Part`: material nodes around auxiliary ones, auxiliary ones around material ones, and what moves both.

    Args:
        body: the body; its auxiliary nodes are centred here.
        clock: gives the flag that says when lists are outdated.

    Attributes:
        around_auxiliary, around_nodes: the lists.
        motion: moves the nodes.
        builds: how often the lists were built.
        kernels: the kernels that make them and move the nodes.
    """

    def __init__(self, body: SumsBody, clock: Clock):
        scene, launcher, nodes, auxiliary = body.scene, body.launcher, body.nodes, body.auxiliary
        # Before all else: the lists' grids are sized by where the nodes are.
        centre = centre_kernel(body.space, body.kind)
        load_kernels([centre], launcher.device)
        launcher.launch(centre, auxiliary.point, [nodes, auxiliary])
        self._outdated = clock.new_flag()
        skin = SKIN * scene.mesh.spacing if scene.large_displacements else 0.0
        self.motion = SmallMotion(body)
        if scene.large_displacements:
            self.motion = Motion(body, skin=skin, outdated=self._outdated)
        search = Search(support=scene.numerics.smoothing.support, spacing=scene.mesh.spacing, skin=skin)
        self._auxiliary = Neighbours(body.space, launcher, targets=auxiliary, sources=nodes, search=search)
        self._nodes = Neighbours(body.space, launcher, targets=nodes, sources=auxiliary, search=search)
        self.around_auxiliary, self.around_nodes = self._auxiliary.pairs, self._nodes.pairs
        self.builds = 0
        self.kernels = (*self._auxiliary.kernels, *self._nodes.kernels, *self.motion.kernels)

    def refresh(self) -> None:
        """Build the lists anew for the present positions."""
        self._auxiliary.build()
        self._nodes.build()
        self.motion.mark()
        self._outdated.zero_()
        self.builds += 1
