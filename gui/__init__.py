"""The inspector: see inside the hierarchy, in the browser (trame) or in a window (pyvista).

No numerics here: `lab` has them.
"""
