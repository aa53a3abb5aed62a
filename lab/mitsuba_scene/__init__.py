"""A scene as a scene of Mitsuba 3: what ``lab export -o scene.xml`` writes, and what the outside judge renders.

Mitsuba describes light as this project does (linear RGB, radiance, irradiance, intensity), so most of a scene has an
exact counterpart. Where it has none, the nearest is written and a note says so:

- Alpha masks: Mitsuba's ``mask`` blends, ours cuts at ``alpha_cutoff``. The cut is drawn ahead into a finer, black
  and white opacity map without interpolation, so that its edge lies within a fraction of a texel of ours. Only
  ``volpath`` lets shadow rays through holes and counts no bounce there: scenes with holes name that integrator.
- Emitting surfaces shine by their interpolated normals in Mitsuba, by their triangles' in ours: they are written
  without vertex normals. Two-sided ones get a second, reversed copy a hair behind the first.
- Spots fade linearly over the angle in Mitsuba, by a squared ramp over the cosine in ours (KHR_lights_punctual):
  a projected texture carries our ramp, up to :data:`lab.mitsuba_scene.emitters.WIDEST_PROJECTION`.
- Lambertian lights of a light list become tiny one-sided discs.
- The background is left out: in Mitsuba it would light the scene.
- Vertex colours that vary over a textured surface are replaced by their mean: Mitsuba multiplies no textures.
- At grazing angles interpolated normals differ: Mitsuba tells the side that light comes from by them, ours by the
  geometry. Only silhouettes of smooth surfaces show it.
"""

from lab.mitsuba_scene.document import MitsubaScene, export_mitsuba

__all__ = ["MitsubaScene", "export_mitsuba"]
