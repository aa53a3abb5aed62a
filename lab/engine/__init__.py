"""The engines: one method a stage, the same records in and out."""

from lab.engine.engine import STAGES, Engine, create_engine

__all__ = ["STAGES", "Engine", "create_engine"]
