"""The pytest plugin. ``pytest --help`` lists its options under "many-lights-lab", ``pytest --fixtures`` its fixtures.

=================  ====================================================================================================
``lab_scene``      the scene of the test's marker ``@pytest.mark.lab_scene(path, size=, camera=)`` or of ``--lab-scene``
``lab_engine``     its engine; made once for all tests of a run that render the scene
``lab_render``     renders it: ``lab_render(alpha=2).image.colour``; takes :class:`lab.Params`, single settings, or both
``lab_reference``  its references, kept on disk: ``lab_reference("path_tracer", spp=256).indirect``
``lab_evidence``   a folder for what the test wants to leave; it stays only if the test fails
=================  ====================================================================================================

A ``lab_scene`` fixture of your own, in a test file or conftest.py, takes the place of the marker: the others use it.
``@pytest.mark.parametrize("lab_scene", ["a.glb", "b/scene.toml"], indirect=True)`` runs a test on several scenes.

Write ``--lab-scene=PATH`` in one word: pytest takes a path that stands alone for one of the places of the tests, and
may look for its settings (rootdir) there.

pytest loads this file wherever the package is installed, so it imports nothing of weight, uses only what any pytest
knows, and does nothing for tests that do not use it. Switch it off with ``-p no:lab.testing.plugin``.

PYTEST_DONT_REWRITE: there is nothing in here to rewrite.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, cast

import pytest

from lab.errors import LabError
from lab.testing import folders
from lab.testing.request import DEFAULT_SIZE, MARKER, Wish, find_scene, read_size, read_wish

if TYPE_CHECKING:
    from lab.engine.cpu import CpuEngine
    from lab.scene.scene import Camera, Scene
    from lab.testing.workbench import Referee, Renderer, Workbench

_EVIDENCE = ".lab-evidence"


class _CommandLine:
    """The options of a run, checked.

    Attributes:
        wish: what they ask for.    evidence: the folder of all evidence.

    """

    def __init__(self, config: pytest.Config) -> None:
        here, root = config.invocation_params.dir, config.rootpath
        scene, camera, size, evidence = (_option(config, name) for name in ("scene", "camera", "size", "evidence"))
        option = "scene"
        try:
            path = find_scene(Path(scene).expanduser(), [here]) if scene is not None else None
            option = "size"
            self.wish = Wish(path, read_size(size) if size is not None else None, camera)
            option = "evidence"
            self.evidence = root / _EVIDENCE if evidence is None else _own_folder(here / evidence, root)
        except LabError as error:
            raise pytest.UsageError(f"--lab-{option}: {error}") from None


def _option(config: pytest.Config, name: str) -> str | None:
    text: str | None = config.getoption(f"lab_{name}", None)
    return text


def _own_folder(folder: Path, root: Path) -> Path:
    """`folder`, if evidence can lie there: what lies in a test's part of it is removed when the test runs again."""
    folder = folder.resolve()
    if folder.exists() and not folder.is_dir():
        raise LabError(f"{folder} is a file; name a folder")
    if folder == root or folder in root.parents:
        raise LabError(f"{folder} holds the tests; name a folder that is only for evidence")
    return folder


_command_line = pytest.StashKey[_CommandLine]()


def pytest_addoption(parser: pytest.Parser) -> None:
    """Options of every pytest run, in a group of their own."""
    group = parser.getgroup("many-lights-lab", "many-lights-lab: experiments on scenes (lab.testing)")
    group.addoption(
        "--lab-scene",
        metavar="PATH",
        help="render this scene in place of those that markers name; write it in one word: --lab-scene=PATH",
    )
    group.addoption("--lab-camera", metavar="CAMERA", help="its camera: a name, or eye:target as x,y,z:x,y,z")
    group.addoption(
        "--lab-size",
        metavar="WxH",
        help="size of the pictures; default: the marker's, else {}x{}".format(*DEFAULT_SIZE),
    )
    group.addoption(
        "--lab-evidence",
        metavar="DIR",
        help=f"where failing checks leave pictures, one folder a test; default: {_EVIDENCE} in rootdir",
    )


