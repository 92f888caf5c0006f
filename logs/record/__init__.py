"""The record of one trial: written while it runs, read back whole or salvaged."""
