"""The work-precision tool on tiny sizes: its exact solutions, what it writes, how it goes on; no timings."""

import csv
import math
import sys
from dataclasses import replace
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent.parent / "tools"))
import work_precision
from precision import campaign
from precision.campaign import members, read, run
from precision.cases import CASES, Case
from precision.settings import EXACT_RATIO, Setting
from precision.tables import tables

# With the nearest neighbours only and C = 1, Lax and Wendroff's step in a bar moves every wave by one node.
SHIFT = Setting(0.01, "taylor", 1.0, smoothing_ratio=EXACT_RATIO)


def test_elastic_bar_is_judged_by_the_exact_solution():
    """A step that moves waves exactly meets it but for one node, half a step late; another does not."""
    assert CASES["elastic_bar"].run(SHIFT, "cpu")[1] <= 0.6 * SHIFT.spacing
    assert CASES["elastic_bar"].run(replace(SHIFT, courant=0.8), "cpu")[1] > 0.05


@pytest.mark.parametrize("name", ["p_mode", "s_mode", "perzyna_bar", "impact"])
def test_errors_shrink_with_the_spacing(name):
    """Two orders for smooth modes; a front Δx^(2/3) wide, as second order leaves it, has 2/3 in L1, 1/3 in RMS."""
    case = CASES[name]
    coarse, fine = (case.run(Setting(spacing), "cpu")[1] for spacing in case.spacings[:2])
    least = {"impact": 0.5, "perzyna_bar": 0.2}.get(name, 1.7)
    assert least < math.log2(coarse / fine) < 4.0


@pytest.mark.parametrize("name", ["strip_footing", "vertical_cut"])
def test_limit_loads_are_met_within_a_tenth_on_the_coarsest_lattice(name):
    case = CASES[name]
    simulation, error = case.run(Setting(case.spacings[0]), "cpu")
    assert error < 0.1 and simulation.time == pytest.approx(simulation.scene.duration)


@pytest.fixture
def two(monkeypatch):
    """Only two settings a spacing, the second of which is refused."""
    monkeypatch.setattr(
        campaign, "variants", lambda spacing, *_: [Setting(spacing), Setting(spacing, courant=1.5)]
    )


def test_command_writes_pictures_tables_and_a_file_it_goes_on_from(two, tmp_path, capsys):
    out = tmp_path / "new" / "folder"
    command = ["--cases", "impact,perzyna_bar", "--rungs", "2", "--out", str(out)]
    assert work_precision.main(command) == 0
    printed, progress = capsys.readouterr()
    assert progress.count("\n") == 8
    for name in ("impact.png", "perzyna_bar.png", "overview.png"):
        assert (out / name).stat().st_size > 10_000
    assert (out / "tables.md").read_text(encoding="utf-8") == printed.removesuffix("\n")
    assert "courant = 1.5 is not allowed" in printed and "LAMMPS 3.6 / 1.5 %" in printed
    with (out / "results.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [row["case"] for row in rows[:4]] == ["impact", "impact", "perzyna_bar", "perzyna_bar"], "coarse first"
    assert int(rows[0]["nodes"]) == 3 * 101 and int(rows[0]["steps"]) * 303 == int(rows[0]["node_steps"])
    assert rows[1]["error"] == "nan" and rows[1]["why"].startswith("courant = 1.5")

    assert work_precision.main(command) == 0
    again, progress = capsys.readouterr()
    assert again == printed and not progress, "nothing was left to run"
    assert work_precision.main([*command, "--draw"]) == 0
    assert capsys.readouterr().out == printed


def test_a_member_that_breaks_is_kept_and_the_others_run(monkeypatch, tmp_path):
    def broken(setting, device):
        raise RuntimeError("two\nlines")

    monkeypatch.setitem(CASES, "broken", Case("Broken", "none", False, (), (1.0,), 1, 0.0, broken))
    plan = [("broken", Setting(1.0)), ("perzyna_bar", Setting(0.02))]
    results = run(plan, tmp_path / "results.csv", "cpu", lambda text: None)
    assert results[0].why == "RuntimeError: two lines" and math.isnan(results[0].error)
    assert 0.0 < results[1].error < 0.1 and not results[1].why
    kept = list(read(tmp_path / "results.csv"))
    assert kept[1] == results[1] and kept[0].why == results[0].why
    assert "none; best" in tables({CASES["perzyna_bar"]: results[1:]})


def test_plan_varies_one_thing_at_a_time():
    plan = members(CASES, None, quick=False)
    assert len(set(plan)) == len(plan)
    settings = [setting for name, setting in plan if name == "strip_footing" and setting.spacing == 0.25]
    for setting in settings:
        changed = sum(
            getattr(setting, name) != getattr(Setting(0.25), name)
            for name in ("kernel", "precision", "source_scheme")
        )
        assert changed <= 1
    assert {setting.source_scheme for name, setting in plan if name == "p_mode"} == {"analytic"}
    assert len(members(CASES, None, quick=True)) < len(plan) / 2


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--cases", "beam"], "--cases = beam is not allowed: it must be some of p_mode"),
        (["--rungs", "0"], "--rungs = 0 is not allowed"),
        (["--device", "cuda:9"], "device = 'cuda:9' is not allowed"),
    ],
)
def test_bad_input_is_one_line(arguments, message, tmp_path, capsys):
    assert work_precision.main([*arguments, "--out", str(tmp_path)]) == 2
    error = capsys.readouterr().err
    assert message in error and error.count("\n") == 1


def test_a_file_of_something_else_is_refused(tmp_path, capsys):
    (tmp_path / "results.csv").write_text("a,b\n1,2\n", encoding="utf-8")
    assert work_precision.main(["--cases", "impact", "--rungs", "1", "--out", str(tmp_path)]) == 2
    assert "results.csv there has other columns" in capsys.readouterr().err
