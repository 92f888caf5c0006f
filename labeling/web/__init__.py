"""The static page of the console, served by the API."""
