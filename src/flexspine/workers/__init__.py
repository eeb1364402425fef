"""Who does a piece of work: this process, others on this machine, or a Dask cluster."""
