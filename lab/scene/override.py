"""What the command line changes of a scene: camera, sun, exposure."""

from __future__ import annotations

from dataclasses import replace

from lab.errors import LabError
from lab.scene.scene import Camera, Scene, SunLight, Vec3
from lab.scene.sky import SUN_IRRADIANCE
from lab.scene.values import direction, number, vector

_FORM = "x,y,z:x,y,z[:x,y,z[:degrees]] (eye:target, then up and vertical angle of view)"


def override(
    scene: Scene, *, camera: str | None = None, sun: str | None = None, exposure: float | None = None
) -> Scene:
    """`scene` with what is not None changed.

    Args:
        scene: left as it is.
        camera: the name of one of its cameras, or ``x,y,z:x,y,z[:x,y,z[:degrees]]`` = eye, target, up, vertical angle
            of view. It becomes the first camera.
        sun: ``x,y,z``, the direction to the sun. It takes the place of the scene's suns, with the irradiance of the
            first of them, or :data:`lab.scene.sky.SUN_IRRADIANCE` where there is none.
        exposure: over 0.

    Errors: :class:`LabError` naming what was given and the form it must have.
    """
    if camera is not None:
        chosen = parse_camera(camera) if ":" in camera and camera not in _names(scene) else scene.camera(camera)
        others = [other for other in scene.cameras if other is not chosen]
        scene = replace(scene, cameras=[chosen, *others])
    if sun is not None:
        to_sun = direction(f"sun {sun!r}", _numbers("sun", sun, "x,y,z, the direction to the sun"))
        irradiance = scene.suns[0].irradiance if scene.suns else SUN_IRRADIANCE
        scene = replace(scene, suns=[SunLight(to_sun, irradiance)])
    if exposure is not None:
        scene = replace(scene, exposure=number("exposure", exposure, 0, open_low=True))
    return scene


def parse_camera(text: str) -> Camera:
    """The camera that ``eye:target[:up[:degrees]]`` describes, each but the last as x,y,z."""
    fields = text.split(":")
    if not 2 <= len(fields) <= 4:
        raise LabError(f"camera {text!r} has {len(fields)} parts: its form is {_FORM}")
    eye, target = _numbers("camera", fields[0], _FORM), _numbers("camera", fields[1], _FORM)
    up: Vec3 = _numbers("camera", fields[2], _FORM) if len(fields) > 2 and fields[2].strip() else (0.0, 1.0, 0.0)
    fov = 45.0
    if len(fields) > 3:
        try:
            fov = float(fields[3])
        except ValueError:
            raise LabError(f"camera {text!r}: the angle {fields[3]!r} is no number; the form is {_FORM}") from None
    return Camera("given", eye, target, up, fov)


def _numbers(what: str, text: str, form: str) -> Vec3:
    try:
        values = [float(word) for word in text.split(",")]
    except ValueError:
        values = []
    if len(values) != 3:
        raise LabError(f"{what}: {text!r} is not three numbers; the form is {form}")
    return vector(f"{what} {text!r}", values)


def _names(scene: Scene) -> list[str]:
    return [camera.name for camera in scene.cameras]
