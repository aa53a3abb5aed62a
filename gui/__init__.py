"""The inspector: see inside the hierarchy, in the browser (trame) or a window (pyvista). No numerics here: `lab` has them."""
