"""README and docs: Python blocks run, TOML blocks are scenes, commands are commands, links lead somewhere."""

import re
import shlex

import pytest

from tests.documents import LAW, PAGES, blocks, run_as_module
from warpsph.cli.main import _parser, main
from warpsph.cli.stored import StoredScene
from warpsph.storage.reading import tomllib


def everywhere(language):
    return [
        pytest.param(block, id=f"{page.stem}-{k}")
        for page in PAGES
        for k, block in enumerate(blocks(page, language))
        if not block.startswith(LAW)  # the fixture `maxwell` takes that one
    ]


@pytest.mark.parametrize("block", everywhere("python"))
def test_python_runs(block, maxwell, tmp_path, monkeypatch):
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
