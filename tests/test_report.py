"""The report's parts: runs that are kept, frames, sections that can be made, and pages that stand alone."""

import re
from html.parser import HTMLParser

import numpy as np
import pytest

from warpsph.cli import scene_run
from warpsph.cli.main import main
from warpsph.cli.queue import make_missing, processes
from warpsph.report.case import Picture, ReportTable, Row, Section
from warpsph.report.cases import cases, elastic_bar, hanging_bar, wavy_surface
from warpsph.report.drawing import Curve, diagram
from warpsph.report.page import write_html, write_markdown
from warpsph.report.prose import TEXTS, Prose, prose
from warpsph.report.runs import Run

SCENE = '''"""Bar for the tests."""
from warpsph import *
PARAMETERS = (Parameter("velocity", 1.0, "m/s", "of the end"), Parameter("duration", 0.01, "s", "time"))

def scene(p):
    return Scene(
        shape=Box((1.0,), 0.1),
        material=Elastic(young_modulus=8e7, density=2000.0),
        conditions=[Fixed(edge("left")), PrescribedVelocity(edge("right"), (end(p.velocity),))],
        duration=p.duration,
        numerics=p.numerics,
        output=Output(probes=(Probe("u", "m", NodeValue("displacement", (1.0,))),)),
    )

def end(velocity):
    return lambda t: velocity if t < 5e-3 or velocity == 1.0 else float("nan")

def checks(run):
    return [Check("end", run.history["u"][-1], 0.01, "m", 0.01)]
'''


@pytest.fixture
def bar(tmp_path):
    """A run of a small scene of its own, 22 steps."""
    path = tmp_path / "bar.py"
    path.write_text(SCENE)
    return Run("bar", str(path), (), (0.0, 0.004, 0.01))


def test_run_is_made_once_and_read_back(bar, tmp_path):
    folder = tmp_path / "runs" / "bar"
    assert not bar.done(folder)
    bar.make(folder, "cpu")
    assert bar.done(folder)
    result = bar.read(folder)
    assert result.check("end") == pytest.approx(0.01, rel=1e-3)
    assert np.isnan(result.check("no_such_check"))
    assert result.history["u"][-1] == pytest.approx(0.01, rel=1e-3)
    # The frames: the start, then the first step at or after each time.
    step = result.summary["time_step"]["max"]
    np.testing.assert_allclose(result.times, (0.0, 0.004, 0.01), atol=step)
    assert (result.times >= np.array((0.0, 0.004, 0.01)) * (1.0 - 1e-9)).all()
    np.testing.assert_allclose(result.at("displacement", 1)[-1], result.times[1], rtol=1e-3)
    assert bar.progress(folder) == 1.0
    assert "11 nodes" in (folder / "log.txt").read_text()


def test_run_is_made_again_for_other_parameters_frames_or_version(bar, tmp_path, monkeypatch):
    folder = tmp_path / "bar"
    bar.make(folder, "cpu")
    assert not Run("bar", bar.scene, ("duration=0.005",), bar.frames).done(folder)
    assert not Run("bar", bar.scene, ("courant=0.5",), bar.frames).done(folder)
    assert not Run("bar", bar.scene, (), (0.0, 0.004)).done(folder)
    monkeypatch.setattr(scene_run, "__version__", "9.9.9")
    assert not bar.done(folder)


def test_interrupted_run_is_not_done(bar, tmp_path):
    folder = tmp_path / "bar"
    bar.make(folder, "cpu")
    (folder / "summary.json").unlink()
    assert not bar.done(folder)


def test_run_that_broke_down_is_kept_and_says_why(bar, tmp_path):
    broken = Run("broken", bar.scene, ("velocity=2.0",), bar.frames)
    broken.make(tmp_path / "broken", "cpu")
    assert broken.done(tmp_path / "broken")
    result = broken.read(tmp_path / "broken")
    assert "must return a finite number; not nan" in result.summary["error"]
    assert len(result.times) == 2, "the frame at 10 ms was never reached"
    section = Section(Prose("t", "x", ()), [Row("q", 1.0)], [], [result])
    write_markdown(tmp_path / "r.md", [section], title="title", lead=[])
    assert "broke down" in (tmp_path / "r.md").read_text()


def test_only_missing_runs_are_made(bar, tmp_path, capsys):
    """In a process of its own; the second call finds it done."""
    make_missing([bar], tmp_path / "runs", "cpu", processes(1), quiet=False)
    first = capsys.readouterr().out
    assert "1 runs, 0 of them done already" in first and "[1/1] bar" in first
    make_missing([bar], tmp_path / "runs", "cpu", processes(1), quiet=False)
    second = capsys.readouterr().out
    assert "1 runs, 1 of them done already" in second and "[1/1]" not in second


@pytest.mark.parametrize("quick", [False, True])
def test_every_case_has_runs_that_can_be_built(quick):
    """Names are folders, so they differ; settings are those the scenes take; frames lie within the run."""
    runs = [run for case in cases(quick) for run in case.runs]
    assert len({run.name for run in runs}) == len(runs)
    for run in runs:
        _, scene, _ = run.build()
        assert all(0.0 <= time <= scene.duration * (1.0 + 1e-9) for time in run.frames), run.name
    assert sum(run.cost() for run in runs) < (2e8 if quick else 2e9)


def test_quick_form_is_a_tenth_of_the_work():
    full, quick = (sum(run.cost() for case in cases(form) for run in case.runs) for form in (False, True))
    assert quick < 0.2 * full


