"""What ``lab COMMAND --help`` teaches below the flags."""

from lab.view.keys import key_table

RENDER_EXAMPLES = """examples:
  lab render scenes/atrium/scene.toml
  lab render sponza.glb -o out/sponza --size 1920x1080 --sun 0.3,1,0.2
  lab render scene.toml --set vpls=1000000 alpha=2 --set filter=none
  lab render scene.toml --preset paper --camera gallery
  lab render scene.toml --camera -3,1.6,0:4,2,0:0,1,0:55     eye:target[:up[:vertical angle]]
  lab render --from out/atrium.json                          the same run again, bit for bit
  lab render --from out/atrium.json --set shadow_samples=16  the same but for one setting

Writes BASE.png (tone-mapped), BASE.exr (every layer, linear) and BASE.json (settings, machine, times, counts).
'lab params' lists every setting."""

HEATMAP_EXAMPLES = """examples:
  lab heatmap scenes/atrium/scene.toml -o out/atrium-heat
  lab heatmap sponza.glb -o out/heat --set first_level=1 vpls=10000
  lab heatmap sponza.glb -o out/heat --engine vulkan --set lighting=raster   what the rasteriser makes of the cubes, too

overdraw of a pixel = lights whose cube of half-edge 2 r_l contains its point. No shadows are traced and nothing is
filtered: settings of those stages change nothing here.
Writes BASE.png (total and each level, with colour bars), BASE.exr and BASE.json."""

EXPORT_EXAMPLES = """examples:
  lab export scenes/atrium/scene.toml -o out/atrium.vtm   for ParaView: one block a level (needs the extra 'gui')
  lab export sponza.glb -o out/lights.npz                 numpy: L0_position, L0_flux, L1_position, ...
  lab export sponza.glb -o out/lights.ply                 one point cloud, with level, cell_size and flux as fields
  lab export sponza.glb -o out/sponza.xml --size 640x360  the scene itself, for Mitsuba 3: mitsuba out/sponza.xml

Level 0 is the input lights. Of an .xml the meshes and textures lie in NAME-mitsuba beside it; paths there have
max_bounces bounces, as ours do, and what Mitsuba can't do alike is noted."""

COMPARE_EXAMPLES = """examples:
  lab compare out/ours.exr out/reference.exr                      the layer 'colour', as JSON
  lab compare ours.exr reference.exr --layer indirect -o out/cmp  with pictures: side by side, signed error, FLIP
  lab compare ours.exr mitsuba.exr                                plain R G B of other programs is taken as 'colour'
  lab compare ours.exr reference.exr --region 100,40,64,64 --per-channel

B is the reference. Over all values a of A and b of B:
  rel_mse       mean of (a - b)^2 / (b^2 + epsilon^2), epsilon = 1 % of the mean of B's layer
  mse, rmse     mean of (a - b)^2, and its square root
  energy_ratio  sum of A over sum of B: 1 where no light is lost or invented
  flip          mean HDR-FLIP, 0 (looks the same) to 1, at 67 pixels a degree, exposures from B; RGB light only
  rel_mse_noise the part of rel_mse that is B's own noise, where B has the layer's variance (as 'lab reference' writes)
A region's numbers use the whole layer's epsilon and FLIP map. What has no value is null, and 'notes' say why.
-o DIR writes side_by_side.png, error.png (red: A too bright, blue: too dark), flip.png and comparison.json."""

