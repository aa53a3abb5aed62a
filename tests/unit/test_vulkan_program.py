"""Programs, buffers and times of the Vulkan engine: what is wrong is said, what is right is run."""

from __future__ import annotations

import gc
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lab.engine.vulkan.layouts import GRID_LIGHT, HIERARCHY_INFO, INPUT_LIGHT
from lab.engine.vulkan.program import ComputeProgram, RayProgram, RayShaders
from lab.engine.vulkan.reflection import ShaderError, dtype_of
from lab.engine.vulkan.uniforms import params_uniform
from lab.params import Params

HERE = Path(__file__).parent
MODULE = str(HERE / "vulkan_shaders")


@pytest.fixture
def scale(gpu: Any) -> ComputeProgram:
    return ComputeProgram(gpu.device, MODULE, "scale", {})


def floats(gpu: Any, count: int = 100) -> dict[str, Any]:
    return {
        "source": gpu.pool.upload(np.arange(count, dtype=np.float32), "source"),
        "result": gpu.pool.take(count, "f4", "result"),
        "count": count,
        "by": 2.0,
    }


def test_a_program_runs_on_what_it_is_given(gpu: Any, scale: ComputeProgram) -> None:
    values = floats(gpu)
    with gpu.stage("scale") as encoder:
        scale.dispatch(encoder, [100, 1, 1], **values)
    np.testing.assert_array_equal(values["result"].numpy(), 2 * np.arange(100))
    np.testing.assert_array_equal(values["result"].numpy(7), 2 * np.arange(7))
    assert scale.names == ["source", "result", "count", "by"]


def test_values_may_change_between_dispatches_of_one_encoder(gpu: Any, scale: ComputeProgram) -> None:
    one, two = floats(gpu), floats(gpu)
    with gpu.stage("scale") as encoder:
        scale.dispatch(encoder, [100, 1, 1], **one)
        scale.dispatch(encoder, [100, 1, 1], **(two | {"by": 5.0}))
        scale.dispatch(encoder, [100, 1, 1], **(two | {"by": 3.0, "source": one["result"]}))
    np.testing.assert_array_equal(one["result"].numpy(), 2 * np.arange(100))
    np.testing.assert_array_equal(two["result"].numpy(), 6 * np.arange(100))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"sauce": 1}, "no parameter 'sauce'; did you mean 'source'"),
        ({"by": None}, "nothing was given for by"),
        ({"source": None, "count": None}, "nothing was given for source, count"),
        ({"by": "2"}, "by takes a number"),
        ({"count": 2.5}, "count takes a number"),
        ({"source": 3}, "source takes a DeviceBuffer"),
    ],
)
def test_what_does_not_fit_is_an_error(gpu: Any, scale: ComputeProgram, change: dict[str, Any], message: str) -> None:
    values = {name: value for name, value in (floats(gpu) | change).items() if value is not None}
    with gpu.stage("scale") as encoder, pytest.raises(ShaderError, match=message):
        scale.dispatch(encoder, [100, 1, 1], **values)


@pytest.mark.parametrize("kind", ["f8", "i4", "2f4"])
def test_a_buffer_of_another_type_is_an_error(gpu: Any, scale: ComputeProgram, kind: str) -> None:
    values = floats(gpu) | {"source": gpu.pool.take(100, kind, "of another type")}
    with gpu.stage("scale") as encoder, pytest.raises(ShaderError, match="'of another type' has rows of"):
        scale.dispatch(encoder, [100, 1, 1], **values)


def test_structs_agree_with_their_numpy_types(gpu: Any) -> None:
    lights = np.zeros(5, GRID_LIGHT)
    lights["flux"][:, 0] = np.arange(5)
    lights["vertex_z_oriented"] = np.arange(5) | 1 << 16
    lights["moment_yz"] = 0.5
    info = np.zeros(1, HIERARCHY_INFO)
    info["top"], info["offset"][0, 2], info["cell_size"][0, 1] = 1, 5, 7
    result = gpu.pool.take(5, "4f4", "result")
    values = {"lights": gpu.pool.upload(lights, "lights"), "info": gpu.pool.upload(info, "info"), "result": result}
    program = ComputeProgram(gpu.device, MODULE, "sum_lights", {})
    with gpu.stage("sum") as encoder:
        program.dispatch(encoder, [5, 1, 1], **values)
    np.testing.assert_array_equal(result.numpy(), [[i, 1000 + i, 0.5, 7] for i in range(5)])
    inputs = np.zeros(2, INPUT_LIGHT)
    inputs["flux"][1, 2], inputs["normal"][1, 1] = 3, 4
    single = gpu.pool.take(1, "f4", "result")
    with gpu.stage("read") as encoder:
        program = ComputeProgram(gpu.device, MODULE, "read_inputs", {})
        program.dispatch(encoder, [1, 1, 1], lights=gpu.pool.upload(inputs, "inputs"), result=single)
    assert single.numpy() == [7]


