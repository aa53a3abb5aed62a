"""The pure functions in Slang: the same as C++ and as float64 numpy, on the same inputs."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lab import _core
from lab.engine.vulkan.program import ComputeProgram

from ..oracle import cases, pure

MODULE = str(Path(__file__).with_name("pure_functions"))


def run(
    gpu: Any,
    entry: str,
    results: dict[str, str],
    count: int,
    constants: dict[str, int] | None = None,
    /,
    **inputs: Any,
) -> list[np.ndarray]:
    """Runs an entry point of pure_functions.slang over `count` threads; arrays are uploaded as they are."""
    program = ComputeProgram(gpu.device, MODULE, entry, constants or {})
    out = {name: gpu.pool.take(count, kind, name) for name, kind in results.items()}
    bound = {n: gpu.pool.upload(v, n) if isinstance(v, np.ndarray) else v for n, v in inputs.items()}
    with gpu.stage(entry) as encoder:
        program.dispatch(encoder, [count, 1, 1], count=count, **out, **bound)
    return [buffer.numpy() for buffer in out.values()]


def four(vectors: np.ndarray) -> np.ndarray:
    return np.concatenate([vectors, np.zeros((len(vectors), 1))], axis=1).astype(np.float32)


@dataclass
class Case:
    """One function on one set of inputs.

    entry, result, inputs: of the shader. cpp, oracle: what C++ and float64 numpy make of the same. close: to the
    oracle; near: to C++ (0: bit for bit).
    """

    entry: str
    result: str
    inputs: dict[str, Any]
    cpp: Any
    oracle: Any
    close: float = 0
    near: float = 0
    count: int = 0

    def threads(self) -> int:
        arrays = [value for value in self.inputs.values() if isinstance(value, np.ndarray)]
        return self.count or len(arrays[0])


def random_cases() -> dict[str, Case]:
    rng = np.random.default_rng(0)
    edges = [[0, 0, 0, 0], [1, 0, 0, 0], [0, 0, 0, 1], [2**32 - 1] * 4, [2**31, 1, 2**16, 2**32 - 1]]
    keys = np.concatenate([np.array(edges, np.uint32), rng.integers(0, 2**32, (500, 4), np.uint32)])
    cases_of = {"pcg4d": Case("run_pcg4d", "4u4", {"key": keys}, _core.pcg4d(keys), pure.pcg4d(keys))}
    for n in (2, 4, 8):
        tiles = _core.dealt_tile(1000, 3, n)
        cases_of[f"dealt_tile_{n}"] = Case("run_dealt_tile", "i4", {"level": 3, "n": n}, tiles, tiles, count=1000)
    return cases_of


def blending_cases() -> dict[str, Case]:
    found = {}
    for radius in (1e-4, 1.0, 1e5):
        for first, top in ((False, False), (True, False), (False, True), (True, True)):
            distance = (radius * np.linspace(0, 3, 601)).astype(np.float32)
            found[f"blend_{radius:g}_{first}_{top}"] = Case(
                "run_blend_weight",
                "f4",
                {"distance": distance, "blend_radius": radius, "first": first, "top": top},
                _core.blend_weight(distance, radius, first, top),
                pure.blend_weight(distance, np.float32(radius), first, top),
                close=1e-6,
                near=1e-6,
            )
    return found


def lobe_cases() -> dict[str, Case]:
    directions = pure.sphere_directions(1000).astype(np.float32)
    found = {}
    for number, kind in enumerate(("moments", "mean_energy", "mean")):
        for count in (1, 2, 20):
            rng = np.random.default_rng(count)
            n, share = cases.unit_vectors(rng, count), rng.uniform(0.1, 1, count)
            share = share / share.sum()
            normal = (share @ n).astype(np.float32)
            moment = np.einsum("k,ki,kj->ij", share, n, n)[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]].astype(np.float32)
            for oriented in (True, False):
                found[f"{kind}_{count}_{oriented}"] = Case(
                    "run_emission",
                    "f4",
                    {
                        "direction": four(directions),
                        "kind": number,
                        "normal": normal,
                        "moment_diagonal": moment[:3],
                        "moment_mixed": moment[3:],
                        "oriented": oriented,
                    },
                    _core.emission(directions, kind, normal, moment, oriented),
                    pure.emission(directions, kind, normal, moment, oriented),
                    # Where little is emitted, the root of the second moment has but half of float32's digits.
                    close=2e-4,
                    near=2e-4,
                )
    return found


def picking_cases() -> dict[str, Case]:
    rng = np.random.default_rng(1)
    bits = np.concatenate([[0, 1, 511, 512, 2**31, 2**32 - 1], rng.integers(0, 2**32, 2000)]).astype(np.uint32)
    f = np.full(len(bits), 0.37, np.float32)
    u = (np.floor(bits / 512.0) + 0.5) / 2**23
    found = {
        "race_key": Case(
            "run_race_key", "f4", {"bits": bits, "weight": f}, _core.race_key(bits, f), -np.log(u) / f,
            close=2e-5, near=2e-6,
        )
    }  # fmt: skip
    uniform = np.concatenate([rng.random(4000), [0, 0.5, 1e-6, 1 - 2.0**-24]]).astype(np.float32)
    drawn = _core.sample_raised_cosine(uniform)
    found["raised_cosine"] = Case("run_raised_cosine", "f4", {"uniforms": uniform}, drawn, drawn, close=1e-5, near=1e-5)
    colour = rng.random((500, 3)).astype(np.float32)
    # Bit for bit as luminance() in C++, which is this without contraction.
    part = np.array([0.2126, 0.7152, 0.0722], np.float32) * colour
    exact = (part[:, 0] + part[:, 1]) + part[:, 2]
    found["luminance"] = Case(
        "run_luminance", "f4", {"colour": four(colour)}, exact, pure.luminance(colour), close=1e-6
    )
    return found


def path_cases() -> dict[str, Case]:
    """What decides where light paths go: bit for bit, or they part after a few bounces."""
    rng = np.random.default_rng(2)
    turns = np.concatenate([rng.random(3000), np.arange(8) / 8, [1 - 2.0**-24]]).astype(np.float32)
    angle = 2 * np.pi * turns.astype(np.float64)
    n, (u, v) = cases.unit_vectors(rng, 2000).astype(np.float32), rng.random((2, 2000)).astype(np.float32)
    directions = _core.sample_cosine(n, u, v)
    origin, a, b, c = rng.normal(0, 1, (4, 2000, 3)).astype(np.float32)
    place = rng.dirichlet((1, 1, 1), 2000).astype(np.float32)
    at = sum(w[:, None] * corner for w, corner in zip(place.T, (a, b, c), strict=True))
    ray = cases.unit_vectors(rng, 2000).astype(np.float32) * 1e-3 + (at - origin)
    exact = [x.astype(np.float64) for x in (origin, ray, a, b, c)]
    uv = np.linalg.solve(
        np.stack([exact[3] - exact[2], exact[4] - exact[2], -exact[1]], -1), (exact[0] - exact[2])[..., None]
    )[..., 0]
    found = _core.barycentrics(origin, ray, a, b, c)
    rays = {"origin": four(origin), "direction": four(ray), "a": four(a), "b": four(b), "c": four(c)}
    return {
        "turn": Case(
            "run_turn", "2f4", {"turns": turns}, _core.turn(turns), np.stack([np.cos(angle), np.sin(angle)], 1),
            close=3e-7,
        ),
        "sample_cosine": Case(
            "run_sample_cosine", "4f4", {"normal": four(n), "uniforms": np.stack([u, v], 1)}, four(directions),
            four(cosine_directions(n.astype(np.float64), u.astype(np.float64), v.astype(np.float64))), close=2e-6,
        ),
        "barycentrics": Case("run_barycentrics", "2f4", rays, found, uv[:, :2], close=2e-3),
    }  # fmt: skip


def cosine_directions(n: Any, u: Any, v: Any) -> Any:
    """Malley: a disc's uniform point raised to the sphere, in the frame of Duff et al. around (m, 3) normals."""
    sign = np.copysign(1, n[:, 2])
    a = -1 / (sign + n[:, 2])
    b = n[:, 0] * n[:, 1] * a
    s = np.stack([1 + sign * n[:, 0] ** 2 * a, sign * b, -sign * n[:, 0]], 1)
    t = np.stack([b, sign + n[:, 1] ** 2 * a, -n[:, 1]], 1)
    r, phi = np.sqrt(u), 2 * np.pi * v
    return (r * np.cos(phi))[:, None] * s + (r * np.sin(phi))[:, None] * t + np.sqrt(1 - u)[:, None] * n