REFERENCE_EXAMPLES = """examples:
  lab reference scenes/cornell/scene.toml --size 640x360
  lab reference sponza.glb --error 1% -o out/sponza-truth          until the relative error is 1 %
  lab reference sponza.glb --time 10m                              until ten minutes are over
  lab reference scene.toml --method brute_force --spp 4096 --set vpls=1000000 compensation=path
  lab reference --from out/atrium.json                             what that frame should have looked like

Methods:
  path_tracer   no virtual lights: paths from the camera, with rays to the scene's lights at every bounce. Of the
                settings max_bounces and seed count. A sample is a path a pixel (default: 256).
  brute_force   every virtual light (or light of the scene's list), with a shadow ray to each. vpls, max_bounces, seed,
                falloff, clamp_distance and compensation count. A sample is a light drawn a pixel (default: 1024) in
                proportion to what it sends; a pixel that fewer lights reach is exact.
Of --spp, --error and --time whichever is met first ends it. --error is that of the indirect light: the mean standard
error of a pixel over the mean.

Writes BASE.exr (colour, direct, indirect, and the variance of each: colour_variance ...), BASE.png and BASE.json. What
was computed is kept in the folder LAB_CACHE, or that of your caches: more samples add to it, after Ctrl-C too, and
another scene, view, setting or version of the program never finds it. It may be deleted at any time."""

ATTRIBUTE_EXAMPLES = """examples:
  lab attribute scenes/atrium/scene.toml
  lab attribute sponza.glb -o out/sponza-budget --size 320x180
  lab attribute scene.toml --preset paper --set vpls=10000

Each approximation is switched on alone, everything else being exact, and off alone in the whole frame: where the two
differ, approximations interact. Error is relMSE of the indirect light against the path-traced truth (or the sum over
all virtual lights, where that tells a term apart) with the noise of both taken off; energy ratio and HDR-FLIP beside
it. Every row of the page says what was compared with what. The presets ours, paper and demo are ranked with the same
--set. The references are kept as those of 'lab reference' are; Sponza takes some minutes on two cores.
Writes DIR/index.html (one page, pictures inside) and DIR/attribution.json."""

INSPECT_EXAMPLES = """examples:
  lab inspect scenes/atrium/scene.toml               prints an address to open in a browser on this machine
  lab inspect sponza.glb --set alpha=2 --size 960x540
  lab inspect sponza.glb --host 0.0.0.0 --port 8700  for other machines, too: there is no password
  lab inspect scene.toml --window                    the 3D view alone, in a window on this desktop
  lab inspect scene.toml --screenshot out/views      every view as a PNG, for documents and scripts; no display needed
  lab inspect --state inspector.json                 goes on where 'save' left off

Click a pixel of the picture, or a point of the scene, and see every light behind it; change a setting and see what it
does. ? in the picture lists its keys. All browsers that open the address share one inspector."""

VIEW_EXAMPLES = f"""examples:
  lab view scenes/atrium/scene.toml
  lab view sponza.glb --size 1920x1080 --set interleave=4 alpha=2
  lab view sponza.glb --device 1 --preset paper
  lab view scene.toml --regenerate                             lights that move: all seven stages every frame
  lab view scene.toml --frames 256                             the median time of each stage, on the device
  xvfb-run -a lab view scene.toml --frames 3 --screenshot a.png  without a screen

keys:
{key_table()}

The panel changes every setting while the scene is rendered. What a change does not touch is kept: VPLs and hierarchy
stay as long as the settings that concern them do."""

MAIN_EXAMPLES = """examples:
  lab render scenes/atrium/scene.toml          a picture, its layers and its record in out/
  lab heatmap scenes/atrium/scene.toml         how many lights each pixel looks at
  lab export scenes/atrium/scene.toml -o out/atrium.npz
  lab reference scenes/atrium/scene.toml       what the picture should look like, path traced
  lab attribute scenes/atrium/scene.toml       where its error comes from, term by term
  lab probe scenes/atrium/scene.toml 640 360   why that pixel looks as it does, light by light
  lab inspect scenes/atrium/scene.toml         see inside: levels, overdraw, one pixel's lights, in the browser
  lab view scenes/atrium/scene.toml            fly through it in real time (Vulkan)
  lab bench                                    each stage's time against the limits of this machine
  lab compare out/a.exr out/b.exr              how far a picture is from another, in numbers and pictures
  lab params                                   every setting, what it may be, and what the presets say
  lab info                                     versions, processor, what is installed

'lab COMMAND --help' tells more. Exit codes: 0 done, 1 failed, 2 bad input, 130 interrupted."""
