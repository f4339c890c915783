"""The cases: scenes whose exact solution is known, and one number for how far a run is from it."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np

from warpsph import Box, Elastic, Free, History, Numerics, Roller, Scene, Simulation, edge
from warpsph.cli.catalogue import SceneFile, load

from .settings import EXACT_RATIO, Setting

SOFT = Elastic(young_modulus=1e6, poisson_ratio=0.3, density=1000.0)
SMALL = 1e-4  # impact velocity over the wave speed; velocity of the pulse in the bar [m/s]
TRANSITS = 10.25  # of the elastic bar: the pulse then stands in the bar's middle half


@dataclass(frozen=True)
class Case:
    """A case.

    Attributes:
        title: what it is.
        measure: what its error is.
        flows: whether the sources matter.
        ratios: h/Δx of the Gaussian to try beside its own.
        spacings: the ladder of spacings [m], coarse to fine.
        quick: how many of them the quick form takes.
        floor: error below which the reference itself is in doubt.
        run: (setting, device) → simulation that has run, error [-].
    """

    title: str
    measure: str
    flows: bool
    ratios: tuple[float, ...]
    spacings: tuple[float, ...]
    quick: int
    floor: float
    run: Callable[[Setting, str], tuple[Simulation, float]]


def _mode(kind: str):
    """Standing P or S mode between roller walls, k = π (METHOD section 7), after two periods."""
    sign = 1.0 if kind == "P" else -1.0
    speed, k = SOFT.wave_speed(2) if kind == "P" else SOFT.shear_wave_speed(), np.pi

    def run(setting: Setting, device: str):
        scene = Scene(
            shape=Box((1.0, 1.0), setting.spacing),
            material=SOFT,
            conditions=[Roller(edge(name)) for name in ("left", "right", "bottom", "top")],
            velocity=lambda x, y: (np.sin(k * x) * np.cos(k * y), sign * np.cos(k * x) * np.sin(k * y)),
            duration=2.0 * math.sqrt(2.0) / speed,
            large_displacements=False,
            numerics=_numerics(setting),
        )
        simulation = Simulation(scene, device=device, precision=setting.precision)
        exact = simulation.field("velocity")
        simulation.run()
        return simulation, float(np.linalg.norm(simulation.field("velocity") - exact) / np.linalg.norm(exact))

    return run


@dataclass(frozen=True)
class Run:
    """A shipped scene that has run."""

    simulation: Simulation
    file: SceneFile
    parameters: SimpleNamespace
    history: History


def _shipped(name: str, setting: Setting, device: str, **changes: float) -> Run:
    """A shipped scene run with a setting and these parameters."""
    file = load(name)
    values = {"spacing": setting.spacing, **setting.numerics(), **changes}
    scene, parameters = file.build([f"{key}={value}" for key, value in values.items()])
    simulation = Simulation(scene, device=device, precision=setting.precision)
    history = History(simulation)
    simulation.run(observers=[history])
    return Run(simulation, file, SimpleNamespace(**parameters), history)


def _elastic_bar(setting: Setting, device: str):
    """Scene `elastic_bar` after 10¼ passages; d'Alembert's v = Σ f(t − (2n + 1)L/c ± x/c) with f the pull.

    Pulled more slowly than in the paper, whose 1 m/s strains the bar enough to shift the fronts in ten passages.
    """
    transit = 0.005  # of the bar of 1 m [s]
    run = _shipped("elastic_bar", setting, device, duration=TRANSITS * transit, velocity=SMALL)
    x, t = run.simulation.mesh.nodes[:, 0], run.simulation.time

    def pull(at):
        return np.where((at > 0.0) & (at < transit), 1.0, 0.0)

    def exact(x):
        arrivals = [(2 * n + 1) * transit for n in range(int(TRANSITS) // 2 + 1)]
        return sum(pull(t - a + x * transit) - pull(t - a - x * transit) for a in arrivals)

    velocity, tiny = run.simulation.field("velocity")[:, 0] / SMALL, 1e-6 * setting.spacing
    off_jump = exact(x - tiny) == exact(x + tiny)
    return run.simulation, float(np.abs(velocity - exact(x))[off_jump].mean())


def _perzyna_bar(setting: Setting, device: str):
    """Scene `perzyna_bar` and its own check: RMS of the stress but for the node on the front."""
    run = _shipped("perzyna_bar", setting, device)
    check = run.file.checks(run)[0]
    return run.simulation, float(check.value)


def _strip_footing(setting: Setting, device: str):
    """Scene `strip_footing`: the mean load once the mechanism has formed, as its check takes it."""
    run = _shipped("strip_footing", setting, device)
    settlement = run.history["settlement"]
    return run.simulation, _load_error(run, settlement >= 0.6 * settlement[-1])


def _vertical_cut(setting: Setting, device: str):
    """Scene `vertical_cut` while the mechanism stands, as its check takes it."""
    first, last = load("vertical_cut").module.MECHANISM
    run = _shipped("vertical_cut", setting, device, settlement=last)
    return run.simulation, _load_error(run, run.history["settlement"] >= first)


def _load_error(run: Run, where: np.ndarray) -> float:
    return float(abs(run.history["load"][where].mean() / run.file.module.limit_load(run.parameters) - 1.0))


def _impact(setting: Setting, device: str):
    """Two elastic halves meet in uniaxial strain: between two fronts at ±c_p t everything has stopped."""
    speed = SOFT.wave_speed(2)
    scene = Scene(
        shape=Box((1.0, 2.0 * setting.spacing), setting.spacing),
        material=SOFT,
        conditions=[Roller(edge("bottom")), Roller(edge("top")), Free(edge("left")), Free(edge("right"))],
        velocity=lambda x, y: (-SMALL * speed * np.sign(np.round(x - 0.5, 9)), 0.0 * x),
        duration=0.25 / speed,
        large_displacements=False,
        numerics=_numerics(setting),
    )
    simulation = Simulation(scene, device=device, precision=setting.precision)
    simulation.run()
    away = simulation.mesh.nodes[:, 0] - 0.5
    exact = np.where(np.abs(away) < speed * simulation.time, 0.0, -np.sign(away))
    return simulation, float(np.abs(simulation.field("velocity")[:, 0] / (SMALL * speed) - exact).mean())


def _numerics(setting: Setting) -> Numerics:
    return Numerics(**setting.numerics())


BARS = tuple(1.0 / n for n in (50, 100, 200, 400, 800))
SQUARES = tuple(1.0 / n for n in (10, 20, 40, 80))
RATIOS = (0.55, 0.8)
BAR_RATIOS = (EXACT_RATIO, 0.8)
L2 = "of the velocity after two periods, L2, relative"
LOAD = "of the mean load, against the limit load of rigid-plastic soil in its first shape"
CASES = {
    "p_mode": Case("Standing P mode", L2, False, RATIOS, SQUARES, 2, 0.0, _mode("P")),
    "s_mode": Case("Standing S mode", L2, False, RATIOS, SQUARES, 1, 0.0, _mode("S")),
    "elastic_bar": Case(
        "Elastic bar, 10¼ passages",
        "of the velocity, L1, of the pulse's",
        False,
        BAR_RATIOS,
        BARS,
        1,
        0.0,
        _elastic_bar,
    ),
    "perzyna_bar": Case(
        "Perzyna bar", "of the stress, RMS, of ρ c v₀", True, BAR_RATIOS, BARS, 2, 0.0, _perzyna_bar
    ),
    "impact": Case(
        "Impact of two elastic halves",
        "of the velocity, L1, of the impact velocity",
        False,
        RATIOS,
        BARS[1:],
        2,
        0.0,
        _impact,
    ),
    "strip_footing": Case("Strip footing", LOAD, True, RATIOS, (0.5, 0.25, 0.125), 1, 0.005, _strip_footing),
    "vertical_cut": Case("Vertical cut", LOAD, True, RATIOS, (1.0, 0.5, 0.25), 1, 0.005, _vertical_cut),
}