CASES = path_cases() | random_cases() | blending_cases() | lobe_cases() | picking_cases()


@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_slang_is_cpp_is_numpy(gpu: Any, case: Case) -> None:
    inputs = {
        name: value.tolist() if isinstance(value, np.ndarray) and len(value) == 3 and value.ndim == 1 else value
        for name, value in case.inputs.items()
    }
    (got,) = run(gpu, case.entry, {"result": case.result}, case.threads(), **inputs)
    np.testing.assert_allclose(got.astype(np.float64), np.asarray(case.cpp, np.float64), rtol=case.near, atol=case.near)
    np.testing.assert_allclose(got.astype(np.float64), case.oracle, rtol=case.close, atol=case.close)


def test_last_record_is_its_definition(gpu: Any) -> None:
    rng = np.random.default_rng(3)
    sums = np.concatenate([np.geomspace(1e-37, 3e38, 400), 2.0 ** np.arange(-126, 128, 7), [0]]).astype(np.float32)
    seeds = rng.integers(0, 2**32, len(sums), np.uint32)
    (got,) = run(gpu, "run_last_record", {"result": "2f4"}, len(sums), below=sums, seed=seeds)
    np.testing.assert_array_equal(got, np.column_stack(_core.last_record(sums, seeds)))


@pytest.mark.parametrize("first_sample", [0, 4, 6])
def test_lights_that_stream_by_are_picked_by_the_last_record(gpu: Any, first_sample: int) -> None:
    """As the core picks from whole batches."""
    for weights in ([0.01, 5, 0.3, 0, 2, 2, 0, 0.7], range(30), [1e-30, 0, 3], [0, 0, 0, 0]):
        weight, pixels = np.array(weights, np.float32), 700
        (got,) = run(
            gpu, "run_picks", {"result": "4i4"}, pixels, {"samples": 4},
            weight=weight, lights=len(weight), first_sample=first_sample, key=77,
        )  # fmt: skip
        for s in range(4):
            sample = first_sample + s
            keys = [(pixel, sample // 4, 3, 77) for pixel in range(pixels)]  # 3: Stream::pick
            seeds = pure.pcg4d(np.array(keys, np.uint32))[:, sample % 4]
            assert np.mean(got[:, s] != pure.reservoir_picks(weight, seeds)) < 2e-3  # but where rounding decides


def test_numbers_of_a_frame_are_the_hash_of_their_names(gpu: Any) -> None:
    keys = np.random.default_rng(4).integers(0, 2**32, (300, 4), np.uint32)
    (got,) = run(gpu, "run_random4", {"result": "4f4"}, len(keys), key=keys)
    seeds = np.column_stack([keys[:, 2:], np.full((300, 2), [0x9E3779B9, 0x85EBCA6B], np.uint32)]).astype(np.uint32)
    race = np.full(300, 4, np.uint32)
    named = np.column_stack([keys[:, :2], race, pure.pcg4d(seeds)[:, 0]])
    np.testing.assert_array_equal(got, (pure.pcg4d(named) >> 8).astype(np.float32) / np.float32(2**24))


def test_the_sequence_is_the_published_one(gpu: Any) -> None:
    """RXS-M-XS, in Python's own integers."""
    seeds = np.random.default_rng(5).integers(0, 2**32, 200, np.uint32)
    (got,) = run(gpu, "run_pcg", {"result": "2u4"}, len(seeds), seed=seeds)

    for seed, pair in zip(seeds.tolist(), got.tolist(), strict=True):
        assert pair == list(islice(pure.pcg(seed), 2))


@pytest.mark.parametrize("clamp", [0.0, 0.3])
def test_falloff_is_its_definition(gpu: Any, clamp: float) -> None:
    d2 = np.concatenate([np.geomspace(1e-6, 1e6, 300), [clamp**2]]).astype(np.float32)
    (got,) = run(gpu, "run_falloff", {"result": "2f4"}, len(d2), d2=d2, c2=clamp**2)
    exact = d2.astype(np.float64)
    kept = exact > 0
    for column, kind in enumerate(("clamped", "softened")):
        np.testing.assert_allclose(got[kept, column], pure.falloff(exact[kept], kind, clamp), rtol=1e-6)
    assert np.isfinite(got).all()


@pytest.mark.parametrize("axis", [(0, 0, 1), (0, 0, -1), (0.6, 0, 0.8), (-0.48, 0.6, -0.64)])
def test_directions_have_their_densities(gpu: Any, axis: tuple[float, float, float]) -> None:
    """Moments of the drawn directions and points, over an even lattice of uniform numbers."""
    side = (np.arange(64) + 0.5) / 64
    uniforms = np.stack(np.meshgrid(side, side), axis=-1).reshape(-1, 2).astype(np.float32)
    cosine, cone, triangle = run(
        gpu, "run_sampling", {"cosine": "4f4", "cone": "4f4", "triangle": "2f4"}, len(uniforms),
        uniforms=uniforms, axis=axis, spread=0.5,
    )  # fmt: skip
    for drawn, mean in ((cosine, 2 / 3), (cone, 0.75)):
        vectors = drawn[:, :3].astype(np.float64)
        np.testing.assert_allclose(np.linalg.norm(vectors, axis=1), 1, atol=1e-5)
        np.testing.assert_allclose(vectors.mean(axis=0), mean * np.array(axis), atol=2e-3)
        assert (vectors @ np.array(axis)).min() > -1e-5
    assert triangle.min() >= 0 and triangle.sum(axis=1).max() <= 1 + 1e-6
    np.testing.assert_allclose(triangle.mean(axis=0), 1 / 3, atol=2e-3)
