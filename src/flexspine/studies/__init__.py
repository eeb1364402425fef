"""Questions put to many gaits: comparisons, tables, verdicts."""
