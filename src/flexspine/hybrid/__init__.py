"""Systems that flow and jump: fields, guards, resets, events; knows nothing of legs."""
