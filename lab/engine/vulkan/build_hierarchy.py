"""Stage build_hierarchy on the device (LY19 3.1): recorded at once, with nothing read back in between."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from typing import TYPE_CHECKING, Any

from lab.engine.vulkan.hierarchy import HierarchyParts, device_hierarchy
from lab.engine.vulkan.hierarchy_sizes import COLUMNS, MOST_GROUPS, Sizes, hierarchy_sizes
from lab.engine.vulkan.layouts import BUILD_STATE, GRID_LIGHT, HIERARCHY_INFO
from lab.engine.vulkan.lights import lights_parts
from lab.engine.vulkan.members import MemberParts
from lab.engine.vulkan.sort import sort_keys
from lab.params import Params
from lab.records import Hierarchy, Lights

if TYPE_CHECKING:
    import slangpy as spy

    from lab.engine.vulkan.device import Gpu
    from lab.engine.vulkan.timing import Span

# Rows of the buffer of group counts: enum Groups in shaders/lib/build_state.slang.
WORDS, VERTICES, SUMS, CORNERS = 0, 16, 32, 48
CLEAR, MARK, CLEAR_COARSE, SCAN_S1, SCAN_COARSE = 64, 65, 66, 67, 68
_GROUP_ROWS = 69
_SCAN_BLOCK = 1024

_FEW_MEMBERS = 64  # that one thread lists: build_hierarchy_few_members.slang
_LIST_GROUPS = 4096  # the most that make one list after another

Part = Callable[[str], AbstractContextManager[object]]


def build_hierarchy(gpu: Gpu, lights: Lights, params: Params) -> Hierarchy:
    """All levels, compacted and merged; with member lists where shadow points are drawn from them.

    Errors: :class:`lab.errors.LabError` for more lights or levels than the device takes.
    """
    made = HierarchyBuild(gpu, lights, params)
    with gpu.stage("build_hierarchy") as encoder:
        made.record(encoder)
    return device_hierarchy(made.parts)


def construction_ms(gpu: Gpu, lights: Lights, params: Params) -> dict[str, float]:
    """What the device takes for each part of a build: ``bounds``, ``S1``, ``merge``, ``S2``, ``S3`` ... and ``total``.

    And ``members``, where shadow points are drawn from them. The timestamps in between make it a little slower.
    """
    made = HierarchyBuild(gpu, lights, params)
    spans: dict[str, Span] = {}

    with gpu.stage("build_hierarchy") as encoder:

        @contextmanager
        def timed(name: str) -> Iterator[None]:
            spans[name] = gpu.clock.begin(encoder)
            yield
            gpu.clock.end(encoder, spans[name])

        made.record(encoder, timed)
    whole = gpu.spans["build_hierarchy"]
    for span in spans.values():
        span.submission = whole.submission
    top = int(made.parts.on_host["top"])
    there = {name: span.ms for name, span in spans.items() if not name[1:].isdigit() or int(name[1:]) <= top}
    return there | {"total": whole.ms}


class HierarchyBuild:
    """The buffers of one build, by the names that the shaders have for them.

    Attributes:
        parts: what it makes.    sums: fixed-point sums of the level that was last summed, ``COLUMNS`` a vertex.
        sizes: of the buffers.

    """

    def __init__(self, gpu: Gpu, lights: Lights, params: Params, *, most_groups: int = MOST_GROUPS) -> None:
        """Takes memory for it. `most_groups`: of threads, in the dispatches that may need many."""
        self._gpu, self._params, self._most_groups = gpu, params, most_groups
        source = lights_parts(gpu, lights).lights
        sizes: Sizes = hierarchy_sizes(len(source), params)
        self.sizes = sizes
        pool = gpu.pool
        self.parts = HierarchyParts(
            pool.take(1, HIERARCHY_INFO, "hierarchy info"),
            pool.take(sizes.capacity, GRID_LIGHT, "grid lights"),
            pool.take(sizes.inputs, "u4", "input index"),
            sizes.last_candidate + 1,
            MemberParts(
                pool.take(sizes.rows_of(1), "2u4", "member lists"), pool.take(sizes.slots, "3u4", "member slots")
            )
            if sizes.slots
            else None,
        )
        self.sums = pool.take(sizes.sum_rows * COLUMNS, "i8", "vertex sums")
        self._source = source
        self._groups = pool.take(_GROUP_ROWS, "4u4", "group counts")
        self._values: dict[str, Any] = {
            "state": pool.take(1, BUILD_STATE, "build state"),
            "info": self.parts.info,
            "groups": self._groups,
            "bits": pool.take(2 * sizes.half, "u4", "vertex bits"),
            "rank": pool.take(sizes.half, "u4", "vertex ranks"),
            "block_sums": pool.take(-(-sizes.half // _SCAN_BLOCK), "u4", "block sums"),
            "sums": self.sums,
            "coarse_sums": pool.take(sizes.rows_of(2) * COLUMNS, "f8", "coarse sums"),
            "s1_weight": pool.take(sizes.sum_rows, "f4", "weights of S1"),
            "input_index": self.parts.input_index,
            "inputs": source,
            "half": sizes.half,
            "count": sizes.inputs,
            "most": sizes.most,
            "capacity": sizes.capacity,
            "sum_rows": sizes.sum_rows,
            "first_candidate": sizes.first_candidate,
            "last_candidate": sizes.last_candidate,
            "bounds_scale": params.bounds_scale,
            "carry_moments": params.carry_moments,
            "half_open": params.construction == "gather" and params.gather_range == "half_open",
            "by_luminance": params.centre_weight == "flux",
        }

    def record(self, encoder: spy.CommandEncoder, part: Part = nullcontext) -> None:
        """The whole stage; `part` is entered around each part of it, with its name."""
        self.record_s1(encoder, part)
        with part("merge"):
            self._mark_coarse_levels()
            self._scan(coarse=True)
            self._list_vertices(CLEAR_COARSE, coarse=True)
        gather = self._params.construction == "gather"
        from_finer = gather and not self._values["half_open"]
        for level in range(2, self.sizes.last_candidate + 1):
            with part(f"S{level}"):
                if from_finer and level > 2:
                    self._run("sums", "coarsen", VERTICES + level, level=level, lights=self.parts.lights)
                else:
                    self._sum_level(level, source=1 if gather else 0)
        if self.parts.members:
            with part("members"):
                self._list_members(self.parts.members)

    def record_s1(self, encoder: spy.CommandEncoder, part: Part = nullcontext) -> None:
        """As far as S1, whose fixed-point sums are then in `sums`."""
        self._encoder = encoder
        with part("bounds"):
            self._encoder.clear_buffer(self._groups.raw)
            self._choose_levels()
        with part("S1"):
            self._sort_inputs()
            self._scan(coarse=False)
            self._list_vertices(WORDS + 1, coarse=False)
            self._sum_level(1, source=0)

    def _choose_levels(self) -> None:
        inputs = [self.sizes.inputs, 1, 1]
        self._run("levels", "begin", [1, 1, 1])
        self._run("levels", "find_bounds", inputs, lights=self._source)
        self._run("levels", "place_grid", [1, 1, 1])
        for _ in range(self.sizes.first_candidate, self.sizes.last_candidate + 1):
            self._run("levels", "clear_bits", CLEAR)
            self._run("levels", "mark_s1", MARK, lights=self._source)
            self._run("levels", "judge", [1, 1, 1])
        self._run("levels", "settle", [1, 1, 1])

    def _sort_inputs(self) -> None:
        inputs = [self.sizes.inputs, 1, 1]
        keys = self._gpu.pool.take(self.sizes.inputs, "2u4", "cell keys")
        self._run("sort", "cell_keys", inputs, lights=self._source, keys=keys)
        keys = sort_keys(self._gpu, self._encoder, keys, self.sizes.key_bits)
        self._run("sort", "write_inputs", inputs, lights=self.parts.lights, keys=keys)
        self._values["keys"] = keys

    def _scan(self, *, coarse: bool) -> None:
        groups = SCAN_COARSE if coarse else SCAN_S1
        self._run("scan", "sum_blocks", groups, coarse=coarse)
        self._run("scan", "scan_blocks", [256, 1, 1], coarse=coarse)
        self._run("scan", "write_ranks", groups, coarse=coarse)
        self._run("scan", "set_offsets", [1, 1, 1], coarse=coarse)

    def _list_vertices(self, words: int, *, coarse: bool) -> None:
        self._run("vertices", "list_vertices", words, coarse=coarse, lights=self.parts.lights)

    def _mark_coarse_levels(self) -> None:
        self._run("vertices", "clear_coarse", CLEAR_COARSE)
        gather, half_open = self._params.construction == "gather", self._values["half_open"]
        for level in range(2, self.sizes.last_candidate + 1):
            if not gather:
                threads = [self.sizes.inputs, 1, 1]
                self._run("vertices", "mark_from_s0", threads, level=level, lights=self.parts.lights)
            elif level == 2 or half_open:
                self._run("vertices", "mark_from_s1", VERTICES + 1, level=level, lights=self.parts.lights)
            else:
                self._run("vertices", "mark_coarser", WORDS + level - 1, level=level)

    def _sum_level(self, level: int, source: int) -> None:
        """Sums over the lights of level `source`, and the grid lights that they make."""
        corners: int | Sequence[int] = (
            CORNERS + 1 if source else [min(8 * self.sizes.inputs, 256 * self._most_groups), 1, 1]
        )
        named: dict[str, Any] = {"level": level, "lights": self.parts.lights}
        self._run("sums", "clear_sums", SUMS + level, **named)
        self._run("sums", "add_lights", corners, **named, **{"from": source, "redo": False})
        self._run("sums", "find_unweighted", VERTICES + level, **named)
        self._run("sums", "add_lights", corners, **named, **{"from": source, "redo": True})
        self._run("sums", "finish_lights", VERTICES + level, **named, **{"from": source})

    def _list_members(self, members: MemberParts) -> None:
        """Alias tables of what every grid light is made of, each where there is room for it."""
        pool, sizes, known = self._gpu.pool, self.sizes, self._values
        taken = pool.take(2, "u4", "member slots taken")
        self._encoder.clear_buffer(taken.raw)
        long_lists = pool.take(8 * sizes.inputs // _FEW_MEMBERS + 1, "u4", "long member lists")
        levels = {name: known[name] for name in ("info", "bits", "rank", "keys", "half", "half_open")}
        levels |= {"lights": self.parts.lights, "gather": self._params.construction == "gather"}
        named: dict[str, Any] = {"lists": members.list, "slots": members.slot, "taken": taken, "levels": levels}
        self._run("few_members", "list_members", VERTICES + 1, **named, long_lists=long_lists)

        def run(entry: str, width: int, most: int, **more: Any) -> None:
            groups = min(most, _LIST_GROUPS)
            program = self._gpu.program("build_hierarchy_many_members", entry, {"width": width})
            program.dispatch(self._encoder, [width * groups, 1, 1], **named, **more, groups=groups)

        run("list_long", 64, len(long_lists), long_lists=long_lists)
        for first, last, width in ((5, sizes.last_candidate, 512), (2, 4, 64)):
            run("list_coarse", width, sizes.rows_of(first, last), first=first, last=last)

    def _run(self, module: str, entry: str, threads: int | Sequence[int], /, **named: Any) -> None:
        """Runs an entry point on what it asks for by name; `threads`: how many, or a row of the group counts."""
        constants = {} if self._most_groups == MOST_GROUPS else {"most_groups": self._most_groups}
        program = self._gpu.program(f"build_hierarchy_{module}", entry, constants)
        known = self._values | named
        values = {name: known[name] for name in program.names}
        if isinstance(threads, int):
            program.dispatch_indirect(self._encoder, self._groups, threads, **values)
        else:
            program.dispatch(self._encoder, threads, **values)
