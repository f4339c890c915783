"""README and docs: Python blocks run, TOML blocks are scenes, commands are commands, links lead somewhere."""

import ast
import inspect
import json
import re
import shlex
import sys

import pytest

import warpsph
from tests.documents import LAW, PAGES, ROOT, blocks, run_as_module
from warpsph.cli.main import _parser, main
from warpsph.cli.stored import StoredScene
from warpsph.storage.reading import tomllib

sys.path.insert(0, str(ROOT / "tools"))
import cell_picture
import tables


def everywhere(language):
    return [
        pytest.param(block, id=f"{page.stem}-{k}")
        for page in PAGES
        for k, block in enumerate(blocks(page, language))
        if not block.startswith(LAW)  # the fixture `maxwell` takes that one
    ]


@pytest.mark.parametrize("block", everywhere("python"))
def test_python_runs(block, maxwell, registered, undrawn, tmp_path, monkeypatch):
    """A scene file also as `warpsph run` does it, with its checks."""
    monkeypatch.chdir(tmp_path)
    if callable(getattr(run_as_module("block", block, tmp_path), "scene", None)):
        assert main(["run", "block.py", "--device", "cpu", "--quiet"]) == 0


@pytest.mark.parametrize("block", everywhere("toml"))
def test_toml_is_a_scene(block, tmp_path):
    StoredScene(tmp_path / "scene.toml", tomllib.loads(block)).build([])


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_commands_are_understood(page):
    """Whether they do what they should is for the tests of the commands."""
    for line in re.findall(r"^(?:\.venv/bin/)?warpsph (.*)$", page.read_text(encoding="utf-8"), re.MULTILINE):
        _parser().parse_args(shlex.split(line, comments=True))


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_links_lead_somewhere(page):
    for target in re.findall(r"\]\(([^)#:]+)\)", page.read_text(encoding="utf-8")):
        assert (page.parent / target).exists(), target


def test_tables_that_follow_from_the_code_are_as_it_has_them():
    """Written by `python tools/tables.py`."""
    found = []
    for page in PAGES:
        text = page.read_text(encoding="utf-8")
        assert tables.filled(text) == text, f"{page.name}: run python tools/tables.py"
        found += [name for _, name, _ in tables.PLACE.findall(text)]
    assert sorted(found) == sorted(tables.TABLES), "each in one place"


SPACES = [warpsph, warpsph.analysis, warpsph.frames, warpsph.materials]
WORDS = {
    word
    for page in PAGES
    for part in re.findall(
        r"^```python\n.*?^```$|`[^`\n]+`", page.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE
    )
    for word in re.findall(r"\w+", part)
}


@pytest.mark.parametrize("space", SPACES, ids=lambda space: space.__name__)
def test_every_public_name_has_a_place_in_the_docs(space):
    assert set(space.__all__) - WORDS == set()


@pytest.mark.parametrize(
    "kind",
    [warpsph.Simulation, warpsph.History, warpsph.Checkpoint, warpsph.frames.Frames, warpsph.frames.Frame],
    ids=lambda kind: kind.__name__,
)
def test_every_public_part_of_what_a_script_uses_has_a_place_in_the_docs(kind):
    """Methods, properties and documented attributes."""
    documented = re.search(r"Attributes:\n(.*?)(?:\n\n|\Z)", inspect.getdoc(kind), re.DOTALL)
    documented = documented[1] if documented else ""
    attributes = [
        name for line in re.findall(r"^    ([\w, ]+):", documented, re.MULTILINE) for name in line.split(", ")
    ]
    methods = [name for name in vars(kind) if not name.startswith("_")]
    assert {*methods, *attributes} - {"close", "observe"} - WORDS == set()


# `Ramp(duration, value=1)` in the first cell of a table; docs/materials.md speaks of functions on the device.
SIGNATURES = [
    pytest.param(name, arguments, id=f"{page.stem}-{name}")
    for page in PAGES
    if page.stem != "materials"
    for cell in re.findall(r"^\| ([^|]*) \|", page.read_text(encoding="utf-8"), re.MULTILINE)
    for name, arguments in re.findall(r"`(\w+)\(([^`]*)\)`", cell)
    if any(name in space.__all__ for space in SPACES)
]


