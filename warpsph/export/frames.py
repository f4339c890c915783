"""The frame store: whole fields of a run at chosen times, in a folder that pictures and exports read.

Every file is written whole, so that a run that dies leaves whole frames only; `frame_files` says what is in them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Protocol

import numpy as np

from ..analysis import green_strain, mean_stress, von_mises
from ..errors import SceneError, one_of
from ..mesh.faces import mesh_of_cells
from ..mesh.mesh import ARRAYS, Mesh
from ..simulation.fields import FIELDS, fields_of, internal_variables
from ..simulation.simulation import Simulation
from ..storage.files import write_json
from .frame_files import (
    ABOUT,
    BODY,
    FOLDER,
    ROUNDING,
    clear,
    clear_after,
    frame_path,
    frame_paths,
    read_about,
    read_body,
    read_frame,
    save_arrays,
)
from .tool_meshes import ToolMesh, tool_meshes
from .walls import Wall, walls_of

STORED = ("displacement", "velocity", "stress", "density", "free_surface")  # and the internal variables
# Fields that follow from the stored ones; displacement is stored since float32 can not hold it in a position.
DERIVED = {
    "position": lambda frame: frame.mesh.nodes + frame.field("displacement"),
    "strain": lambda frame: green_strain(frame.mesh, frame.field("displacement")),
    "von_mises_stress": lambda frame: von_mises(frame.field("stress"), frame.mesh.continuum),
    "mean_stress": lambda frame: mean_stress(frame.field("stress"), frame.mesh.continuum),
}


class Follower(Protocol):
    """Something told after every frame that was written."""

    def update(self) -> None:
        """Look at the frames."""

    def close(self) -> None:
        """Finish: there will be no more."""


class FrameWriter:
    """An observer that writes a frame at the first step at or after each time.

    A simulation that goes on from a time later than 0 keeps the frames it has up to there.

    Args:
        simulation: the simulation; time 0 is taken at once.
        times: rising [s].
        run: the run's folder.
        followers: make what is told after every frame.
    """

    def __init__(
        self,
        simulation: Simulation,
        times: Sequence[float],
        run: Path | str,
        followers: Sequence[Callable[[Frames], Follower]] = (),
    ):
        self._run = run = Path(run)
        former = clear_after(run, simulation.time) if simulation.steps else clear(run)
        times, rate = [float(time) for time in times], _rate(times)
        if former:
            kept = [time for time in former["times"] if time <= simulation.time * (1.0 + ROUNDING)]
            times, rate = (
                kept + [time for time in times if time > simulation.time * (1.0 + ROUNDING)],
                former["rate"],
            )
        self._times = np.array(times)
        own, internal = fields_of(simulation.scene), internal_variables(simulation.scene)
        names = [name for name in (*STORED, *internal) if name in own]
        if simulation.scene.output.field not in (*names, *DERIVED):
            names.append(simulation.scene.output.field)
        self._fields = {name: own[name].unit for name in names}
        (run / FOLDER).mkdir(parents=True, exist_ok=True)
        self._describe(simulation, rate)
        self.next_time, self._followers = -1.0, ()
        self.observe(simulation)
        self._followers = tuple(follow(Frames(run)) for follow in followers)

    def _describe(self, simulation: Simulation, rate: float) -> None:
        mesh, output, walls = simulation.mesh, simulation.scene.output, walls_of(simulation.scene)
        parts = {name: getattr(mesh, name) for name in ARRAYS}
        parts |= {f"wall_{k}": wall.faces for k, wall in enumerate(walls)}
        tools = tool_meshes(simulation.scene)
        for k, tool in enumerate(tools):
            parts |= {f"tool_{k}_points": tool.points, f"tool_{k}_polygons": tool.polygons}
        save_arrays(self._run / FOLDER / BODY, parts)
        about = {
            "scene": simulation.scene.name,
            "times": self._times.tolist(),
            "rate": rate,
            "fields": self._fields,
            "field": output.field,
            "component": output.component,
            "curve": output.curve,
            "curve_reference": output.curve_reference,
            "walls": [{"name": wall.name, "still": wall.still} for wall in walls],
            "tools": [tool.name for tool in tools],
            "remade": simulation.scene.cells is not None,
        }
        write_json(self._run / FOLDER / ABOUT, about)

    def observe(self, simulation: Simulation) -> None:
        """Write a frame when its time has come."""
        if simulation.time < self.next_time:
            return
        passed = int(np.searchsorted(self._times, simulation.time * (1.0 + ROUNDING), side="right"))
        self.next_time = self._times[passed] * (1.0 - ROUNDING) if passed < len(self._times) else float("inf")
        path = frame_path(self._run, passed - 1)
        if passed and not path.exists():
            fields = {name: simulation.field(name).astype(np.float32) for name in self._fields}
            if simulation.scene.cells is not None:
                fields["cells"] = simulation.present_mesh.cells.astype(np.int32)
            if simulation.scene.tools:
                fields["tools"] = simulation.stepper.tools.travel.numpy()
            save_arrays(path, {"time": simulation.time, "step": simulation.steps} | fields)
            for follower in self._followers:
                follower.update()

    def close(self) -> None:
        """Close the followers; the frames themselves are whole at any time."""
        for follower in self._followers:
            follower.close()


@dataclass(frozen=True)
class Frame:
    """The body at one time.

    Attributes:
        number: index of the time asked for.
        time: simulated time [s].
        step: number of the step.
        mesh: the initial mesh, without its tags.
        present_mesh: the initial nodes with the cells as they are then.
        stored: the stored fields, name → values.
        tools: the tools where they are.
    """

    number: int
    time: float
    step: int
    mesh: Mesh
    present_mesh: Mesh
    stored: Mapping[str, np.ndarray]
    tools: tuple[ToolMesh, ...] = ()

    def field(self, name: str) -> np.ndarray:
        """A node field, as `Simulation.field` gives it (to float32).

        Raises:
            SceneError: frames have no field of that name.
        """
        if name in self.stored:
            return self.stored[name].astype(float)
        if name not in DERIVED:
            raise SceneError("field", name, one_of([*self.stored, *DERIVED], name))
        return DERIVED[name](self)


class Frames(Sequence):
    """The frames of a run folder, in the order of time; read when they are asked for.

    Args:
        run: the run's folder.

    Attributes:
        run: the folder.
        about: what `about.json` says.
        times: those asked for [s].
        rate: frames a second of simulated time [1/s].
        mesh: the initial mesh, without its tags.
        walls: what surrounds the body.
        tools: rigid tools at the start.

    Raises:
        SceneError: it is no folder of a run with frames.
    """

    def __init__(self, run: Path | str):
        self.run = Path(run)
        self.about = read_about(self.run)
        if self.about is None:
            raise SceneError("DIR", str(run), "it must be the folder of a run that kept frames (`--frames N`)")
        self.times, self.rate = tuple(self.about["times"]), self.about["rate"]

    @cached_property
    def _body(self) -> tuple[Mesh, list[np.ndarray], list[tuple]]:
        return read_body(self.run, len(self.about["walls"]), len(self.about["tools"]))

    @property
    def mesh(self) -> Mesh:
        """The initial lattice."""
        return self._body[0]

    @cached_property
    def walls(self) -> tuple[Wall, ...]:
        """What surrounds the body."""
        walls = zip(self.about["walls"], self._body[1], strict=True)
        return tuple(Wall(wall["name"], faces, wall["still"]) for wall, faces in walls)

    @cached_property
    def tools(self) -> tuple[ToolMesh, ...]:
        """Rigid tools at the start."""
        named = zip(self.about["tools"], self._body[2], strict=True)
        return tuple(ToolMesh(name, points, polygons) for name, (points, polygons) in named)

    @property
    def fields(self) -> tuple[str, ...]:
        """Names of the fields its frames have."""
        kept = self.about["fields"]
        known = [name for name in FIELDS if name in DERIVED or name in kept]
        return (*known, *(name for name in kept if name not in known))

    def unit(self, name: str) -> str:
        """Unit of a field."""
        return FIELDS[name].unit if name in FIELDS else self.about["fields"][name]

    @property
    def numbers(self) -> list[int]:
        """Numbers of the frames there are now, also while the run goes on."""
        found = [int(path.stem) for path in frame_paths(self.run)]
        if found and found[-1] >= len(self.times):
            raise SceneError("frame", str(frame_path(self.run, found[-1])), "about.json knows of no such time")
        return found

    def __len__(self) -> int:
        return len(self.numbers)

    def __getitem__(self, k: int) -> Frame:
        return self.read(self.numbers[k])

    def __iter__(self) -> Iterator[Frame]:
        return (self.read(number) for number in self.numbers)

    def read(self, number: int) -> Frame:
        """The frame of that number."""
        stored = read_frame(frame_path(self.run, number), self.about, self.mesh)
        time, step, travel = float(stored.pop("time")), int(stored.pop("step")), stored.pop("tools", ())
        tools = tuple(tool.moved(way) for tool, way in zip(self.tools, travel, strict=True))
        mesh = self.mesh
        present = mesh_of_cells(mesh.nodes, stored.pop("cells"), mesh.spacing) if self.about["remade"] else mesh
        return Frame(number, time, step, mesh, present, stored, tools)

    def code(self, number: int) -> float:
        """A frame's place on a time line of `rate` codes a second; whole numbers for evenly spaced times."""
        return round(self.times[number] * self.rate, 6)

    @property
    def codes(self) -> list[float]:
        """The places of all frames on the time line."""
        return [self.code(number) for number in self.numbers]

    def nearest(self, time: float) -> Frame:
        """The frame nearest to a time [s].

        Raises:
            SceneError: the time is further from the run's first or last frame than frames are from each other.
        """
        times = np.array([self.times[number] for number in self.numbers])
        gap = np.diff(times).max(initial=0.0)
        if not times[0] - gap <= time <= times[-1] + gap:
            raise SceneError("time", time, f"the frames are from {times[0]:.6g} to {times[-1]:.6g} s")
        return self[int(np.abs(times - time).argmin())]


def evenly(end: float, count: int) -> np.ndarray:
    """Times of `count` frames up to the end [s], and of one at the start, shape (count + 1,)."""
    return np.linspace(0.0, end, count + 1)


def _rate(times: Sequence[float]) -> float:
    return (len(times) - 1) / float(times[-1]) if len(times) > 1 else 1.0
