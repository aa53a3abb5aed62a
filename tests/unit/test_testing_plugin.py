"""The pytest plugin: what its fixtures hand out, what its options change, and what it says about mistakes."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable

import pytest

from ..conftest import write_quads
from .inner_pytest import load_everything, run

pytest_plugins = "pytester"

Run = Callable[..., pytest.RunResult]


@pytest.fixture(scope="module", autouse=True)
def loaded(tmp_path_factory: pytest.TempPathFactory) -> None:
    """All modules, before the first inner run."""
    load_everything(tmp_path_factory.mktemp("loading"))


@pytest.fixture
def inner(pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch) -> Run:
    """Runs pytest on a text of tests."""
    return lambda body, *args: run(pytester, monkeypatch, body, *args)


def test_a_marker_names_scene_size_and_camera(inner: Run) -> None:
    inner("""
        @pytest.mark.lab_scene("quads/scene.toml", size=(32, 18), camera="side")
        def test_marked(lab_scene, lab_engine, lab_render):
            assert lab_scene.name == "quads" and lab_engine.scene is lab_scene
            frame = lab_render(SETTINGS, alpha=2)
            assert frame.image.colour.shape == (18, 32, 3) and frame.camera.name == "side"
            assert frame.params == SETTINGS.replace(alpha=2)
            again = lab.render(lab_scene, SETTINGS.replace(alpha=2), camera="side", size=(32, 18))
            np.testing.assert_array_equal(frame.image.colour, again.image.colour)

        @pytest.mark.lab_scene("quads/scene.toml")
        def test_what_is_left_open(lab_render):
            frame = lab_render(vpls=50)
            assert frame.gbuffer.size == (160, 90) and frame.camera.name == "front"
            assert frame.params == lab.Params(vpls=50)

        @pytest.mark.lab_scene("quads", camera="0,1,4:0,0,0:0,1,0:30")
        def test_a_call_may_differ(lab_render):
            assert lab_render(SETTINGS, size=(9, 5)).camera.fov_y_deg == 30
            frame = lab_render(SETTINGS, size=(9, 5), camera="side")
            assert frame.gbuffer.size == (9, 5) and frame.camera.name == "side"
            assert lab_render(SETTINGS, size=(9, 5), camera=frame.camera).camera is frame.camera
    """).assert_outcomes(passed=3)


def test_markers_of_the_class_and_the_module_fill_what_is_open(inner: Run) -> None:
    inner("""
        pytestmark = pytest.mark.lab_scene("quads/scene.toml", size=(8, 4), camera="side")

        @pytest.mark.lab_scene(size=(6, 3))
        class TestClass:
            def test_size(self, lab_render):
                frame = lab_render(SETTINGS)
                assert frame.gbuffer.size == (6, 3) and frame.camera.name == "side"

            @pytest.mark.lab_scene("quads")
            def test_the_camera_of_another_scene_does_not_count(self, lab_render):
                frame = lab_render(SETTINGS)
                assert frame.gbuffer.size == (6, 3) and frame.camera.name == "front"
    """).assert_outcomes(passed=2)


def test_scenes_and_engines_are_made_once(inner: Run, pytester: pytest.Pytester) -> None:
    write_quads(pytester.path / "other", head='name = "other"\ngeometry = ["quads.obj"]\n')
    inner("""
        seen = []

        @pytest.mark.parametrize("_", range(2))
        @pytest.mark.parametrize("lab_scene", ["quads/scene.toml", "quads", "other/scene.toml"], indirect=True)
        def test_scenes(lab_scene, lab_engine, lab_render, _):
            assert lab_engine.scene is lab_scene and lab_render.engine is lab_engine
            seen.append(lab_engine)

        def test_engines():
            assert len(seen) == 6 and len(set(seen)) == 2
    """).assert_outcomes(passed=7)


def test_a_scene_made_in_python_takes_the_place_of_the_marker(inner: Run) -> None:
    inner("""
        from dataclasses import replace

        @pytest.fixture
        def lab_scene():
            scene = lab.load_scene("quads/scene.toml")
            return replace(scene, name="mine", cameras=scene.cameras[1:])

        @pytest.mark.lab_scene(size=(8, 4))
        def test_mine(lab_scene, lab_render):
            frame = lab_render(SETTINGS)
            assert frame.camera.name == "side" and frame.gbuffer.size == (8, 4)
    """).assert_outcomes(passed=1)


SHOWS = """
    @pytest.mark.lab_scene("nowhere.toml", size=(6, 3), camera="gone")
    def test_marked(lab_scene, lab_render):
        assert lab_scene.name == "other"
        frame = lab_render(SETTINGS)
        assert (frame.gbuffer.size, frame.camera.name) == EXPECTED

    def test_unmarked(lab_scene):
        assert lab_scene.name == "other"
