"""Curvature of the displacement sensor."""
