"""The parts of a report page: each turns one kind of result into HTML."""