@pytest.mark.parametrize(("name", "arguments"), SIGNATURES)
def test_signatures_in_tables_are_those_of_the_code(name, arguments):
    """Arguments by name and in order, with their defaults; ones that may be left out need not be there."""
    space = next(space for space in SPACES if name in space.__all__)
    parameters = inspect.signature(getattr(space, name)).parameters
    written = ast.parse(f"def f({arguments}): pass").body[0].args
    names = [each.arg for each in (*written.args, *written.kwonlyargs)]
    defaults = dict(zip(reversed([each.arg for each in written.args]), reversed(written.defaults), strict=False))
    defaults |= {a.arg: d for a, d in zip(written.kwonlyargs, written.kw_defaults, strict=True) if d}
    assert names == [each for each in parameters if each in names], "in this order"
    for each, parameter in parameters.items():
        assert each in names or parameter.default is not parameter.empty, f"{each} is missing"
        if each in defaults:
            assert ast.literal_eval(defaults[each]) == parameter.default
        elif each in names and written.kwonlyargs:
            assert parameter.default is parameter.empty, f"{each} has a default"


def anchors(page):
    """Anchors of the headings of a page, as GitHub makes them."""
    headings = re.findall(r"^#+ (.*)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_anchors_of_links_are_headings(page):
    for target, anchor in re.findall(r"\]\(([^)#:]*)#([^)]+)\)", page.read_text(encoding="utf-8")):
        assert anchor in anchors(page.parent / target if target else page), f"{target}#{anchor}"


def test_sections_of_the_method_that_the_code_refers_to_exist():
    """ "METHOD section 4" is the heading "## 4. …" of docs/method.md."""
    sections = re.findall(r"^## (\d+)\. ", (ROOT / "docs" / "method.md").read_text(encoding="utf-8"), re.MULTILINE)
    assert sections == [str(k + 1) for k in range(len(sections))]
    for folder in ("warpsph", "examples", "tests", "tools"):
        for path in (ROOT / folder).rglob("*.py"):
            for number in re.findall(r"METHOD,?\s+section\s+(\d+)", path.read_text(encoding="utf-8")):
                assert number in sections, f"{path.relative_to(ROOT)}: METHOD section {number}"


def test_places_of_the_docs_that_the_code_refers_to_exist():
    for folder in ("warpsph", "examples", "tests", "tools"):
        for path in (ROOT / folder).rglob("*.py"):
            for page, anchor in re.findall(r"\b((?:docs/)?\w+\.md)#([\w-]+)", path.read_text(encoding="utf-8")):
                assert anchor in anchors(ROOT / page), f"{path.relative_to(ROOT)}: {page}#{anchor}"


def test_what_a_run_writes_is_in_the_docs(undrawn, tmp_path):
    """Its files, the keys of its summary, the tables of its scene as data."""
    assert (
        main(["run", "elastic_bar", "--until", "1e-3", "--device", "cpu", "--quiet", "--out", str(tmp_path)]) == 0
    )
    words = set(re.findall(r"`([^`\n]+)`", (ROOT / "docs" / "output.md").read_text(encoding="utf-8")))
    files = {path.name + "/" * path.is_dir() for path in tmp_path.iterdir()}
    keys = set(json.loads((tmp_path / "summary.json").read_text(encoding="utf-8")))
    scene = tomllib.loads((tmp_path / "scene.toml").read_text(encoding="utf-8"))
    asked = {"run": scene["run"], "code": scene["code"]}
    for found in (files, keys, {f"[{name}]" for name in asked}, *asked.values()):
        assert set(found) - words == set()


def test_the_picture_of_a_cell_can_be_made_again(tmp_path, monkeypatch):
    """With all that it says; where its lines run is up to matplotlib."""
    kept, path = cell_picture.PATH.read_text(encoding="utf-8"), tmp_path / "cell.svg"
    monkeypatch.setattr(cell_picture, "PATH", path)
    assert cell_picture.main() == 0
    said = [
        re.findall(r"<text[^>]*>(.*?)</text>", text, re.DOTALL)
        for text in (kept, path.read_text(encoding="utf-8"))
    ]
    assert said[0] == said[1] and len(said[0]) > 5
