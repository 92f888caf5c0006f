"""The terminal console: the page's keys over SSH, and when no browser is at hand."""
