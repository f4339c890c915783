"""`warpsph plot`: pictures of a run, opened and looked at as images."""

import re

import numpy as np
import pytest
from PIL import Image

from warpsph.cli.main import main
from warpsph.export.pictures.field import MOVIES
from warpsph.export.pictures.view import View
from warpsph.export.quantity import quantity
from warpsph.frames import Frames

FRAMES = 6


@pytest.fixture(scope="module", params=["elastic_bar", "stretched_block", "solid"])
def run(request, tmp_path_factory):
    """The folder of a run in one, two and three dimensions."""
    folder, scene = tmp_path_factory.mktemp("run"), request.param
    if scene == "solid":
        scene = folder / "solid.py"
        scene.write_text(
            "from warpsph import *\n"
            "NUMERICS = {'courant': 0.1}\n"
            "def scene(p):\n"
            "    return Scene(shape=Box((0.4, 0.3, 0.2), 0.1), duration=0.01, numerics=p.numerics,\n"
            "        material=Elastic(young_modulus=8e6, poisson_ratio=0.3, density=2000.0),\n"
            "        conditions=[PrescribedVelocity(edge('right'), (4.0, None, None)), Fixed(edge('left'))])\n"
        )
    arguments = ["run", str(scene), "--until", "0.002", "--quiet", "--device", "cpu", "--out", str(folder)]
    assert main([*arguments, "--frames", str(FRAMES)]) == 0
    return folder


def coloured(path):
    """Share of the picture's pixels that are neither white, black nor grey."""
    pixels = np.asarray(Image.open(path).convert("RGB")).astype(int)
    return float((np.ptp(pixels, axis=2) > 20).mean())


def test_run_leaves_its_curve_and_its_last_field(run):
    """Where it has a probe; a picture without anything on it has no colours, a line some."""
    drawn = [path for path in (run / "field.png", run / "history.png") if path.exists()]
    assert run / "field.png" in drawn and all(coloured(path) > 0.002 for path in drawn)


def test_overview_of_a_run(run, capsys):
    assert main(["plot", str(run)]) == 0
    path = run / "overview.png"
    assert capsys.readouterr().out.strip() == str(path)
    width, height = Image.open(path).size
    assert 1200 < width < 2000 and 800 < height < 2500
    assert coloured(path) > 0.01


def test_one_time_shows_the_nearest_frame(run, capsys):
    frames = Frames(run)
    drawn = []
    for asked, number in ((0.0, 0), (frames.times[4] * 1.01, 4), (frames.times[-1] * 1.01, FRAMES)):
        assert main(["plot", str(run), "--field", "velocity", "--time", str(asked)]) == 0
        path = run / f"velocity_{number:06d}.png"
        assert capsys.readouterr().out.strip() == str(path)
        drawn.append(np.asarray(Image.open(path).convert("L")))
    assert drawn[0].shape == drawn[2].shape and (drawn[0] != drawn[2]).any(), "one scale, other content"
    assert main(["plot", str(run), "--time", "1e9"]) == 2
    assert "the frames are from 0 to" in capsys.readouterr().err


def test_animation_has_every_frame(run):
    assert main(["plot", str(run), "--animate"]) == 0
    path = next(run.glob("*.gif"))
    with Image.open(path) as movie:
        assert movie.n_frames == len(Frames(run)) == FRAMES + 1
        first = np.asarray(movie.convert("RGB")).astype(int)
        movie.seek(movie.n_frames - 1)
        assert (np.abs(np.asarray(movie.convert("RGB")).astype(int) - first).max(axis=2) > 40).any()


def test_view_holds_the_body_and_the_values_of_all_frames(run):
    frames = Frames(run)
    shown = quantity("velocity:x", frames)
    view = View.of(frames, shown)
    for frame in frames:
        position, values = frame.field("position"), shown(frame)
        assert (position > view.low).all() and (position < view.high).all()
        assert view.values[0] <= values.min() and values.max() <= view.values[1]
        inside = (values >= view.span[0] - 1e-12) & (values <= view.span[1] + 1e-12)
        assert inside.mean() >= 0.98


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--time", "soon"], r"--time = 'soon' .* at least 0 \[s\]"),
        (["--time", "-1"], "--time = '-1' "),
        (["--animate", "avi"], "--animate = 'avi' .* one of gif, mp4"),
        (["--field", "colour"], "--field = 'colour' .* one of position"),
    ],
)
def test_bad_input_exits_with_2_and_one_line(options, message, run, capsys):
    assert main(["plot", str(run), *options]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1 and re.search(f"^warpsph: {message}", error), error


def test_mp4_without_ffmpeg_is_refused_in_one_line(run, monkeypatch, capsys):
    monkeypatch.setattr(MOVIES["mp4"], "isAvailable", classmethod(lambda cls: False))
    assert main(["plot", str(run), "--animate", "mp4"]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1 and "it needs ffmpeg" in error
    assert not list(run.glob("*.mp4"))


def test_a_folder_without_frames_is_refused(tmp_path, capsys):
    assert main(["plot", str(tmp_path)]) == 2
    assert re.search("^warpsph: DIR = .* kept frames", capsys.readouterr().err)
