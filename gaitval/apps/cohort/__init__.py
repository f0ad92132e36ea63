"""Many studies: their table, their run on a Dask cluster, and one report of all."""
