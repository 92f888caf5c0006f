"""A session: opened or resumed, led trial after trial, ended, summed up."""