@pytest.mark.parametrize("planted", ["name", "order", "size"])
def test_a_struct_that_differs_is_an_error(gpu: Any, planted: str) -> None:
    fields = [(name, INPUT_LIGHT.fields[name][0]) for name in INPUT_LIGHT.names]  # type: ignore[index,union-attr]
    wrong = {
        "name": [("place", fields[0][1]), *fields[1:]],
        "order": [*fields[2:4], *fields[:2], *fields[4:]],
        "size": [*fields, ("more", np.dtype("f4"))],
    }[planted]
    values = {"lights": gpu.pool.take(2, np.dtype(wrong), "planted"), "result": gpu.pool.take(1, "f4", "result")}
    program = ComputeProgram(gpu.device, MODULE, "read_inputs", {})
    with gpu.stage("read") as encoder, pytest.raises(ShaderError, match="'planted' has rows of"):
        program.dispatch(encoder, [1, 1, 1], **values)


def test_settings_come_as_their_struct(gpu: Any) -> None:
    params = Params(vpls=2**31, alpha=1.5, filter="atrous_plane", omega_max="none", frame=2**32 - 1)
    program, result = ComputeProgram(gpu.device, MODULE, "read_params", {}), gpu.pool.take(6, "f4", "result")
    values = params_uniform(params)
    with gpu.stage("read") as encoder:
        program.dispatch(encoder, [1, 1, 1], params=values, result=result)
        with pytest.raises(ShaderError, match="alpha"):
            program.dispatch(encoder, [1, 1, 1], params={k: values[k] for k in values if k != "alpha"}, result=result)
        with pytest.raises(ShaderError, match="beta"):
            program.dispatch(encoder, [1, 1, 1], params=values | {"beta": 1}, result=result)
    np.testing.assert_array_equal(result.numpy(), np.array([2**31, 1.5, 1, 1, np.inf, 2**32], np.float32))


def test_the_struct_of_settings_is_as_in_python(gpu: Any) -> None:
    """What the compiler makes of it, not only how it is written."""
    module = gpu.device.load_module(MODULE)
    layout = module.layout.get_type_layout(module.layout.find_type_by_name("Params"))
    kind = dtype_of(layout)
    names = list(Params().to_core())
    assert list(kind.names or ()) == names
    types = {bool: "u4", float: "f4", str: "i4"}
    for name, value in Params().to_core().items():
        whole = {"vpls": "i8", "seed": "u4", "frame": "u4"}.get(name, "i4")
        assert kind[name] == np.dtype(types.get(type(value), whole)), name


def test_constants_are_compiled_in(gpu: Any) -> None:
    values = floats(gpu)
    with gpu.stage("scale") as encoder:
        ComputeProgram(gpu.device, MODULE, "scale", {"factor": 10}).dispatch(encoder, [100, 1, 1], **values)
    np.testing.assert_array_equal(values["result"].numpy(), 20 * np.arange(100))
    with pytest.raises(ShaderError, match="no 'extern static const' 'faktor'; did you mean 'factor'"):
        ComputeProgram(gpu.device, MODULE, "scale", {"faktor": 10})


def test_what_does_not_exist_or_compile_says_so(gpu: Any, tmp_path: Path) -> None:
    with pytest.raises(ShaderError, match="no entry point 'skale'; did you mean 'scale'"):
        ComputeProgram(gpu.device, MODULE, "skale", {})
    broken = tmp_path / "broken.slang"
    broken.write_text('[shader("compute")] [numthreads(1,1,1)] void run() { nonsense(); }\n')
    with pytest.raises(ShaderError, match="nonsense"):
        ComputeProgram(gpu.device, str(broken.with_suffix("")), "run", {})


def test_a_dispatch_may_be_sized_by_the_device(gpu: Any, scale: ComputeProgram) -> None:
    values, groups = floats(gpu, 1000), gpu.pool.upload(np.zeros((2, 4), np.uint32), "groups")
    sizing = ComputeProgram(gpu.device, MODULE, "set_groups", {})
    with gpu.stage("scale") as encoder:
        sizing.dispatch(encoder, [1, 1, 1], groups=groups, count=500)
        scale.dispatch_indirect(encoder, groups, 0, **(values | {"by": 7.0}))  # no groups at all
        scale.dispatch(encoder, [1000, 1, 1], **values)
        scale.dispatch_indirect(encoder, groups, 1, **(values | {"by": 3.0}))
    got = values["result"].numpy()
    np.testing.assert_array_equal(got[:500], 3 * np.arange(500))
    np.testing.assert_array_equal(got[512:], 2 * np.arange(512, 1000))


