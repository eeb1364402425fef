"""Feedback for bounders, and drives of articulated robots."""
