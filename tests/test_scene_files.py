"""Scene files and the modules beside them: each file gets its own, whatever they are called."""

import sys
import textwrap

import pytest

from warpsph import Probe, SceneError
from warpsph.cli.catalogue import load, shipped

SCENE = """
from warpsph import Box, Elastic, Scene
{before}
def scene(p):
    return Scene(shape=Box((1.0,), 0.5), material=Elastic(young_modulus={value}, density=1.0), duration=1.0)
"""
USES_HELPER = SCENE.format(before="import helper", value="helper.E")


def write(folder, **files):
    """A folder with Python files in it."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in files.items():
        (folder / f"{name}.py").write_text(textwrap.dedent(text))
    return folder


def modulus(file):
    return file.build(())[0].material.young_modulus


@pytest.fixture(autouse=True)
def nothing_leaks():
    modules, path = dict(sys.modules), list(sys.path)
    yield
    left = {name for name in sys.modules if sys.modules[name] is not modules.get(name, sys.modules[name])}
    assert not left and modules.keys() <= sys.modules.keys() and path == sys.path
    assert not {"helper", "parts"} & sys.modules.keys() - modules.keys()


def test_each_scene_file_imports_the_helper_beside_it(tmp_path):
    folders = [write(tmp_path / name, scene=USES_HELPER, helper=f"E = {name}.0") for name in "12"]
    files = [load(str(folder / "scene.py")) for folder in folders]
    assert [modulus(file) for file in files] == [1.0, 2.0]
    assert [file.module.helper.E for file in files] == [1.0, 2.0]


def test_two_scenes_of_one_folder_have_a_helper_each(tmp_path):
    sets = SCENE.format(before="import helper\nhelper.E = 5.0", value="helper.E")
    folder = write(tmp_path, one=sets, two=USES_HELPER, helper="E = 1.0")
    assert [modulus(load(str(folder / name))) for name in ("one.py", "two.py")] == [5.0, 1.0]


def test_packages_beside_scene_files_are_kept_apart_with_all_that_is_in_them(tmp_path):
    scene = SCENE.format(before="from parts.soil import E", value="E()")
    soil = """
        from . import numbers
        def E():
            from parts import late
            return late.E + numbers.E
        """
    files = []
    for name in "12":
        folder = write(tmp_path / name, scene=scene)
        write(folder / "parts", __init__="", soil=soil, late=f"E = {name}.0", numbers="E = 10.0")
        files.append(load(str(folder / "scene.py")))
    assert [modulus(file) for file in files[::-1]] == [12.0, 11.0]


def test_functions_of_a_scene_file_import_what_is_beside_it_when_they_are_called(tmp_path):
    """In `scene`, `checks` and probes, also after another file has imported a module of the same name."""
    scene = """
        from warpsph import Box, Check, Elastic, Scene
        def scene(p):
            import helper
            material = Elastic(young_modulus=helper.E, density=1.0)
            return Scene(shape=Box((1.0,), 0.5), material=material, duration=1.0)
        def checks(run):
            import helper
            return [Check("E", helper.E, helper.E, "Pa", 0.1)]
        """
    files = [load(str(write(tmp_path / name, scene=scene, helper=f"E = {name}.0") / "scene.py")) for name in "12"]
    assert [modulus(file) for file in (*files, *files[::-1])] == [1.0, 2.0, 2.0, 1.0]
    assert [file.checks(None)[0].value for file in files] == [1.0, 2.0]


def test_files_of_one_name_in_two_folders_are_two_modules(tmp_path):
    """A class of the file finds its own module: dataclasses and pickles look it up by name."""
    soil = """
import sys
class Soil:
    E = {}.0
def again():
    return sys.modules[Soil.__module__].Soil.E
"""
    files = []
    for name in "12":
        folder = write(tmp_path / name, scene=SCENE.format(before=soil.format(name), value="again()"))
        files.append(load(str(folder / "scene.py")))
    assert [modulus(file) for file in files] == [1.0, 2.0]


def test_a_scene_file_may_load_another_one(tmp_path):
    inner = write(tmp_path / "inner", scene=USES_HELPER, helper="E = 2.0") / "scene.py"
    outer = f"""
        import helper
        from warpsph.cli.catalogue import load
        def scene(p):
            found = load({str(inner)!r}).build(())[0]
            import helper
            assert found.material.young_modulus == 2.0 and helper.E == 1.0
            return found
        """
    assert modulus(load(str(write(tmp_path / "outer", scene=outer, helper="E = 1.0") / "scene.py"))) == 2.0


def test_a_module_the_user_has_imported_comes_back(tmp_path, monkeypatch):
    mine = write(tmp_path / "mine", helper="E = 7.0")
    folder = write(tmp_path / "its", scene=USES_HELPER, helper="E = 1.0")
    with monkeypatch.context() as patch:
        patch.syspath_prepend(str(mine))
        import helper

        assert modulus(load(str(folder / "scene.py"))) == 1.0
        assert sys.modules.pop("helper") is helper and helper.E == 7.0


def test_what_is_installed_is_never_imported_a_second_time(tmp_path):
    """A folder may hold this package, or files called as parts of the standard library are."""
    import json

    import numpy

    scene = SCENE.format(before="import json, numpy, warpsph.report", value="1.0")
    folder = write(tmp_path, scene=scene, json="raise SystemExit")
    write(folder / "warpsph", __init__="raise SystemExit")
    file = load(str(folder / "scene.py"))
    assert file.module.json is json and file.module.numpy is numpy and file.module.Scene is type(file.build(())[0])


def test_an_error_in_a_helper_leaves_nothing_behind(tmp_path):
    folder = write(tmp_path, scene=USES_HELPER, helper="1 / 0")
    with pytest.raises(SceneError, match=r"ZeroDivisionError, line 3"):
        load(str(folder / "scene.py"))


def test_shipped_scenes_share_helpers_and_leave_none():
    assert {load(name).name for name in shipped()} == set(shipped())
    assert "_standard_sph" not in sys.modules


def test_probes_import_while_a_run_goes_on(tmp_path):
    """What the runner holds open while it calls probes."""
    scene = SCENE.format(before="def value(simulation):\n    import helper\n    return helper.E", value="1.0")
    file = load(str(write(tmp_path, scene=scene, helper="E = 3.0") / "scene.py"))
    probe = Probe("E", "Pa", file.module.value)
    with file.errors_located():
        assert probe.function(None) == 3.0
