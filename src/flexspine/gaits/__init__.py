"""What can be said about strides and gaits."""
