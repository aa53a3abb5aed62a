"""The tree that rays are traced in: the device's acceleration structures over the scene's triangles."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from lab.engine.vulkan.adapters import import_slangpy
from lab.engine.vulkan.buffers import DeviceBuffer

if TYPE_CHECKING:
    import slangpy as spy

    from lab.engine.vulkan.device import Gpu


class Tree:
    """A bottom level over all triangles, and a top level with it alone.

    Its first geometry has the triangles without holes, which no shader is asked about; its second has the others. One
    that would be empty is left out.

    Attributes:
        top: what shaders take as ``RaytracingAccelerationStructure``.

    """

    def __init__(self, gpu: Gpu, position: NDArray[np.float32], corners: list[tuple[NDArray[np.uint32], bool]]) -> None:
        """Builds it; `position`: (v, 3) of vertices; `corners`: (t, 3) of each geometry, and whether it has holes."""
        spy = import_slangpy()
        lent: list[DeviceBuffer] = []  # the build reads them
        geometries = [_geometry(gpu, position, *part, lent) for part in corners]
        self._bottom = _build(gpu.device, geometries)
        instances = gpu.device.create_acceleration_structure_instance_list(1)
        instances.write(
            0,
            {
                "transform": spy.float3x4.identity(),
                "instance_id": 0,
                "instance_mask": 0xFF,
                "instance_contribution_to_hit_group_index": 0,
                "flags": spy.AccelerationStructureInstanceFlags.none,
                "acceleration_structure": self._bottom.handle,
            },
        )
        self.top = _build(gpu.device, [instances.build_input_instances()])


def _geometry(
    gpu: Gpu, position: NDArray[np.float32], corner: NDArray[np.uint32], holes: bool, lent: list[DeviceBuffer]
) -> Any:
    spy = import_slangpy()
    # Its own vertices alone: slangpy 0.43.1 takes the larger of the numbers of vertices and of indices for three times
    # the number of triangles, and would read beyond the indices.
    used, index = np.unique(corner, return_inverse=True)
    points = gpu.pool.upload(np.ascontiguousarray(position[used]), "corner points")
    order = gpu.pool.upload(index.reshape(-1).astype(np.uint32), "corners")
    lent += [points, order]
    flags = spy.AccelerationStructureGeometryFlags
    return spy.AccelerationStructureBuildInputTriangles(
        {
            "vertex_buffers": [spy.BufferOffsetPair(points.raw, 0)],
            "vertex_format": spy.Format.rgb32_float,
            "vertex_count": len(points),
            "vertex_stride": points.dtype.itemsize,
            "index_buffer": spy.BufferOffsetPair(order.raw, 0),
            "index_format": spy.IndexFormat.uint32,
            "index_count": len(order),
            "flags": flags.none if holes else flags.opaque,
        }
    )


def _build(device: spy.Device, inputs: list[Any]) -> spy.AccelerationStructure:
    spy = import_slangpy()
    description = spy.AccelerationStructureBuildDesc(
        {"inputs": inputs, "flags": spy.AccelerationStructureBuildFlags.prefer_fast_trace}
    )
    sizes = device.get_acceleration_structure_sizes(description)
    scratch = device.create_buffer(size=sizes.scratch_size, usage=spy.BufferUsage.unordered_access)
    made = device.create_acceleration_structure(size=sizes.acceleration_structure_size)
    encoder = device.create_command_encoder()
    encoder.build_acceleration_structure(description, made, None, spy.BufferOffsetPair(scratch, 0))
    device.submit_command_buffer(encoder.finish())
    device.wait()  # for what was only lent to the build
    return made
