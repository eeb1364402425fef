"""The animals, their presets, and how to run them."""
