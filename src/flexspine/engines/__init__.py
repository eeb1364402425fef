"""Other people's rigid-body engines, fed with the same descriptions."""
