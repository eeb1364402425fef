"""Speed as ratios against peers on the same work."""
