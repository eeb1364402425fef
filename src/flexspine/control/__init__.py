"""Control of articulated robots."""