def test_wavy_surface_runs_both_normals_and_every_body():
    """The paper's figure 4 shows both normals; the staircase stands beside the bodies with exact ones."""
    settings = [run.settings for run in wavy_surface.case(quick=False).runs]
    bodies = [(f"body={body}",) for body in ("disc", "ellipse", "staircase")]
    assert settings == [(), ("normals=marrone",), *bodies]


@pytest.mark.parametrize("module", [hanging_bar, elastic_bar, wavy_surface])
def test_short_cases_are_words(module, tmp_path):
    """From the runs to the section: figures drawn, every difference has its paragraph."""
    case = module.case(quick=True)
    for run in case.runs:
        run.make(tmp_path / run.name, "cpu")
    results = {run.name: run.read(tmp_path / run.name) for run in case.runs}
    section = case.section(results, lambda name: tmp_path / f"{name}.png")
    assert all(picture.path.stat().st_size > 10_000 for picture in section.pictures)
    assert section.rows and section.prose.differences
    if module is hanging_bar:
        (ratio,) = (row.ours for row in section.rows if row.quantity.startswith("ratio"))
        assert ratio > 100.0


def test_dalembert_has_the_plateaus_of_the_bar():
    """x = 0.1 m, c = 200 m/s: fronts at 4.5, 5.5, 9.5, 10.5 ms; v = 0, 1, 0, −1, 0; σ = 0, 4, 8, 4, 0 (1e5 Pa)."""
    t = np.array([4.0, 5.0, 7.5, 10.0, 12.5, 15.0]) * 1e-3
    v, stress, u = elastic_bar.dalembert(0.1, t, 1.0, 200.0, 1.0, 2000.0 * 200.0)
    np.testing.assert_allclose(v, [0.0, 1.0, 0.0, -1.0, 0.0, 1.0])
    np.testing.assert_allclose(stress, [0.0, 4e5, 8e5, 4e5, 0.0, 4e5])
    np.testing.assert_allclose(u, [0.0, 5e-4, 1e-3, 5e-4, 0.0, 5e-4], atol=1e-18)


def test_difference_is_to_the_exact_value_else_to_the_paper_s():
    assert Row("q", 1.1, paper=2.0, exact=1.0).difference == pytest.approx(0.1)
    assert Row("q", 1.0, paper=2.0).difference == pytest.approx(-0.5)
    assert Row("q", 1.0, paper="1171-1267").difference is None
    assert Row("q", 1.0, exact=0.0).difference is None


@pytest.mark.parametrize("path", sorted(TEXTS.glob("*.md")), ids=lambda path: path.stem)
def test_prose_has_a_title_and_a_text(path):
    places = dict.fromkeys(re.findall(r"{(\w+)", path.read_text(encoding="utf-8")), 1.0)
    words = prose(path.stem, **places)
    assert words.title and not words.title.startswith("#") and words.text


class Elements(HTMLParser):
    """Checks that elements close in order, and collects what they refer to."""

    def __init__(self):
        super().__init__()
        self.open, self.sources, self.text = [], [], []

    def handle_starttag(self, tag, attributes):
        if tag not in ("meta", "img"):
            self.open.append(tag)
        self.sources += [value for name, value in attributes if name in ("src", "href")]

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text.append(data)


@pytest.fixture
def section(tmp_path):
    path = diagram(
        tmp_path / "a.png",
        [Curve("a < b", [0, 1], [0, 1]), Curve("exact", [0, 1], [1, 1], exact=True)],
        x_label="x",
        y_label="y",
    )
    return Section(
        prose=Prose("Title & more", "Text with `code`.", ("**First** <difference>.", "Second.")),
        rows=[
            Row("load | sum", 91473.7, unit="N", paper=90650.0, exact=89055.0, seconds=6.23),
            Row("words", "broke down"),
        ],
        pictures=[Picture(path, 'A "caption"')],
        results=[],
        tables=[ReportTable("Three:", ("", "a", "b"), [("line", 1.0, None)])],
    )


def test_html_page_stands_alone(section, tmp_path):
    write_html(tmp_path / "r.html", [section], title="Report", lead=["Lead."])
    elements = Elements()
    elements.feed((tmp_path / "r.html").read_text(encoding="utf-8"))
    assert elements.open == []
    assert all(source.startswith(("data:image/png;base64,", "#s")) for source in elements.sources)
    assert sum(source.startswith("data:") for source in elements.sources) == 1
    text = " ".join(elements.text)
    for expected in ("91474", "+2.72 %", "6.2 s", "broke down", "<difference>", "Three:"):
        assert expected in text


def test_markdown_refers_to_its_pictures_and_keeps_its_tables(section, tmp_path):
    write_markdown(tmp_path / "r.md", [section], title="Report", lead=["Lead."])
    lines = (tmp_path / "r.md").read_text(encoding="utf-8").splitlines()
    assert '![A "caption"](a.png)' in lines
    (row,) = (line for line in lines if line.startswith("| load"))
    assert row == "| load \\| sum | N | 90650 | 89055 | 91474 | +2.72 % | 6.2 s |"
    heads = [k for k, line in enumerate(lines) if set(line) == {"|", "-"}]
    for k in heads:
        assert lines[k - 1].count("|") == lines[k].count("|")


@pytest.mark.parametrize("arguments", [["--jobs", "0"], ["--device", "nowhere"]])
def test_bad_input_exits_with_2(arguments, tmp_path, capsys):
    assert main(["report", "--out", str(tmp_path), *arguments]) == 2
    assert arguments[0].strip("-") in capsys.readouterr().err