def test_buffers_go_back_to_the_pool(gpu: Any) -> None:
    gc.collect()
    before = gpu.pool.in_use
    first = gpu.pool.take(1000, "4f4", "first")
    raw = first.raw
    assert gpu.pool.in_use == before + raw.size
    del first
    assert gpu.pool.in_use == before
    again = gpu.pool.take(999, "4f4", "again")
    assert again.raw is raw
    with pytest.raises(ValueError, match="again: holds 999 rows"):
        again.upload(np.zeros((999, 3), np.float32))
    with pytest.raises(ValueError, match="1000 rows asked for"):
        again.numpy(1000)
    assert gpu.pool.take(0, "f4", "empty").numpy().shape == (0,)


def test_stages_are_timed_by_the_device(gpu: Any, scale: ComputeProgram) -> None:
    for _ in range(300):  # more than there are spans
        with gpu.stage("scale") as encoder:
            scale.dispatch(encoder, [100, 1, 1], **floats(gpu))
    assert 0 < gpu.stages_ms()["scale"] < 1e4


def test_rays_hit_what_is_there(gpu: Any) -> None:
    import slangpy as spy

    device = gpu.device
    corners = gpu.pool.upload(np.array([[0, 0, 0], [4, 0, 0], [0, 4, 0]], np.float32), "corners")
    order = gpu.pool.upload(np.arange(3, dtype=np.uint32), "order")
    triangles = spy.AccelerationStructureBuildInputTriangles(
        {
            "vertex_buffers": [spy.BufferOffsetPair(corners.raw, 0)],
            "vertex_format": spy.Format.rgb32_float,
            "vertex_count": 3,
            "vertex_stride": 12,
            "index_buffer": spy.BufferOffsetPair(order.raw, 0),
            "index_format": spy.IndexFormat.uint32,
            "index_count": 3,
            "flags": spy.AccelerationStructureGeometryFlags.opaque,
        }
    )
    blas = build(device, spy.AccelerationStructureBuildDesc({"inputs": [triangles]}))
    instances = device.create_acceleration_structure_instance_list(1)
    instances.write(
        0,
        {
            "transform": spy.float3x4.identity(),
            "instance_id": 0,
            "instance_mask": 0xFF,
            "instance_contribution_to_hit_group_index": 0,
            "flags": spy.AccelerationStructureInstanceFlags.none,
            "acceleration_structure": blas.handle,
        },
    )
    inputs = instances.build_input_instances()
    tlas = build(device, spy.AccelerationStructureBuildDesc({"inputs": [inputs]}))
    shaders = RayShaders("shoot", ("miss",), (("surface", "closest", ""),))
    program = RayProgram(device, str(HERE / "vulkan_rays"), shaders, {})
    hit = gpu.pool.take(6, "f4", "hit")
    with gpu.stage("rays") as encoder:
        program.dispatch(encoder, [6, 1, 1], scene=tlas, hit=hit)
    np.testing.assert_allclose(hit.numpy(), [1, 1, 1, 1, -1, -1])
    with gpu.stage("rays") as encoder, pytest.raises(ShaderError, match="nothing was given for scene"):
        program.dispatch(encoder, [6, 1, 1], hit=hit)


def build(device: Any, description: Any) -> Any:
    import slangpy as spy

    sizes = device.get_acceleration_structure_sizes(description)
    scratch = device.create_buffer(size=sizes.scratch_size, usage=spy.BufferUsage.unordered_access)
    made = device.create_acceleration_structure(size=sizes.acceleration_structure_size)
    encoder = device.create_command_encoder()
    encoder.build_acceleration_structure(description, made, None, spy.BufferOffsetPair(scratch, 0))
    device.submit_command_buffer(encoder.finish())
    device.wait()
    return made


def test_what_stays_the_same_is_still_bound(gpu: Any, scale: ComputeProgram) -> None:
    """Values are only written where they change: one that comes back must be written again."""
    values = floats(gpu)
    other = gpu.pool.upload(np.full(100, 7, np.float32), "other")
    results = []
    for source, by in ((values["source"], 2.0), (other, 2.0), (other, 3), (values["source"], 3.0), (other, True)):
        with gpu.stage("scale") as encoder:
            scale.dispatch(encoder, [100, 1, 1], **(values | {"source": source, "by": by}))
        results.append(float(values["result"].numpy()[5]))
    assert results == [10, 14, 21, 15, 7]
    again = gpu.pool.take(100, "i4", "of another type")
    with gpu.stage("scale") as encoder:
        with pytest.raises(ShaderError, match="of another type"):
            scale.dispatch(encoder, [100, 1, 1], **(values | {"source": again}))
        scale.dispatch(encoder, [100, 1, 1], **(values | {"source": other}))
    assert values["result"].numpy()[5] == 14
