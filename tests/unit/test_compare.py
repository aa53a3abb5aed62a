"""``lab compare``: the numbers it prints, the pictures it writes, the files it takes and those it refuses."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
import pytest
from PIL import Image

from lab.cli import main
from lab.image_io import write_exr
from lab.metrics import flip

from .command_line import files, refused

pytestmark = pytest.mark.usefixtures("empty_folder")

H, W = 10, 16


def write(name: str, layers: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Layers (H, W, 3) or (H, W) as our EXR has them; returns what a reader gets, in float64."""
    channels: dict[str, Any] = {}
    for layer, values in layers.items():
        if values.ndim == 2:
            channels[f"{layer}.Y"] = values if values.dtype == np.uint32 else values.astype(np.float32)
        else:
            for i, c in enumerate("XYZ" if layer == "normal" else "RGB"):
                channels[f"{layer}.{c}"] = np.ascontiguousarray(values[..., i], dtype=np.float32)
    write_exr(Path(name), channels, {})
    return {layer: values.astype(np.float32).astype(np.float64) for layer, values in layers.items()}


def write_plain(name: str, pixels: np.ndarray, **more: np.ndarray) -> None:
    """Channels R G B without a layer, as other programs write them, in the type of `pixels`."""
    channels = {c: np.ascontiguousarray(pixels[..., i]) for i, c in enumerate("RGB")} | more
    with OpenEXR.File({"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}, channels) as file:
        file.write(name)


def write_deep(name: str) -> None:
    """An EXR with many samples a pixel."""
    samples = np.empty((H, W), dtype=object)
    for i in np.ndindex(H, W):
        samples[i] = np.ones(2, np.float32)
    header = {"compression": OpenEXR.ZIPS_COMPRESSION, "type": OpenEXR.deepscanline}
    with OpenEXR.File(header, dict.fromkeys("RGB", samples)) as file:
        file.write(name)


def light(seed: int) -> np.ndarray:
    return np.exp(np.random.default_rng(seed).normal(size=(H, W, 3)))


@pytest.fixture
def pair() -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """a.exr and b.exr with the layers colour, indirect, depth, normal and overdraw."""
    rng = np.random.default_rng(9)
    made = []
    for name, seed in (("a.exr", 1), ("b.exr", 2)):
        layers = {
            "colour": light(2) * (light(1) ** 0.2 if seed == 1 else 1),
            "indirect": light(seed + 10),
            "depth": rng.random((H, W)),
            "normal": rng.normal(size=(H, W, 3)),
            "overdraw": rng.integers(0, 9, (H, W)).astype(np.uint32),
        }
        made.append(write(name, layers))
    return made[0], made[1]


def compared(*arguments: str, capsys: pytest.CaptureFixture[str]) -> dict[str, Any]:
    """Runs ``lab compare``; its output must be strict JSON and nothing else."""
    assert main(["compare", *arguments]) == 0
    said = capsys.readouterr()
    assert not said.err

    def never(word: str) -> None:
        pytest.fail(f"{word} is no JSON")

    record = json.loads(said.out, parse_constant=never)
    assert isinstance(record, dict)
    return record


def expected(a: np.ndarray, b: np.ndarray, floor: float) -> dict[str, float]:
    """The documented formulas, one value after the other."""
    both = list(zip(a.ravel().tolist(), b.ravel().tolist(), strict=True))
    squared = math.fsum((x - y) ** 2 for x, y in both) / len(both)
    return {
        "rel_mse": math.fsum((x - y) ** 2 / (y**2 + floor**2) for x, y in both) / len(both),
        "mse": squared,
        "rmse": math.sqrt(squared),
        "energy_ratio": math.fsum(x for x, _ in both) / math.fsum(y for _, y in both),
    }


def check(values: dict[str, Any], wanted: dict[str, float]) -> None:
    assert {name: values[name] for name in wanted} == {
        name: pytest.approx(value, rel=1e-9) for name, value in wanted.items()
    }


def test_it_prints_the_documented_numbers_of_colour(pair: Any, capsys: pytest.CaptureFixture[str]) -> None:
    a, b = pair[0]["colour"], pair[1]["colour"]
    record = compared("a.exr", "b.exr", capsys=capsys)
    assert record["layer"] == "colour" and record["size"] == [W, H]
    floor = 0.01 * math.fsum(b.ravel().tolist()) / b.size
    assert record["epsilon"] == pytest.approx(floor, rel=1e-12)
    check(record, expected(a, b, floor))
    assert record["flip"] == pytest.approx(flip(a, b)[0], rel=1e-9) and record["flip"] > 0.05
    assert record["flip_settings"]["pixels_per_degree"] == pytest.approx(67.02, abs=0.01)
    assert record["flip_settings"]["exposures"]["steps"] >= 2
    assert not record["notes"] and "files" not in record and files() == ["a.exr", "b.exr"]
    swapped = compared("b.exr", "a.exr", capsys=capsys)
    assert swapped["energy_ratio"] == pytest.approx(1 / record["energy_ratio"], rel=1e-9) != record["energy_ratio"]


@pytest.mark.parametrize("layer", ["indirect", "depth", "normal", "overdraw"])
def test_any_layer_counts(pair: Any, layer: str, capsys: pytest.CaptureFixture[str]) -> None:
    a, b = pair[0][layer], pair[1][layer]
    record = compared("a.exr", "b.exr", "--layer", layer, "-o", "out", "--per-channel", capsys=capsys)
    assert record["layer"] == layer
    wanted = expected(a, b, 0.01 * b.mean())
    if b.sum() <= 0:
        wanted.pop("energy_ratio")
    check(record, wanted)
    light_layer = layer == "indirect"
    assert (record["flip"] is not None) is light_layer
    assert ("flip has no value" in " ".join(record["notes"])) is not light_layer
    assert ("out/flip.png" in record["files"]) is light_layer
    assert record["channels"] == list({"indirect": "RGB", "normal": "XYZ"}.get(layer, "Y"))
    assert list(record.get("per_channel", "Y")) == record["channels"]


def test_regions_and_channels_add_up_to_the_whole(pair: Any, capsys: pytest.CaptureFixture[str]) -> None:
    a, b = pair[0]["colour"], pair[1]["colour"]
    regions = [(0, 0, 6, H), (6, 0, W - 6, 3), (6, 3, W - 6, H - 3)]
    flags = [flag for region in regions for flag in ("--region", ",".join(map(str, region)))]
    record = compared("a.exr", "b.exr", "--per-channel", *flags, capsys=capsys)
    assert [tuple(part["region"]) for part in record["regions"]] == regions
    error_map = flip(a, b)[1].astype(np.float64)
    for part, (x, y, w, h) in zip(record["regions"], regions, strict=True):
        where = np.s_[y : y + h, x : x + w]
        check(part, expected(a[where], b[where], record["epsilon"]))
        assert part["flip"] == pytest.approx(error_map[where].mean(), rel=1e-9)
        for i, c in enumerate("RGB"):
            check(part["per_channel"][c], expected(a[where][..., i], b[where][..., i], record["epsilon"]))
    sizes = [w * h for _, _, w, h in regions]
    for name in ("rel_mse", "mse", "flip"):
        whole = sum(part[name] * size for part, size in zip(record["regions"], sizes, strict=True)) / (W * H)
        assert whole == pytest.approx(record[name], rel=1e-9)
    assert np.mean([record["per_channel"][c]["rel_mse"] for c in "RGB"]) == pytest.approx(record["rel_mse"], rel=1e-9)
    assert "per_channel" not in compared("a.exr", "b.exr", capsys=capsys)


def test_the_noise_of_a_reference_is_told(capsys: pytest.CaptureFixture[str]) -> None:
    a, b, variance = light(1), light(2), 0.01 * light(3)
    write("a.exr", {"indirect": a, "indirect_variance": 2 * variance})
    made = write("b.exr", {"indirect": b, "indirect_variance": variance})
    record = compared("a.exr", "b.exr", "--layer", "indirect", capsys=capsys)
    b = made["indirect"]
    wanted = np.mean(made["indirect_variance"] / (b**2 + (0.01 * b.mean()) ** 2))
    assert record["rel_mse_noise"] == pytest.approx(wanted, rel=1e-6)
    assert record["rel_mse_noise_a"] == pytest.approx(2 * wanted, rel=1e-6)
    assert any("rel_mse_noise" in note for note in record["notes"])
    write("b.exr", {"indirect": b, "indirect_variance": np.full_like(b, np.inf)})
    assert "rel_mse_noise" not in compared("a.exr", "b.exr", "--layer", "indirect", capsys=capsys)


def test_pictures_and_json_are_written_whole(pair: Any, capsys: pytest.CaptureFixture[str]) -> None:
    record = compared("a.exr", "b.exr", "-o", "new/folder", capsys=capsys)
    names = ["comparison.json", "error.png", "flip.png", "side_by_side.png"]
    assert files(Path("new/folder")) == names and sorted(record["files"]) == [f"new/folder/{name}" for name in names]
    assert json.loads(Path("new/folder/comparison.json").read_text()) == record
    for name in names[1:]:
        with Image.open(f"new/folder/{name}") as picture:
            picture.load()
            assert picture.mode == "RGB" and picture.width > 500
            assert picture.text["a"] == "a.exr" and picture.text["b"] == "b.exr" and picture.text["layer"] == "colour"
    assert compared("a.exr", "b.exr", "-o", "new/folder", capsys=capsys) == record


@pytest.mark.parametrize("kind", [np.float16, np.float32])
def test_plain_rgb_of_other_programs(kind: type, pair: Any, capsys: pytest.CaptureFixture[str]) -> None:
    pixels = light(4).astype(kind)
    write_plain("plain.exr", pixels, A=np.ones((H, W), kind), Z=np.full((H, W), np.inf, np.float32))
    record = compared("plain.exr", "plain.exr", capsys=capsys)
    assert record["layer"] == "" and record["rel_mse"] == 0 and record["flip"] == 0
    assert record["notes"] == ["A and B are one file"]
    a, b = pair[0]["colour"], pixels.astype(np.float64)
    record = compared("a.exr", "plain.exr", "-o", "out", capsys=capsys)
    assert record["a"]["layer"] == "colour" and record["b"] == {"file": "plain.exr", "layer": ""}
    check(record, expected(a, b, 0.01 * b.mean()))
    assert compared("plain.exr", "plain.exr", "--layer", "", capsys=capsys)["layer"] == ""
    assert "'' (plain R G B)" in refused(["compare", "a.exr", "plain.exr", "--layer", "colour"], capsys)


def test_black_images_have_no_ratio(capsys: pytest.CaptureFixture[str]) -> None:
    write("a.exr", {"colour": light(1)})
    write("b.exr", {"colour": np.zeros((H, W, 3))})
    record = compared("a.exr", "b.exr", "-o", "out", capsys=capsys)
    assert record["rel_mse"] is None and record["energy_ratio"] is None
    assert record["mse"] > 0 and record["flip"] > 0.9
    assert any("B is black" in note for note in record["notes"])
    record = compared("b.exr", "b.exr", capsys=capsys)
    assert record["rel_mse"] == 0 and record["flip"] == 0 and record["energy_ratio"] is None
    record = compared("b.exr", "a.exr", capsys=capsys)
    assert record["energy_ratio"] == 0 and not record["notes"]


def test_values_below_zero_are_no_light(capsys: pytest.CaptureFixture[str]) -> None:
    pixels = light(1)
    write("b.exr", {"colour": pixels})
    pixels[0, 0, 0] = -0.1
    write("a.exr", {"colour": pixels})
    record = compared("a.exr", "b.exr", "-o", "out", capsys=capsys)
    assert record["flip"] > 0 and any("as black" in note for note in record["notes"])
    write("a.exr", {"colour": pixels - 1})
    assert compared("a.exr", "b.exr", "-o", "out2", capsys=capsys)["flip"] is None


def test_what_is_refused(pair: Any, capsys: pytest.CaptureFixture[str]) -> None:
    write("small.exr", {"colour": light(1)[:4, :5]})
    write("grey.exr", {"colour": light(1)[..., 0]})
    Path("text.exr").write_text("no image")
    Path("cut.exr").write_bytes(Path("a.exr").read_bytes()[:-800])
    Path("folder.exr").mkdir()
    write_deep("deep.exr")
    cases = {
        ("a.exr", "missing.exr"): "missing.exr: there is no such",
        ("missing.exr", "b.exr"): "missing.exr",
        ("a.exr", "text.exr"): "text.exr: can't be read",
        ("cut.exr", "b.exr"): "cut.exr: can't be read as OpenEXR (Warning: Exception raised reading pixel data",
        ("folder.exr", "b.exr"): "folder.exr",
        ("deep.exr", "b.exr"): "a flat, not a deep, EXR",
        ("a.exr", "small.exr"): "a.exr is 16x10 and small.exr is 5x4",
        ("a.exr", "grey.exr"): "channels R G B",
        ("a.exr", "b.exr", "--layer", "indrect"): "did you mean 'indirect'?",
        ("a.exr", "b.exr", "--layer", "direct"): "'colour', 'depth', 'indirect'",
        ("a.exr", "b.exr", "--region", "1,2,3"): "x,y,width,height",
        ("a.exr", "b.exr", "--region", "-1,2,3,4"): "x,y,width,height",
        ("a.exr", "b.exr", "--region", "1.5,2,3,4"): "x,y,width,height",
        ("a.exr", "b.exr", "--region", "1,2,0,4"): "no pixels",
        ("a.exr", "b.exr", "--region", f"0,0,{W + 1},{H}"): f"{W}x{H}",
        ("a.exr", "b.exr", "--region", f"0,{H},1,1"): "outside",
        ("a.exr", "b.exr", "-o", "a.exr"): "-o",
        ("a.exr", "b.exr", "-o", "/proc/nowhere"): "-o",
        ("a.exr", "b.exr", "-o", ""): "-o",
        ("a.exr",): "B.exr",
        ("a.exr", "b.exr", "c.exr"): "c.exr",
    }
    for arguments, hint in cases.items():
        assert hint in refused(["compare", *arguments], capsys), arguments


def test_pixels_that_are_no_numbers_are_pointed_at(pair: Any, capsys: pytest.CaptureFixture[str]) -> None:
    pixels = light(1)
    pixels[3, 5, 1] = np.nan
    write("c.exr", {"colour": pixels, "depth": pixels[..., 0]})
    said = refused(["compare", "c.exr", "b.exr", "-o", "out"], capsys)
    assert "c.exr: a pixel of layer 'colour' is not finite, the first at x=5, y=3 (nan)" in said
    pixels[3, 2], pixels[7, 7, 0] = np.inf, -np.inf
    write("c.exr", {"colour": pixels, "depth": pixels[..., 0]})
    assert "3 pixels of layer 'colour' are not finite, the first at x=2, y=3 (inf)" in refused(
        ["compare", "a.exr", "c.exr"], capsys
    )
    assert "2 pixels of layer 'depth'" in refused(["compare", "c.exr", "b.exr", "--layer", "depth"], capsys)


def test_the_images_compared_are_not_overwritten(pair: Any, capsys: pytest.CaptureFixture[str]) -> None:
    Path("out").mkdir()
    Path("b.exr").rename("out/error.png")
    assert "one of the images" in refused(["compare", "a.exr", "out/error.png", "-o", "out"], capsys)


def test_a_failure_leaves_the_old_pictures(
    pair: Any, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    compared("a.exr", "b.exr", "-o", "out", capsys=capsys)
    before = {name: Path("out", name).read_bytes() for name in files(Path("out"))}

    def broken(*_: object, **__: object) -> None:
        raise OSError("disk full")

    monkeypatch.setattr("lab.commands.compare.write_text", broken)
    assert main(["compare", "b.exr", "a.exr", "-o", "out"]) == 1
    assert "disk full" in capsys.readouterr().err
    assert {name: Path("out", name).read_bytes() for name in files(Path("out"))} == before
