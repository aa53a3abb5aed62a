"""Two benchmarks of the same view: what got faster or slower, and whether that is more than noise."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from lab.bench.definitions import RATIOS
from lab.bench.others import QUIET
from lab.bench.spread import Spread, differ, is_spread
from lab.errors import LabError
from lab.report import read_json

Record = dict[str, Any]

FASTER, SLOWER, SAME = "faster", "slower", "within noise"


@dataclass(frozen=True)
class Change:
    """One time before and now; `factor` = now over before."""

    name: str
    before: Spread
    now: Spread

    @property
    def factor(self) -> float:
        """Below 1 where it got faster."""
        return float(self.now["median"] / self.before["median"]) if self.before["median"] else 1.0

    @property
    def verdict(self) -> str:
        """:data:`SAME` unless the quartiles lie apart."""
        if not differ(self.before, self.now):
            return SAME
        return FASTER if self.factor < 1 else SLOWER


@dataclass(frozen=True)
class Comparison:
    """All times that both records have, their ratios, and what makes them less comparable."""

    changes: list[Change]
    limits: list[Change]
    ratios: dict[str, tuple[float, float]]
    warnings: list[str]


def read_benchmark(path: str | Path) -> list[Record]:
    """The records of a file that ``lab bench`` has written, one a scene, or a :class:`LabError`."""
    wanted = "give the JSON of an earlier lab bench"
    found = read_json("--compare", path, wanted)
    records = found.get("scenes", [found]) if isinstance(found, dict) else []
    if not isinstance(records, list) or not records or not all(_is_benchmark(record) for record in records):
        raise LabError(f"--compare {path}: is no benchmark; {wanted}")
    return records


def _is_benchmark(record: object) -> bool:
    parts = ("scene", "params", "machine", "stages_ms", "limits", "ratios")
    if not isinstance(record, dict) or not all(isinstance(record.get(name), dict) for name in parts):
        return False
    return bool(record["stages_ms"]) and all(is_spread(ms) for ms in record["stages_ms"].values())


def counterpart(header: Record, records: list[Record], path: str | Path) -> Record:
    """The one of `records` that measured the same as `header` says, or a :class:`LabError` that tells what differs."""
    name = header["scene"]["name"]
    named = [record for record in records if record["scene"].get("name") == name]
    if not named:
        others = ", ".join(str(record["scene"].get("name")) for record in records)
        raise LabError(f"--compare {path}: measured {others}, not {name}; a comparison needs the same scene")
    found = min(named, key=lambda record: len(list(_differences(header, record))))
    different = list(_differences(header, found))
    if different:
        raise LabError(
            f"--compare {path}: {name} was measured otherwise there: {'; '.join(different)}. "
            "Give the same flags, or compare with another file"
        )
    return found


def _differences(now: Record, before: Record) -> Iterator[str]:
    """What must be alike for times to be comparable, where it is not."""
    for name in ("triangles", "lights", "size", "camera"):
        mine, other = now["scene"][name], before["scene"].get(name)
        if mine != other:
            yield name if isinstance(mine, dict) else f"{name} {other} there, {mine} here"
    for name, value in now["params"].items():
        # A setting that is new since then had no other value.
        if name in before["params"] and before["params"][name] != value:
            yield f"{name}={before['params'][name]} there, {value} here"
    if now["engine"] != before.get("engine"):
        yield f"engine {before.get('engine')} there, {now['engine']} here"
    if now["engine"] == "cpu" and now["machine"]["threads"] != before["machine"].get("threads"):
        yield f"{before['machine'].get('threads')} threads there, {now['machine']['threads']} here"


def compare(now: Record, before: Record) -> Comparison:
    """`now` against `before`, which :func:`counterpart` has found to be of the same view."""
    warnings = []
    for name in ("cpu", "cores", "os", "simd"):
        mine, other = now["machine"].get(name), before["machine"].get(name)
        if mine != other:
            warnings.append(f"another machine: {name} was {other}, is {mine}")
    mine, other = now.get("device") or {}, before.get("device") or {}
    warnings += [
        f"another device: {name} was {other.get(name)}, is {mine[name]}"
        for name in ("name", "driver")
        if mine.get(name) != other.get(name)
    ]
    for when, record in (("then", before), ("now", now)):
        share = record.get("share_of_others")
        if isinstance(share, float) and share > QUIET:
            warnings.append(f"{when}, other programs had {share:.0%} of the processors")
    both = [Change(name, other, mine) for name, mine, other in _pairs(now, before)]
    limits = [change for change in both if _of_a_limit(change.name)]
    apart = [change for change in limits if change.verdict != SAME and not 0.9 < change.factor < 1.1]
    if apart:
        warnings.append(
            "the machine's own limits have changed by more than noise and a tenth, so it was busier or is another: "
            + ", ".join(f"{change.name} x {change.factor:.2f}" for change in apart)
        )
    ratios = {
        name: (before["ratios"][name], now["ratios"][name])
        for name in RATIOS
        if before["ratios"].get(name) is not None and now["ratios"].get(name) is not None
    }
    return Comparison([change for change in both if not _of_a_limit(change.name)], limits, ratios, warnings)


def _of_a_limit(name: str) -> bool:
    return "limits" in name or name.endswith("stream")


def _pairs(now: Record, before: Record, prefix: str = "") -> Iterator[tuple[str, Spread, Spread]]:
    """Every time of both, by the path to it: ``frame``, ``light``, ``fast_frame light`` ..."""
    for name, mine in now.items():
        other = before.get(name)
        if not isinstance(mine, dict) or not isinstance(other, dict) or name.endswith("_per_s"):
            continue
        path = f"{prefix} {name}".strip() if name != "stages_ms" else prefix
        if is_spread(mine) and is_spread(other):
            yield path.removesuffix("_ms"), mine, other
        else:
            yield from _pairs(mine, other, path.removesuffix("_ms"))


def to_record(comparison: Comparison, path: str | Path) -> Record:
    """As the JSON holds it."""
    return {
        "with": str(path),
        "times": {
            change.name: {
                "before": change.before,
                "now": change.now,
                "factor": change.factor,
                "verdict": change.verdict,
            }
            for change in comparison.changes + comparison.limits
        },
        "ratios": {name: {"before": before, "now": now} for name, (before, now) in comparison.ratios.items()},
        "warnings": comparison.warnings,
    }
