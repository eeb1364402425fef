"""Pictures of runs: figures over time, strips of postures, animations. Nothing is simulated here."""