"""


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        ([], ((6, 3), "front")),
        (["--lab-size", "12x7"], ((12, 7), "front")),
        (["--lab-size=5x4", "--lab-camera=side"], ((5, 4), "side")),
    ],
)
def test_the_command_line_comes_before_the_markers(
    inner: Run, pytester: pytest.Pytester, options: list[str], expected: object
) -> None:
    write_quads(pytester.path / "other", head='name = "other"\ngeometry = ["quads.obj"]\n')
    body = f"EXPECTED = {expected}\n" + SHOWS.replace("\n    ", "\n")
    inner(body, "--lab-scene=other/scene.toml", *options).assert_outcomes(passed=2)


def test_references_are_those_of_the_settings_and_come_from_disk(inner: Run, pytester: pytest.Pytester) -> None:
    body = """
        from lab.engine.cpu import CpuEngine
        from lab.reference import Budget, brute_force, path_traced

        pytestmark = pytest.mark.lab_scene("quads/scene.toml", size=(8, 5), camera="side")

        def test_brute_force(lab_scene, lab_render, lab_reference):
            frame = lab_render(SETTINGS)
            found = lab_reference("brute_force", frame.params, spp=100)
            view = CpuEngine(lab_scene), lab_scene.camera("side"), (8, 5)
            expected = brute_force(*view, SETTINGS, budget=Budget(spp=100))
            assert found.samples == 100
            np.testing.assert_array_equal(found.indirect, expected.indirect)
            other = lab_reference("brute_force", SETTINGS, spp=100, vpls=50)
            assert not np.array_equal(other.indirect, found.indirect)

        def test_path_tracer(lab_scene, lab_reference):
            found = lab_reference("path_tracer", seed=3, spp=4)
            view = CpuEngine(lab_scene), lab_scene.camera("side"), (8, 5)
            expected = path_traced(*view, lab.Params(seed=3), budget=Budget(spp=4))
            np.testing.assert_array_equal(found.colour, expected.colour)
            assert lab_reference("path_tracer", spp=4, size=(4, 3)).colour.shape == (3, 4, 3)
    """
    inner(body).assert_outcomes(passed=2)
    stored = {path: path.stat().st_mtime_ns for path in (pytester.path / "cache").rglob("*.npz")}
    assert len(stored) == 4
    inner(body).assert_outcomes(passed=2)
    assert {path: path.stat().st_mtime_ns for path in (pytester.path / "cache").rglob("*.npz")} == stored


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--lab-size", "160"], "--lab-size: '160': expected WIDTHxHEIGHT in pixels, for example 160x90"),
        (["--lab-size", "0x9"], "--lab-size: '0x9': expected"),
        (["--lab-size", "axb"], "--lab-size: 'axb': expected"),
        (["--lab-scene", "gone.glb"], "--lab-scene: there is no scene 'gone.glb'; looked for "),
        (["--lab-evidence", "test_experiment.py"], "is a file; name a folder"),
        (["--lab-evidence", "."], "holds the tests; name a folder that is only for evidence"),
        (["--lab-evidence", ".."], "holds the tests"),
    ],
)
def test_bad_options_are_usage_errors(inner: Run, options: list[str], said: str) -> None:
    result = inner("def test_nothing(): pass\n", *options)
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    shown = "\n".join([*result.outlines, *result.errlines])
    assert f"ERROR: {options[0]}: " in shown and said in shown
    assert "Traceback" not in shown and "test_nothing" not in shown


MISTAKES = {
    "no scene": ("", "test_wrong renders a scene, but nothing names one: mark the test @pytest.mark.lab_scene("),
    "missing": ('"gone.toml"', "there is no scene 'gone.toml'; looked for "),
    "unknown word": ('"quads", sise=(8, 4)', "was given 'sise'; did you mean 'size'?; its form is lab_scene(path, *"),
    "two paths": ('"quads", "more"', "was given more than one path; its form is"),
    "size": ('"quads", size=(8,)', "size=(8,): expected (width, height) in pixels"),
    "no number": ('"quads", size=("8", 4)', "expected (width, height) in pixels"),
    "camera": ('"quads", camera="sid"', "no camera 'sid' in quads: there are front, side; did you mean 'side'?"),
    "camera's form": ('"quads", camera="1,2:3"', "is not three numbers; the form is"),
    "no scene file": ('"test_experiment.py"', "test_experiment.py ends in '.py': scenes are read from .toml"),
    "broken": ('"broken.toml"', "broken.toml"),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_in_a_marker_is_one_line_without_a_traceback(
    inner: Run, pytester: pytest.Pytester, mistake: str
) -> None:
    given, said = MISTAKES[mistake]
    (pytester.path / "broken.toml").write_text("= 3")
    mark = f"@pytest.mark.lab_scene({given})" if given else ""
    result = inner(f"{mark}\ndef test_wrong(lab_render, lab_reference): pass\n")
    result.assert_outcomes(errors=1)
    shown = result.stdout.str()
    assert said in shown
    assert "Traceback" not in shown and ".py:" not in shown.partition("short test summary")[0], shown


def test_a_wrong_setting_is_shown_at_the_line_that_has_it(inner: Run) -> None:
    result = inner("""
        @pytest.mark.lab_scene("quads", size=(8, 4))
        def test_wrong(lab_render):
            lab_render(alhpa=2)

        @pytest.mark.lab_scene("quads", size=(8, 4))
        def test_wrong_method(lab_reference):
            lab_reference("brute", spp=4)

        @pytest.mark.lab_scene("quads", size=(8, 4))
        def test_it_can_be_expected(lab_render):
            with pytest.raises(lab.LabError, match="did you mean 'alpha'"):
                lab_render(alhpa=2)
    """)
    result.assert_outcomes(failed=2, passed=1)
    shown = result.stdout.str()
    assert (
        "LabError: 'alhpa' is not a setting; did you mean 'alpha'?" in shown and ">       lab_render(alhpa=2)" in shown
    )
    assert "LabError: unknown method 'brute'" in shown
    assert "lab_render = <lab_render of quads, 8x4>" in shown
    places = [line for line in result.outlines if line.endswith(": LabError")]
    assert len(places) == 2 and all(place.startswith("test_experiment.py:") for place in places), places


def test_help_lists_options_fixtures_and_the_marker(inner: Run) -> None:
    shown = inner("", "--help").stdout.str()
    assert "many-lights-lab: experiments on scenes (lab.testing):" in shown
    assert all(f"--lab-{name}" in shown for name in ("scene", "camera", "size", "evidence"))
    assert "@pytest.mark.lab_scene(path, *, size=(width, height), camera=NAME)" in inner("", "--markers").stdout.str()
    shown = inner("", "--fixtures").stdout.str()
    assert all(f"\nlab_{name} --" in shown for name in ("scene", "engine", "render", "reference", "evidence"))
    assert "_lab" not in shown


PROBE = """
import json, sys
import pytest
before = set(sys.modules)
import lab.testing.plugin
print(json.dumps(sorted(set(sys.modules) - before)))
"""


def test_the_plugin_loads_nothing_but_itself() -> None:
    """It is loaded in every run of pytest in an environment with the lab in it."""
    done = subprocess.run([sys.executable, "-c", PROBE], capture_output=True, text=True, check=True)
    loaded = json.loads(done.stdout)
    assert {name for name in loaded if name.split(".")[0] != "lab"} <= {"difflib", "hashlib", "_hashlib", "_blake2"}
    assert len(loaded) < 12


@pytest.mark.parametrize("how", [[], ["-p", "lab.testing.plugin"]], ids=["installed", "named too"])
def test_pytest_finds_the_installed_plugin_and_it_is_quiet(pytester: pytest.Pytester, how: list[str]) -> None:
    """Where the package is installed, in any folder, with every warning an error."""
    pytester.makepyfile(
        "def test_nothing(pytestconfig):\n    assert pytestconfig.pluginmanager.has_plugin('lab.testing.plugin')\n"
    )
    # dash, which comes with open3d, brings a plugin that warns.
    result = pytester.runpytest_subprocess("-W", "error", "-p", "no:dash", "-p", "no:cacheprovider", *how)
    result.assert_outcomes(passed=1)
    assert "warning" not in result.stdout.str() and not result.stderr.str()
    assert not (pytester.path / ".lab-evidence").exists()


def test_it_can_be_switched_off(pytester: pytest.Pytester) -> None:
    pytester.makepyfile("def test_nothing(lab_evidence): pass\n")
    off = ["-p", "no:lab.testing.plugin", "-p", "no:dash"]
    pytester.runpytest_subprocess(*off).assert_outcomes(errors=1)
