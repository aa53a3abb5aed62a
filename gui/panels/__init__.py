"""The parts of the inspector's page, one module each: what it shows, and what a click in it does."""
