"""The engines: one method a stage, the same records in and out."""

from lab.engine.engine import ENGINES, STAGES, Engine, create_engine

__all__ = ["ENGINES", "STAGES", "Engine", "create_engine"]