def pytest_configure(config: pytest.Config) -> None:
    """Registers the marker and refuses options that can't be."""
    config.addinivalue_line("markers", MARKER)
    config.stash[_command_line] = _CommandLine(config)


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> None:
    """A test begins, before its fixtures do."""
    folders.begin(item.nodeid, item.config.stash[_command_line].evidence)


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    """A part of a test is over; unlike other hooks this one knows the outcome, in any version of pytest."""
    if report.failed:
        folders.failed(report.nodeid)


def pytest_runtest_logfinish(nodeid: str) -> None:
    """A test is over, its fixtures' clean-up too."""
    folders.end(nodeid)


@pytest.fixture(scope="session")
def _lab_workbench() -> Workbench:
    from lab.testing.workbench import Workbench

    return Workbench()


@pytest.fixture
def _lab_wish(request: pytest.FixtureRequest) -> Wish:
    markers = [(marker.args, marker.kwargs) for marker in request.node.iter_markers("lab_scene")]
    try:
        return read_wish(markers, _folders(request), request.config.stash[_command_line].wish)
    except LabError as error:
        pytest.fail(str(error), pytrace=False)


@pytest.fixture
def lab_scene(request: pytest.FixtureRequest, _lab_wish: Wish, _lab_workbench: Workbench) -> Scene:
    """The scene of the test's marker, or of --lab-scene. Shared by the tests that render it: leave it as it is."""
    try:
        given = getattr(request, "param", None)
        if given is not None and not isinstance(given, (str, Path)):
            return cast("Scene", given)
        path = _lab_wish.scene if given is None else find_scene(given, _folders(request))
        if path is None:
            raise LabError(
                f"{request.node.name} renders a scene, but nothing names one: mark the test "
                '@pytest.mark.lab_scene("scene.toml"), or run pytest with --lab-scene=PATH'
            )
        return _lab_workbench.scene(path)
    except LabError as error:
        pytest.fail(str(error), pytrace=False)


@pytest.fixture
def lab_engine(lab_scene: Scene, _lab_workbench: Workbench) -> CpuEngine:
    """The engine that renders `lab_scene`, made once a run."""
    return _lab_workbench.engine(lab_scene)


@pytest.fixture
def _lab_camera(lab_scene: Scene, _lab_wish: Wish) -> Camera:
    from lab.testing.workbench import camera_of

    try:
        return camera_of(lab_scene, _lab_wish.camera or "")
    except LabError as error:
        pytest.fail(str(error), pytrace=False)


@pytest.fixture
def lab_render(lab_scene: Scene, lab_engine: CpuEngine, _lab_camera: Camera, _lab_wish: Wish) -> Renderer:
    """Renders `lab_scene` to a Frame; Params(...), single settings (alpha=2), camera= and size= may be given."""
    from lab.testing.workbench import Renderer

    return Renderer(lab_scene, lab_engine, _lab_camera, _lab_wish.size or DEFAULT_SIZE)


@pytest.fixture
def lab_reference(lab_scene: Scene, lab_engine: CpuEngine, _lab_camera: Camera, _lab_wish: Wish) -> Referee:
    """References of `lab_scene`, kept on disk: by "brute_force" (with frame.params) or "path_tracer" (with spp=256)."""
    from lab.testing.workbench import Referee

    return Referee(lab_scene, lab_engine, _lab_camera, _lab_wish.size or DEFAULT_SIZE)


@pytest.fixture
def lab_evidence(request: pytest.FixtureRequest) -> Path:
    """A folder of this test's own; it stays, with all in it, only if the test fails."""
    folder = folders.current()
    if folder is None or folder.test != request.node.nodeid:
        pytest.fail("lab_evidence: another plugin runs this test in its own way; there is no folder for it")
    return folder.make()


def _folders(request: pytest.FixtureRequest) -> list[Path]:
    return [request.path.parent, request.config.rootpath]
