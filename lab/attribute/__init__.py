"""The error budget: where the error of a real-time frame comes from, from the path-traced truth on."""

from lab.attribute.budget import Effort, ErrorBudget
from lab.attribute.measure import attribute

__all__ = ["Effort", "ErrorBudget", "attribute"]
