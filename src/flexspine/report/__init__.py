"""Pictures of runs: figures over time, strips of postures, animations. Simulates nothing."""
