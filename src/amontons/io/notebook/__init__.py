"""Results in notebooks: a few lines of HTML, tables of pandas and xarray, a view that turns."""
