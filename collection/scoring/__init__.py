"""Predictions for recorded takes, made beside the session."""
