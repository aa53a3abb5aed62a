"""Where VTK draws when there is no screen."""

from __future__ import annotations

import os
import subprocess
import sys
from functools import cache

from lab import LabError

_PROBE = (
    "import vtkmodules.vtkRenderingOpenGL2 as gl; w = gl.vtkEGLRenderWindow(); w.SetOffScreenRendering(1); w.Render()"
)


@cache
def use_software_display() -> None:
    """Lets VTK draw off-screen through EGL, which needs no display; must come before VTK is loaded.

    It is tried in a process of its own: where EGL has no driver, VTK ends the process that asks.

    Errors: :class:`lab.LabError` naming the system packages.
    """
    os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")
    if os.environ["VTK_DEFAULT_OPENGL_WINDOW"] != "vtkEGLRenderWindow":
        return  # the user's own choice
    tried = subprocess.run([sys.executable, "-c", _PROBE], capture_output=True, check=False)
    if tried.returncode:
        raise LabError(
            "nothing can be drawn in 3D: EGL has no driver here. On Debian or Ubuntu: "
            "apt-get install libegl1 libegl-mesa0 libgl1-mesa-dri"
        )
